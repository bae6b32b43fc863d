//! Metrics by visibility: independent of resolution, of seeded samples, by rays on the host.

use depth_image::{DepthImage, PinholeCamera};
use rayon::prelude::*;
use render::scalar::rays::Scene;
use sampling::{SamplingMethod, scalar::is_visibility_redundant};

use super::held::{HeldSample, held_samples};

/// A share of seeded samples.
#[derive(Debug, Clone, Copy, Default)]
pub struct Estimate {
    /// The share; NaN without samples.
    pub share: f64,
    /// Half the width of the 95 % interval.
    pub half_width: f64,
}

/// Estimates of one image.
#[derive(Debug, Clone, Copy, Default)]
pub struct VisibilityEstimates {
    pub redundant: Estimate,
    pub disoccluded: Estimate,
    /// The share of its disoccluded samples.
    pub useful: Estimate,
}

impl Estimate {
    fn of(count: usize, n: usize) -> Self {
        let share = count as f64 / n as f64;
        Self { share, half_width: 1.96 * (share * (1.0 - share) / n as f64).sqrt() }
    }
}

/// Estimates of all images of a set. `viewpoints` are those of conventional sampling, `views` lie between them.
pub fn seen(
    scene: &Scene,
    method: SamplingMethod,
    set: &[DepthImage],
    viewpoints: &[PinholeCamera],
    views: &[PinholeCamera],
    seeds: usize,
) -> Vec<VisibilityEstimates> {
    let own: Vec<PinholeCamera> = set.iter().map(|image| *image.camera.reference()).collect();
    let images = set.iter().enumerate().map(|(number, image)| {
        let samples = seeded(held_samples(image), seeds);
        // Whether one of some cameras sees a sample, too.
        let by = |sample: &HeldSample, cameras: &[PinholeCamera]| {
            let depth = (sample.point_in_world - own[number].eye_in_world).dot(own[number].forward_in_world());
            let footprint_m = depth / own[number].focal_px.min_element();
            cameras.iter().any(|camera| is_visibility_redundant(scene, sample.point_in_world, footprint_m, camera))
        };
        // All that the shared viewpoint of peeled layers sees is in the first layer.
        let earlier = match method {
            SamplingMethod::DepthPeeling { .. } => &own[..number.min(1)],
            _ => &own[..number],
        };
        let beside = match method {
            SamplingMethod::DepthPeeling { .. } => viewpoints,
            _ => &viewpoints[number..=number],
        };
        let redundant = samples.par_iter().filter(|sample| by(sample, earlier)).count();
        let disoccluded: Vec<&HeldSample> = samples.par_iter().filter(|sample| !by(sample, beside)).collect();
        let useful = disoccluded.par_iter().filter(|sample| by(sample, views)).count();
        VisibilityEstimates {
            redundant: Estimate::of(redundant, samples.len()),
            disoccluded: Estimate::of(disoccluded.len(), samples.len()),
            useful: Estimate::of(useful, disoccluded.len()),
        }
    });
    images.collect()
}

/// The first `count` samples of a fixed permutation.
fn seeded(mut samples: Vec<HeldSample>, count: usize) -> Vec<HeldSample> {
    samples.sort_by_key(|sample| scrambled(sample.index as u32));
    samples.truncate(count);
    samples
}

/// A permutation of numbers without a pattern that images could share (the finish of `MurmurHash3`).
fn scrambled(mut n: u32) -> u32 {
    n = (n ^ (n >> 16)).wrapping_mul(0x85eb_ca6b);
    n = (n ^ (n >> 13)).wrapping_mul(0xc2b2_ae35);
    n ^ (n >> 16)
}
