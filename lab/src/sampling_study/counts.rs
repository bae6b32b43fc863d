//! Counts by pixel: redundant, disoccluded and useful samples.

use depth_image::DepthImage;
use rayon::prelude::*;
use sampling::SamplingMethod;

use super::held::{HeldSample, ImageSurfaces, held_samples, is_held};
use super::methods::METHODS;

/// Samples of one image of one method, before dilation and hysteresis.
#[derive(Debug, Clone, Default)]
pub struct ImageCount {
    pub samples: usize,
    /// The number of samples that an earlier image holds.
    pub redundant: usize,
    /// Samples that no conventional image holds: of the same camera or, for peeled layers, of any.
    pub disoccluded: Vec<HeldSample>,
    /// True for each disoccluded sample that some view between the viewpoints needs.
    pub useful: Vec<bool>,
}

/// A share in per cent.
pub(super) fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole as f64
}

impl ImageCount {
    pub fn useful_count(&self) -> usize {
        self.useful.iter().filter(|&&useful| useful).count()
    }
}

/// Counts of the sets of all methods, conventional sampling first.
pub fn image_counts(sets: &[Vec<DepthImage>]) -> Vec<Vec<ImageCount>> {
    let conventional: Vec<ImageSurfaces<'_>> = sets[0].iter().filter_map(ImageSurfaces::of).collect();
    METHODS.iter().zip(sets).map(|(&method, set)| counts_of(method, set, &conventional)).collect()
}

fn counts_of(method: SamplingMethod, set: &[DepthImage], conventional: &[ImageSurfaces<'_>]) -> Vec<ImageCount> {
    let held: Vec<ImageSurfaces<'_>> = set.iter().filter_map(ImageSurfaces::of).collect();
    let counts = set.iter().enumerate().map(|(number, image)| {
        let samples = held_samples(image);
        let beside = match method {
            SamplingMethod::DepthPeeling { .. } => conventional,
            _ => &conventional[number..=number],
        };
        let disoccluded: Vec<HeldSample> =
            samples.par_iter().filter(|sample| !is_held(sample, beside)).copied().collect();
        ImageCount {
            samples: samples.len(),
            redundant: samples.par_iter().filter(|sample| is_held(sample, &held[..number])).count(),
            useful: vec![false; disoccluded.len()],
            disoccluded,
        }
    });
    counts.collect()
}

/// Marks samples that a frame needs: it shows their surface at the same pixel.
pub fn mark_useful(counts: &mut [Vec<ImageCount>], frame: &ImageSurfaces<'_>) {
    for count in counts.iter_mut().flatten() {
        let samples = count.disoccluded.par_iter().zip(count.useful.par_iter_mut());
        samples.filter(|(_, useful)| !**useful).for_each(|(sample, useful)| *useful = frame.has(sample));
    }
}
