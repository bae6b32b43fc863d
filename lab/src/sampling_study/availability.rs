//! Availability by pixel: the share of an output frame's samples that a set holds.

use depth_image::DepthImage;
use rayon::prelude::*;

use super::held::{ImageSurfaces, held_samples, is_held};

/// The shares of many frames.
#[derive(Debug, Clone, Default)]
pub struct Availability(Vec<f64>);

impl Availability {
    /// Adds one frame.
    pub fn add(&mut self, frame: &DepthImage, set: &[ImageSurfaces<'_>]) {
        let samples = held_samples(frame);
        if !samples.is_empty() {
            let available = samples.par_iter().filter(|sample| is_held(sample, set)).count();
            self.0.push(available as f64 / samples.len() as f64);
        }
    }

    /// The mean over frames, per cent.
    pub fn mean(&self) -> f64 {
        100.0 * self.0.iter().fold(0.0, |sum, share| sum + share) / self.0.len().max(1) as f64
    }

    /// The least of any frame, per cent.
    pub fn least(&self) -> f64 {
        100.0 * self.0.iter().copied().fold(1.0, f64::min)
    }
}
