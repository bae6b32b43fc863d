//! Charts: their data, and their drawing as SVG.

mod axis;
mod bars;
mod canvas;
mod front;
mod marker;
mod palette;
mod ruler;
mod series;
mod xy;

use serde::{Deserialize, Serialize};

use crate::ReportError;
pub use axis::{Axis, Scale};
pub use bars::{BarChart, Stage};
pub use front::{Better, pareto_front};
pub(crate) use palette::Palette;
pub use series::{Limit, Mark, Point, Series};
pub use xy::XyChart;

/// One chart, written as `charts/{slug(name)}.svg`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Chart {
    /// Lines or points over two axes.
    Xy(XyChart),
    /// Stacked bars: time per stage.
    Bars(BarChart),
}

impl Chart {
    /// The title, unique in the report.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Xy(chart) => &chart.name,
            Self::Bars(chart) => &chart.name,
        }
    }

    /// A note for readers; may be empty.
    #[must_use]
    pub fn note(&self) -> &str {
        match self {
            Self::Xy(chart) => &chart.note,
            Self::Bars(chart) => &chart.note,
        }
    }

    /// The names that have colours in the chart.
    pub(crate) fn series_names(&self) -> Vec<&str> {
        match self {
            Self::Xy(chart) => chart.series.iter().map(|series| series.name.as_str()).collect(),
            Self::Bars(chart) => chart.stages.iter().map(|stage| stage.name.as_str()).collect(),
        }
    }

    /// The chart as SVG, in the palette's colours.
    pub(crate) fn draw(&self, palette: &Palette) -> Result<String, ReportError> {
        match self {
            Self::Xy(chart) => chart.draw(palette),
            Self::Bars(chart) => chart.draw(palette),
        }
    }
}

impl From<XyChart> for Chart {
    fn from(chart: XyChart) -> Self {
        Self::Xy(chart)
    }
}

impl From<BarChart> for Chart {
    fn from(chart: BarChart) -> Self {
        Self::Bars(chart)
    }
}
