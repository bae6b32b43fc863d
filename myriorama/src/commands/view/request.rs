//! Settings of the session of the views.

use app_core::delivery::{SessionSettings, viewpoints};
use cluster::{OfferStatus, Timeline};
use depth_image::{PinholeCamera, ViewPlanes};
use render::Lighting;

use super::args::ViewArgs;

pub(super) fn session_settings(args: &ViewArgs, offer: &OfferStatus, cameras: &[PinholeCamera]) -> SessionSettings {
    let mut settings = SessionSettings::offered(offer);
    settings.method = args.method.map_or(settings.method, |method| method.to_string());
    settings.lighting = args.lighting.map_or(settings.lighting, |lighting| lighting.to_string());
    let settings = if args.live { settings.at_rate(args.rate) } else { settings };
    SessionSettings {
        tiles: args.tiles,
        refinement_steps: if args.refine { refinement_steps(&settings.lighting) } else { 1 },
        codec: args.codec.to_string(),
        policy: args.policy,
        planes: ViewPlanes { inverse_depth: args.depth, provenance: args.provenance },
        timeline: timeline(args.frames, args.frame_step, args.refine),
        viewpoints: if args.cells || args.viewpoints.around.is_some() { viewpoints(cameras) } else { Vec::new() },
        ..settings
    }
}

/// A picture that is refined stands still: motion would begin the refinement anew.
fn timeline(set_count: u32, step_s: f64, refine: bool) -> Timeline {
    Timeline { start_s: 0.0, step_s: if refine { 0.0 } else { step_s }, set_count }
}

/// The steps of a lighting; one where a newer coordinator names a lighting that is not known here.
fn refinement_steps(lighting: &str) -> u32 {
    lighting.parse().map_or(1, |lighting: Lighting| lighting.refinement_steps())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refined_timeline_stands_still() {
        assert!(timeline(4, 0.1, false).moves());
        assert!(!timeline(4, 0.1, true).moves() && timeline(4, 0.1, true).set_count == 4);
        assert!(!timeline(1, 0.1, false).moves(), "one set");
    }
}
