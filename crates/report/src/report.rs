//! The contents of a report.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use crate::chart::XyChart;
use crate::check::{Check, Outcome};
use crate::picture::{Picture, PictureRow};
use crate::table::{Cell, Table};

/// The version of `report.json`; raised when a field changes its meaning.
pub const SCHEMA_VERSION: u32 = 1;

/// The contents of a report: `report.json`, field by field. Only the pixels of pictures are in files of their own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The value of [`SCHEMA_VERSION`].
    pub schema: u32,
    /// The title of the run.
    pub title: String,
    /// One or two sentences with the result; may be empty.
    #[serde(default)]
    pub summary: String,
    /// The picture that the page shows first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cover: Option<Picture>,
    /// The device of the measurements.
    pub device: String,
    /// Versions of programs and libraries, in order.
    pub versions: IndexMap<String, String>,
    /// Parameters of the run, in order.
    pub parameters: IndexMap<String, Cell>,
    /// Tables.
    #[serde(rename = "rows")]
    pub tables: Vec<Table>,
    /// Checks, with their outcomes.
    pub checks: Vec<Check>,
    /// Charts, with their data.
    #[serde(default)]
    pub charts: Vec<XyChart>,
    /// Pictures, by labelled rows.
    #[serde(default)]
    pub pictures: Vec<PictureRow>,
}

impl Report {
    /// A report without content.
    #[must_use]
    pub fn new(title: impl Into<String>, device: impl Into<String>) -> Self {
        Self {
            schema: SCHEMA_VERSION,
            title: title.into(),
            summary: String::new(),
            cover: None,
            device: device.into(),
            versions: IndexMap::new(),
            parameters: IndexMap::new(),
            tables: Vec::new(),
            checks: Vec::new(),
            charts: Vec::new(),
            pictures: Vec::new(),
        }
    }

    /// Adds a version.
    pub fn version(&mut self, of: impl Into<String>, version: impl Into<String>) {
        self.versions.insert(of.into(), version.into());
    }

    /// Adds a parameter.
    pub fn parameter(&mut self, name: impl Into<String>, value: impl Into<Cell>) {
        self.parameters.insert(name.into(), value.into());
    }

    /// The cover and all other pictures.
    pub(crate) fn all_pictures(&self) -> impl Iterator<Item = &Picture> {
        self.cover.iter().chain(self.pictures.iter().flat_map(|row| &row.pictures))
    }

    /// True where no check falls short, as `--strict` demands. A check that was not run does not fall short.
    #[must_use]
    pub fn exit_ok(&self) -> bool {
        self.checks.iter().all(|check| check.outcome() != Outcome::FallsShort)
    }
}
