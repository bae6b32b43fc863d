//! Errors of views, as nodes measure them for budgets and audits.

use serde::{Deserialize, Serialize};

use crate::check::{InvalidField, within};

/// Errors of a view, each from 0 to 1; see `planner::ViewErrors`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "as there")]
pub struct ProbedView {
    pub foreground_ratio: f64,
    pub flip: f64,
    pub flip_whole: f64,
    pub mean_square: f64,
    pub disoccluded_ratio: f64,
}

impl ProbedView {
    pub(crate) fn validate(&self) -> Result<(), InvalidField> {
        let Self { foreground_ratio, flip, flip_whole, mean_square, disoccluded_ratio } = *self;
        let fields = [
            (foreground_ratio, "foreground_ratio"),
            (flip, "flip_ratio"),
            (flip_whole, "flip_whole_ratio"),
            (mean_square, "mean_square_ratio"),
            (disoccluded_ratio, "disoccluded_ratio"),
        ];
        fields.into_iter().try_for_each(|(value, field)| within(value, 0.0..=1.0, field, "from 0 to 1"))
    }
}
