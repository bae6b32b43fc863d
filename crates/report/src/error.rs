//! Errors of reports.

use std::path::PathBuf;

use crate::table::TableError;

/// A report, chart or picture that cannot be made.
#[allow(missing_docs, reason = "self-naming fields")]
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file or folder could not be written.
    #[error("cannot write {path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    /// Two parts would share a file.
    #[error("two {kind} are named {name:?}, as a file name")]
    DuplicateName { kind: &'static str, name: String },
    /// A table cannot be written.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The values of a stage and the bars of its chart differ in number.
    #[error("stage {stage:?} of chart {chart:?} has {values} values, its bars are {bars}")]
    StageLength { chart: String, stage: String, values: usize, bars: usize },
    /// The chart library failed.
    #[error("cannot draw chart {chart:?}: {message}")]
    Draw { chart: String, message: String },
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
