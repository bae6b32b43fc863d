//! An axis as the chart library needs it: a range with given ticks.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use super::Axis;
use crate::table::format_number;

/// A range of axis space.
#[derive(Clone)]
pub(super) struct Ruler {
    axis: Axis,
    range: Range<f64>,
    pub(super) ticks: Vec<f64>,
}

impl Ruler {
    pub(super) fn new(axis: &Axis, range: Range<f64>) -> Self {
        Self { ticks: axis.ticks(&range), axis: axis.clone(), range }
    }
}

impl Ranged for Ruler {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (first_px, last_px): (i32, i32)) -> i32 {
        let share = (place - self.range.start) / (self.range.end - self.range.start);
        (f64::from(first_px) + share * f64::from(last_px - first_px)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Ruler {
    fn format_ext(&self, place: &f64) -> String {
        format_number(self.axis.value(*place))
    }
}
