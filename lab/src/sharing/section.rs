//! The rows of the report, each measured by itself.

use std::fmt;

use clap::ValueEnum;
use study::{Bar, Check, Table};

/// A row, or a group of rows, of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Part {
    /// A viewer beside six kinds of batch
    Guests,
    /// The first view of a size that was never requested
    NewSize,
    /// The costs of views, measured beside load and without
    Costs,
    /// Two scenes on processes; a compositor of one is killed
    KilledCompositor,
    /// `view` of 500 pictures of 1920×1080
    ManyViews,
    /// Viewers that walk from view cell to view cell, on the scalar engine
    Walkers,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.to_possible_value().map_or(Ok(()), |value| f.write_str(value.get_name()))
    }
}

/// The result of a part.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Section {
    /// The device; empty where the part does not know.
    pub(super) device: String,
    /// Its tables.
    pub(super) tables: Vec<Table>,
    /// Its checks.
    pub(super) checks: Vec<Check>,
}

impl Section {
    /// The section of a part that failed: its one check falls short.
    pub(super) fn failed(part: Part) -> Self {
        let check = Check::new(format!("{part}: measured to the end"), f64::NAN, "", Bar::AtLeast(1.0));
        Self { checks: vec![check], ..Self::default() }
    }
}
