//! Data over two axes.

use serde::{Deserialize, Serialize};

/// The mark of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// A line through marked points.
    Line,
    /// Points alone.
    Points,
}

/// One data point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The horizontal coordinate.
    pub x: f64,
    /// The vertical coordinate.
    pub y: f64,
    /// The label beside the point; may be empty. It is not drawn over another.
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

/// Points under one name. Points that are not finite, or that a logarithmic axis cannot show, are not drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// The name in the legend; a name has the same colour in all charts.
    pub name: String,
    /// Points, in drawing order.
    pub points: Vec<Point>,
    /// The mark.
    pub mark: Mark,
    /// The index of the first extrapolated point: it and later ones are dashed, hollow, and named so in the legend.
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

    /// True where the point of an index is extrapolated.
    pub(super) fn is_extrapolated(&self, index: usize) -> bool {
        self.extrapolated_from.is_some_and(|first| index >= first)
    }
}

/// A horizontal line: a bar to reach, a theoretical bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// The label of the line.
    pub name: String,
    /// The vertical coordinate.
    pub y: f64,
}
