//! What can go wrong with a report.

use std::path::PathBuf;

use table::TableError;

/// Why a report, chart or picture could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file or folder could not be written.
    #[error("cannot write {path}: {source}")]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Two parts would share a file.
    #[error("two {kind} are named {name:?}, as a file name")]
    DuplicateName {
        /// Tables, charts or pictures.
        kind: &'static str,
        /// The file name without its ending.
        name: String,
    },
    /// A table cannot be written.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A bar chart's stage has not one value a bar.
    #[error("stage {stage:?} of chart {chart:?} has {values} values, its bars are {bars}")]
    StageLength {
        /// The chart's name.
        chart: String,
        /// The stage's name.
        stage: String,
        /// Values in it.
        values: usize,
        /// Bars of the chart.
        bars: usize,
    },
    /// The chart library failed.
    #[error("cannot draw chart {chart:?}: {message}")]
    Draw {
        /// The chart's name.
        chart: String,
        /// What it said.
        message: String,
    },
    /// JSON could not be written.
    #[error("cannot write report.json: {0}")]
    Json(#[from] serde_json::Error),
    /// A picture could not be encoded.
    #[error("cannot write a picture: {0}")]
    Image(#[from] image::ImageError),
    /// The page could not be filled in.
    #[error("cannot write index.html: {0}")]
    Html(#[from] minijinja::Error),
}
