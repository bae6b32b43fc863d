//! Axes: label, unit, scale, range and ticks.
//!
//! Drawing is always linear: a logarithmic axis is drawn over the logarithm of its values ("axis space"). All charts
//! then share one kind of coordinate and one choice of ticks.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// The scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Equal differences have equal distances.
    Linear,
    /// Equal ratios have equal distances; values must be above 0.
    Log,
}

/// One axis of a chart.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Axis {
    /// The quantity.
    pub label: String,
    /// The unit; empty for none.
    pub unit: String,
    /// The scale.
    pub scale: Scale,
}

/// The number of ticks to aim at.
const TICKS: f64 = 6.0;
/// A linear axis starts at 0 if its least value is below this share of the greatest.
const NEAR_ZERO: f64 = 0.5;
/// Room beyond the outermost values, as a share of their range.
const PADDING: f64 = 0.04;

impl Axis {
    /// An evenly spread axis.
    #[must_use]
    pub fn linear(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), scale: Scale::Linear }
    }

    /// An axis spread by ratio.
    #[must_use]
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { scale: Scale::Log, ..Self::linear(label, unit) }
    }

    /// A value's place in axis space; `None` where the axis cannot show it.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Linear => value,
            Scale::Log => value.log10(),
        };
        place.is_finite().then_some(place)
    }

    /// The value at a place in axis space.
    pub(super) fn value(&self, place: f64) -> f64 {
        match self.scale {
            Scale::Linear => place,
            Scale::Log => 10_f64.powf(place),
        }
    }

    /// A range in axis space with room for all values.
    pub(super) fn range(&self, values: impl Iterator<Item = f64>) -> Range<f64> {
        let places = values.filter_map(|value| self.place(value));
        let found = places.fold(None, |range: Option<(f64, f64)>, place| {
            let (least, greatest) = range.unwrap_or((place, place));
            Some((least.min(place), greatest.max(place)))
        });
        let (least, greatest) = found.unwrap_or((0.0, 1.0));
        match self.scale {
            Scale::Linear => padded_linear(least, greatest),
            Scale::Log => padded_log(least, greatest),
        }
    }

    /// Ticks of a range, in axis space.
    pub(super) fn ticks(&self, range: &Range<f64>) -> Vec<f64> {
        match self.scale {
            Scale::Linear => linear_ticks(range),
            Scale::Log => log_ticks(range),
        }
    }
}

fn padded_linear(least: f64, greatest: f64) -> Range<f64> {
    if least == greatest {
        let room = if least == 0.0 { 1.0 } else { least.abs() * 0.5 };
        return least - room..greatest + room;
    }
    let padding = (greatest - least) * PADDING;
    let start = if least >= 0.0 && least < NEAR_ZERO * greatest { 0.0 } else { least - padding };
    start..greatest + padding
}

fn padded_log(least: f64, greatest: f64) -> Range<f64> {
    const LEAST_SPAN_DECADES: f64 = 0.6;
    let missing = (LEAST_SPAN_DECADES - (greatest - least)).max(0.0) / 2.0;
    let padding = ((greatest - least) * PADDING).max(0.03) + missing;
    least - padding..greatest + padding
}

/// 1, 2 or 5 times a power of ten, the least that gives no more than about [`TICKS`].
fn step(span: f64) -> f64 {
    let rough = span / TICKS;
    let power = 10_f64.powf(rough.log10().floor());
    let multiples = [1.0, 2.0, 5.0, 10.0].map(|multiple| multiple * power);
    multiples.into_iter().find(|&step| step >= rough * 0.999).unwrap_or(10.0 * power)
}

fn linear_ticks(range: &Range<f64>) -> Vec<f64> {
    let step = step(range.end - range.start);
    let first = (range.start / step - 1e-9).ceil() as i64;
    let last = (range.end / step + 1e-9).floor() as i64;
    (first..=last).map(|tick| tick as f64 * step).collect()
}

/// Decades over a wide range; 1, 2, 5 over a middling one; even steps over a narrow one.
fn log_ticks(range: &Range<f64>) -> Vec<f64> {
    let span = range.end - range.start;
    if span < 0.7 {
        let values = linear_ticks(&(10_f64.powf(range.start)..10_f64.powf(range.end)));
        return values.into_iter().map(f64::log10).filter(|place| range.contains(place)).collect();
    }
    let decades = range.start.floor() as i32..=range.end.ceil() as i32;
    let stride = (span / (TICKS + 2.0)).ceil() as usize;
    let multiples: &[f64] = if span < 2.6 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let ticks = decades.step_by(stride).flat_map(|decade| multiples.iter().map(move |m| f64::from(decade) + m.log10()));
    ticks.filter(|place| range.contains(place)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_ticks_are_round() {
        let ticks = linear_ticks(&(0.0..104.0));
        assert_eq!(ticks, [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
    }

    #[test]
    fn log_ticks_suit_their_span() {
        let values = |range: Range<f64>| {
            log_ticks(&range).into_iter().map(|place| 10_f64.powf(place).round()).collect::<Vec<_>>()
        };
        assert_eq!(values(-0.1..3.1), [1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(values(-0.1..1.1), [1.0, 2.0, 5.0, 10.0]);
        assert!(log_ticks(&(0.0..0.5)).len() >= 3);
        assert!(log_ticks(&(-12.0..12.0)).len() <= 9);
    }

    #[test]
    fn a_range_holds_what_it_can() {
        let axis = Axis::log("x", "");
        let range = axis.range([1.0, 100.0, 0.0, -3.0, f64::NAN].into_iter());
        assert!(range.start < 0.0 && range.end > 2.0 && range.end < 2.2);
        for axis in [axis, Axis::linear("x", "")] {
            for values in [vec![], vec![5.0], vec![0.0], vec![-2.0, -2.0]] {
                let range = axis.range(values.into_iter());
                assert!(range.end > range.start && !axis.ticks(&range).is_empty(), "{range:?}");
            }
        }
    }
}
