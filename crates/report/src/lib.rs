//! Reports of measurements, as `demo`, `bench` and `study` write them.
//!
//! A caller gathers numbers into a [`Report`]: tables, [`Check`]s against a bar, [`XyChart`]s, pictures.
//! [`Report::write`] makes files of them, and [`Report::finish`] also prints the checks. Nothing here measures, and
//! nothing draws on a GPU: data in, files out. The format is described in `docs/report-format.md`.
//!
//! Charts share one look: a name has the same colour in all of them, axes carry units, and extrapolated
//! parts are dashed.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod chart;
mod check;
mod check_text;
mod error;
mod html;
mod paths;
mod picture;
mod report;
mod table;
mod write;

pub use chart::{Axis, Limit, Mark, Point, Scale, Series, XyChart};
pub use check::{Bar, Check, Outcome};
pub use error::ReportError;
pub use paths::slug;
pub use picture::{Legend, Picture, PictureRow};
pub use report::{Report, SCHEMA_VERSION};
pub use table::{Cell, Column, RowColumn, Table};
