//! What is drawn over two axes.

use serde::{Deserialize, Serialize};

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// A line through marked points.
    Line,
    /// Points alone.
    Points,
}

/// One measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis.
    pub y: f64,
    /// Written beside it; may be empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub label: String,
}

impl Point {
    /// A point with a label.
    #[must_use]
    pub fn labelled(x: f64, y: f64, label: impl Into<String>) -> Self {
        Self { x, y, label: label.into() }
    }
}

impl From<(f64, f64)> for Point {
    fn from((x, y): (f64, f64)) -> Self {
        Self::labelled(x, y, "")
    }
}

/// Points under one name. Points whose coordinates are not finite are left out, and so are points that a
/// logarithmic axis cannot show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// In the legend; the same name has the same colour in all charts.
    pub name: String,
    /// In drawing order.
    pub points: Vec<Point>,
    /// How they are drawn.
    pub mark: Mark,
    /// Index of the first point that was extrapolated, not measured: dashed, hollow and said so in the legend.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extrapolated_from: Option<usize>,
}

impl Series {
    /// A line through measured points.
    #[must_use]
    pub fn line<P: Into<Point>>(name: impl Into<String>, points: impl IntoIterator<Item = P>) -> Self {
        let points =
            points.into_iter().map(Into::into).filter(|point: &Point| point.x.is_finite() && point.y.is_finite());
        Self { name: name.into(), points: points.collect(), mark: Mark::Line, extrapolated_from: None }
    }

    /// Measured points without a line.
    #[must_use]
    pub fn points<P: Into<Point>>(name: impl Into<String>, points: impl IntoIterator<Item = P>) -> Self {
        Self { mark: Mark::Points, ..Self::line(name, points) }
    }

    /// The same series with extrapolated points after the measured ones.
    #[must_use]
    pub fn then_extrapolated<P: Into<Point>>(mut self, points: impl IntoIterator<Item = P>) -> Self {
        let more = Self::line("", points).points;
        if !more.is_empty() {
            self.extrapolated_from.get_or_insert(self.points.len());
            self.points.extend(more);
        }
        self
    }

    /// Whether the point of an index was extrapolated.
    pub(super) fn is_extrapolated(&self, index: usize) -> bool {
        self.extrapolated_from.is_some_and(|first| index >= first)
    }
}

/// A horizontal line: a bar to reach, a theoretical bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Written on it.
    pub name: String,
    /// Where it lies on the vertical axis.
    pub y: f64,
}
