//! Availability by pixel: the share of an output frame's samples that a set holds.

use depth_image::DepthImage;
use rayon::prelude::*;

use super::held::{Held, held_samples};

/// Availability over many frames.
#[derive(Debug, Clone, Copy)]
pub struct Availability {
    sum: f64,
    least: f64,
    frames: usize,
}

impl Default for Availability {
    fn default() -> Self {
        Self { sum: 0.0, least: 1.0, frames: 0 }
    }
}

impl Availability {
    /// Adds one frame.
    pub fn add(&mut self, frame: &DepthImage, set: &[Held<'_>]) {
        let samples = held_samples(frame);
        if samples.is_empty() {
            return;
        }
        let available = samples.par_iter().filter(|sample| set.iter().any(|image| image.has(sample))).count();
        let share = available as f64 / samples.len() as f64;
        self.sum += share;
        self.least = self.least.min(share);
        self.frames += 1;
    }

    /// The mean over frames, per cent.
    pub fn mean(&self) -> f64 {
        100.0 * self.sum / self.frames.max(1) as f64
    }

    /// The least of any frame, per cent.
    pub fn least(&self) -> f64 {
        100.0 * self.least
    }
}
