//! The parts of the report, each measured by itself.

use clap::ValueEnum;

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
