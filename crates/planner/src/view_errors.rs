//! Errors of one view, and what they say about a budget.

use serde::{Deserialize, Serialize};

use crate::budget::{ErrorTerm, Statistic};
use crate::invalid::{InvalidField, within};
use crate::metric::Metric;

/// Views with a smaller share of foreground do not count where each view is judged by itself.
const LEAST_FOREGROUND_RATIO: f64 = 0.01;

/// Errors of a view against its truth, which is drawn directly. All are from 0 to 1; those over the foreground are 0 where
/// there is none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ViewErrors {
    /// The share of pixels that show a surface in either picture.
    pub foreground_ratio: f64,
    /// Mean FLIP over the foreground.
    pub flip: f64,
    /// Mean FLIP over all pixels.
    pub flip_whole: f64,
    /// Mean squared error over the foreground, of a full scale of 1.
    pub mean_square: f64,
    /// The share of the foreground that no sample camera sees.
    pub disoccluded_ratio: f64,
}

impl ViewErrors {
    /// # Errors
    /// For a value that is not from 0 to 1, by its field.
    pub fn validate(&self) -> Result<(), InvalidField> {
        for (value, field) in self.values().into_iter().zip(FIELDS) {
            within(value, 0.0..=1.0, field, "from 0 to 1")?;
        }
        Ok(())
    }

    /// All values, in the order of the fields.
    pub(crate) fn values(&self) -> [f64; 5] {
        [self.foreground_ratio, self.flip, self.flip_whole, self.mean_square, self.disoccluded_ratio]
    }

    /// The error that a term limits, as a ratio.
    #[must_use]
    pub fn error_ratio(&self, metric: Metric) -> f64 {
        match metric {
            Metric::Flip => self.flip,
            Metric::FlipWhole => self.flip_whole,
            Metric::Psnr => self.mean_square,
            Metric::Disocclusion => self.disoccluded_ratio,
        }
    }

    /// The share of pixels that an error is the mean of.
    #[must_use]
    pub fn weight(&self, metric: Metric) -> f64 {
        if metric == Metric::FlipWhole { 1.0 } else { self.foreground_ratio }
    }

    /// y: the mean over all pixels of foreground · (error − `most_ratio`). A budget holds in the mean where the expected
    /// value is at most 0.
    #[must_use]
    pub fn excess(&self, metric: Metric, most_ratio: f64) -> f64 {
        self.weight(metric) * (self.error_ratio(metric) - most_ratio)
    }

    /// Whether the view counts for a term. Where each view is judged by itself, it has to show something.
    #[must_use]
    pub fn counts_for(&self, term: &ErrorTerm) -> bool {
        term.statistic() == Statistic::Mean || self.weight(term.metric()) >= LEAST_FOREGROUND_RATIO
    }
}

const FIELDS: [&str; 5] = ["foreground_ratio", "flip", "flip_whole", "mean_square", "disoccluded_ratio"];
