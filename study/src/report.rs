//! What one run found.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use table::{Cell, Table};

use crate::chart::Chart;
use crate::check::{Check, Outcome};
use crate::picture::PictureRow;

/// Of `report.json`; raised when a field changes its meaning.
pub const SCHEMA_VERSION: u32 = 1;

/// Everything that one run leaves behind. It is `report.json`, field by field; only the pixels of pictures
/// are in files of their own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`SCHEMA_VERSION`].
    pub schema: u32,
    /// What was run.
    pub title: String,
    /// One or two sentences that say what was found; may be empty.
    #[serde(default)]
    pub summary: String,
    /// What it was measured on; no time means anything without it.
    pub device: String,
    /// Programs and libraries, in order.
    pub versions: IndexMap<String, String>,
    /// What the run was asked to do, in order.
    pub parameters: IndexMap<String, Cell>,
    /// Tables.
    #[serde(rename = "rows")]
    pub tables: Vec<Table>,
    /// Promises and whether they were kept.
    pub checks: Vec<Check>,
    /// Charts, with their data.
    #[serde(default)]
    pub charts: Vec<Chart>,
    /// Pictures, a labelled row at a time.
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

    /// Whether no check falls short: what `--strict` makes the exit status of. A check that was not run does
    /// not fall short; the printed table says that it was not run, and why.
    #[must_use]
    pub fn exit_ok(&self) -> bool {
        self.checks.iter().all(|check| check.outcome() != Outcome::FallsShort)
    }
}
