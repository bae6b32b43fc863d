//! Errors of reports.

use std::path::PathBuf;

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
    /// A row and the columns of a table differ in number.
    #[error("row {row} of table {table:?} has {cells} cells, its columns are {columns}")]
    RowLength { table: String, row: usize, cells: usize, columns: usize },
    /// The CSV writer failed.
    #[error("cannot write a table: {0}")]
    Csv(#[from] csv::Error),
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
