//! The errors of frames, and of their changes.

use depth_image::View;
use metrics::{MetricsError, change_error_map, flip_map, foreground};

/// A frame as it is delivered, and the same view drawn from the scene, with depth.
#[derive(Debug, Clone, Copy)]
pub struct Compared<'a> {
    pub truth: &'a View,
    pub view: &'a View,
}

/// The error of a frame, and of its change from the frame before, over the foreground.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    pub flip: f64,
    /// In shares of full scale.
    pub change_error: f64,
}

impl Figures {
    /// Compares a frame with the one before.
    ///
    /// # Errors
    /// The views differ in size.
    pub fn new(before: Compared<'_>, frame: Compared<'_>) -> Result<Self, MetricsError> {
        let mask = foreground(frame.truth, frame.view)?;
        let change_error =
            change_error_map([before.truth, frame.truth], [before.view, frame.view])?.mean(Some(&mask))?;
        let flip = flip_map(frame.truth, frame.view)?.mean(Some(&mask))?;
        Ok(Self { flip: flip.unwrap_or(0.0), change_error: change_error.unwrap_or(0.0) })
    }
}
