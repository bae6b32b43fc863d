//! Errors of one view.

use serde::{Deserialize, Serialize};

use crate::budget::{Budget, Metric};
use crate::invalid::{InvalidField, within};

/// Errors of a view, or of a part of one, against the same drawn directly. All are from 0 to 1; errors are 0 where no pixel
/// shows a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ViewErrors {
    /// The share of pixels that show a surface in either picture.
    pub foreground_ratio: f64,
    /// Mean FLIP over the foreground.
    pub flip: f64,
    /// Mean squared error over the foreground, of a full scale of 1.
    pub mean_square: f64,
}

impl ViewErrors {
    /// A view that equals its truth.
    pub const NONE: Self = Self { foreground_ratio: 1.0, flip: 0.0, mean_square: 0.0 };

    /// # Errors
    /// For a value that is not from 0 to 1, by its field.
    pub fn validate(&self) -> Result<(), InvalidField> {
        within(self.foreground_ratio, 0.0..=1.0, "foreground_ratio", "from 0 to 1")?;
        within(self.flip, 0.0..=1.0, "flip_ratio", "from 0 to 1")?;
        within(self.mean_square, 0.0..=1.0, "mean_square_ratio", "from 0 to 1")
    }

    /// The error that a budget limits, as a ratio.
    #[must_use]
    pub fn error_ratio(&self, budget: &Budget) -> f64 {
        match budget.metric() {
            Metric::Flip => self.flip,
            Metric::Psnr => self.mean_square,
        }
    }

    /// y: the mean over all pixels of foreground · (error − limit). A budget is kept where the expected value is at most 0.
    #[must_use]
    pub fn excess(&self, budget: &Budget) -> f64 {
        self.foreground_ratio * (self.error_ratio(budget) - budget.most_ratio())
    }

    /// The mean error over the foreground of all views together, as a ratio; 0 without a foreground.
    #[must_use]
    pub fn mean_error(views: &[Self], budget: &Budget) -> f64 {
        let foreground: f64 = views.iter().map(|view| view.foreground_ratio).sum();
        let error: f64 = views.iter().map(|view| view.foreground_ratio * view.error_ratio(budget)).sum();
        error / foreground.max(f64::MIN_POSITIVE)
    }
}
