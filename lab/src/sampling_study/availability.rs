//! Availability by pixel: the share of an output frame's samples that a set holds.

use depth_image::DepthImage;
use rayon::prelude::*;

use super::held::{ImageSurfaces, held_samples};

/// The shares of many frames.
#[derive(Debug, Clone, Default)]
pub struct Availability {
    /// A sample is available, too, where an image has its triangle this many pixels away. The paper's metric has 0.
    reach_px: usize,
    shares: Vec<f64>,
}

impl Availability {
    /// Availability at a pixel or at most `reach_px` away.
    pub fn within(reach_px: usize) -> Self {
        Self { reach_px, ..Self::default() }
    }

    /// Adds one frame.
    pub fn add(&mut self, frame: &DepthImage, set: &[ImageSurfaces<'_>]) {
        let samples = held_samples(frame);
        if !samples.is_empty() {
            let held =
                samples.par_iter().filter(|sample| set.iter().any(|image| image.has_within(sample, self.reach_px)));
            let available = held.count();
            self.shares.push(available as f64 / samples.len() as f64);
        }
    }

    /// The mean over frames, per cent.
    pub fn mean(&self) -> f64 {
        100.0 * self.shares.iter().fold(0.0, |sum, share| sum + share) / self.shares.len().max(1) as f64
    }

    /// The least of any frame, per cent.
    pub fn least(&self) -> f64 {
        100.0 * self.shares.iter().copied().fold(1.0, f64::min)
    }
}
