//! Exposure and tone curve of commands whose pictures people look at.

use clap::Args;
use cluster::SessionRequest;
use depth_image::{Exposure, ExposureEv, ToneCurve};

/// How pictures are shown.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct ToneArgs {
    /// The exposure of pictures in EV, from -16 to 16, where one more doubles the light; or auto, which is measured once
    /// when a workload is opened [default: auto; 0 with `view --compare`]
    #[arg(long, value_name = "EV", allow_hyphen_values = true)]
    exposure: Option<Exposure>,
    /// The curve from exposed light to pictures: none, which cuts off light beyond white, or khronos-neutral, which keeps
    /// base colours and compresses highlights. `view --compare` maps both pictures alike [default: khronos-neutral; none with
    /// `view --compare`]
    #[arg(long, value_name = "NAME")]
    tone_map: Option<ToneCurve>,
}

impl ToneArgs {
    /// The request with this tone; what is not given suits people.
    #[must_use]
    pub fn for_people(self, request: SessionRequest) -> SessionRequest {
        self.applied(request, Exposure::Auto, ToneCurve::KhronosNeutral)
    }

    /// The request with this tone; what is not given changes no light, as metrics need it.
    #[must_use]
    pub fn for_metrics(self, request: SessionRequest) -> SessionRequest {
        self.applied(request, Exposure::Ev(ExposureEv::ZERO), ToneCurve::None)
    }

    fn applied(self, mut request: SessionRequest, exposure: Exposure, curve: ToneCurve) -> SessionRequest {
        let exposure = self.exposure.unwrap_or(exposure);
        request.auto_exposure = exposure == Exposure::Auto;
        request.planes.tone.exposure = match exposure {
            Exposure::Auto => ExposureEv::ZERO,
            Exposure::Ev(exposure) => exposure,
        };
        request.planes.tone.curve = self.tone_map.unwrap_or(curve);
        request
    }
}
