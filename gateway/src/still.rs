//! The pictures of a pose that rests, from the first to the finished one.
//!
//! A still begins with one sample a pixel, step by step of light, and goes on with more samples. Where light is shared, early
//! stills are balanced, and that of all samples has the visitor's quality. The finest is at last drawn directly, where that does
//! not take long, and has less error: rays of indirect light are noisier than its smoothed samples.

use cluster::{Assignment, Policy, SessionPlan, has_indirect_light};
use depth_image::{Antialias, LightCacheQuality};

use crate::scenes::TYPICAL_PX;

/// The longest predicted time of a still that is drawn directly.
const LONGEST_DRAWING_S: f64 = 20.0;

/// How a picture is lit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PictureLight {
    /// As the session's method has it.
    Session,
    /// From samples, in this quality.
    Shared(LightCacheQuality),
    /// It is drawn from the scene, whatever the plan.
    Drawn,
}

/// The light of a plan's views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlannedLight {
    /// Whether it comes from samples.
    pub(crate) is_shared: bool,
    /// Whether direct drawing has more noise.
    is_smoother: bool,
    /// The time of a typical view that is drawn directly.
    direct_view_s: f64,
}

impl From<&SessionPlan> for PlannedLight {
    fn from(plan: &SessionPlan) -> Self {
        let Assignment { policy, workload, .. } = &plan.assignment;
        let is_shared = *policy != Policy::Direct && workload.planes.light;
        Self { is_shared, is_smoother: has_indirect_light(&workload.lighting), direct_view_s: plan.costs.direct_view_s }
    }
}

/// A still of finished light that is on its way to the page.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Still {
    pub(crate) samples: Antialias,
    pub(crate) light: PictureLight,
    pub(crate) pixel_count: usize,
    /// The time that it took.
    pub(crate) made_s: f64,
}

/// The limits of a visitor's stills.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stills {
    /// The quality of shared light that the visitor wants.
    pub(crate) quality: LightCacheQuality,
    /// Samples a pixel of a finished still: fewer where the cluster has refused more.
    pub(crate) most_samples: Antialias,
    /// Whether a still may be drawn directly: not where the cluster has refused one.
    pub(crate) may_draw: bool,
    /// Steps of light, each of which doubles the rays.
    pub(crate) light_steps: u32,
}

impl Stills {
    /// The light of a still with so many samples a pixel.
    pub(crate) fn light(&self, planned: PlannedLight, samples: Antialias) -> PictureLight {
        let is_last = samples >= self.most_samples;
        match self.quality {
            _ if !planned.is_shared => PictureLight::Session,
            LightCacheQuality::Exact if is_last && self.may_draw => PictureLight::Drawn,
            quality if is_last => PictureLight::Shared(quality.min(LightCacheQuality::Fine)),
            quality => PictureLight::Shared(quality.min(LightCacheQuality::Balanced)),
        }
    }

    /// The still that follows one of finished light; `None` after the last.
    pub(crate) fn after(&self, planned: PlannedLight, still: Still) -> Option<(Antialias, PictureLight)> {
        if still.samples < self.most_samples {
            let samples = more(still.samples).min(self.most_samples);
            return Some((samples, self.light(planned, samples)));
        }
        let is_wanted = self.quality >= LightCacheQuality::Fine && self.may_draw && !planned.is_smoother;
        let is_shared = matches!(still.light, PictureLight::Shared(_));
        let is_quick = self.drawing_s(planned, still) <= LONGEST_DRAWING_S;
        (is_wanted && is_shared && is_quick).then_some((still.samples, PictureLight::Drawn))
    }

    /// The time of drawing a still, at most. Its surfaces take no longer than the still took that has been made, and its light as
    /// long as that of a typical view of the same pixels, which has all rays at its one position; of fewer rays than positions,
    /// each position takes one.
    fn drawing_s(&self, planned: PlannedLight, still: Still) -> f64 {
        let rays = 1 << (self.light_steps.clamp(1, 31) - 1);
        let rays_ratio = (f64::from(still.samples.samples()) / f64::from(rays)).max(1.0);
        let pixels_ratio = still.pixel_count as f64 / f64::from(TYPICAL_PX.element_product());
        still.made_s + planned.direct_view_s * pixels_ratio * rays_ratio
    }
}

/// The samples a pixel of the still after one with so many. Each step costs more than all before it, and positions of one
/// view share their work, which views of one position each would not.
fn more(samples: Antialias) -> Antialias {
    Antialias::of(4 * samples.samples()).unwrap_or(Antialias::MOST)
}

/// The samples a pixel of stills where the cluster refuses so many.
pub(crate) fn fewer(samples: Antialias) -> Antialias {
    Antialias::of(samples.samples() / 4).unwrap_or(Antialias::NONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: usize = 1280 * 720;

    fn stills(quality: LightCacheQuality) -> Stills {
        Stills { quality, most_samples: Antialias::MOST, may_draw: true, light_steps: 5 }
    }

    /// The stills of finished light, by their samples and their light.
    fn all(stills: Stills, planned: PlannedLight) -> Vec<(u32, PictureLight)> {
        let first = (Antialias::NONE, stills.light(planned, Antialias::NONE));
        let made = |(samples, light)| Still { samples, light, pixel_count: PIXELS, made_s: 4.0 };
        let next = |last: &(Antialias, PictureLight)| stills.after(planned, made(*last));
        std::iter::successors(Some(first), next).map(|(samples, light)| (samples.samples(), light)).collect()
    }

    #[test]
    fn shared_light_becomes_finer_and_is_drawn_where_that_is_quick() {
        use LightCacheQuality::{Balanced, Draft, Exact, Fine};
        use PictureLight::{Drawn, Session, Shared};
        let quick = PlannedLight { is_shared: true, is_smoother: false, direct_view_s: 4.0 };
        let slow = PlannedLight { direct_view_s: 4.1, ..quick };
        let early = [(1, Shared(Balanced)), (4, Shared(Balanced))];
        let with = |last: &[(u32, PictureLight)]| [&early, last].concat();
        assert_eq!(all(stills(Fine), quick), with(&[(16, Shared(Fine)), (16, Drawn)]));
        assert_eq!(all(stills(Fine), slow), with(&[(16, Shared(Fine))]));
        let indirect = PlannedLight { is_smoother: true, ..quick };
        assert_eq!(all(stills(Fine), indirect), with(&[(16, Shared(Fine))]));
        assert_eq!(all(stills(Exact), indirect), with(&[(16, Drawn)]), "asked for");
        assert_eq!(all(stills(Exact), slow), with(&[(16, Drawn)]), "asked for");
        assert_eq!(all(stills(Balanced), quick), with(&[(16, Shared(Balanced))]));
        assert_eq!(all(stills(Draft), quick), [1, 4, 16].map(|samples| (samples, Shared(Draft))));
        let unshared = PlannedLight { is_shared: false, ..quick };
        assert_eq!(all(stills(Fine), unshared), [1, 4, 16].map(|samples| (samples, Session)));
        let refused = Stills { may_draw: false, most_samples: fewer(Antialias::MOST), ..stills(Exact) };
        assert_eq!(all(refused, quick), [(1, Shared(Balanced)), (4, Shared(Fine))]);
        // A hard shadow has a ray at each position.
        let hard = Stills { light_steps: 1, ..stills(Fine) };
        assert_eq!(all(hard, PlannedLight { direct_view_s: 0.26, ..quick }).len(), 3);
        assert_eq!(all(hard, PlannedLight { direct_view_s: 0.24, ..quick }).len(), 4);
    }
}
