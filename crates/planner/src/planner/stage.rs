//! The stages of a plan, and the measurement that is asked for.

use crate::view::ProbeView;
use crate::view_errors::ViewErrors;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    /// Nothing is known of earlier plans yet.
    Waiting,
    Screening,
    Certifying,
    Timing,
    Concluded,
}

impl Stage {
    pub(super) fn is_idle(self) -> bool {
        matches!(self, Self::Waiting | Self::Concluded)
    }
}

/// A measurement.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Work {
    Screen { row: usize, views: Vec<ProbeView> },
    Certify { row: usize, views: Vec<ProbeView> },
    Time { rows: Vec<usize> },
}

/// A round of certificates: rows in a fixed sequence on common fresh views, up to the first failure.
#[derive(Debug, Clone, Default)]
pub(super) struct Round {
    /// From 0.
    pub(super) number: u32,
    pub(super) sequence: Vec<usize>,
    /// The place in the sequence.
    pub(super) position: usize,
    /// A row failed: the sequence ends.
    pub(super) has_failed: bool,
    /// The number of the first fresh view.
    pub(super) first_view: u64,
    /// The views that decide on the row at `position`; chosen before it is measured on any.
    pub(super) needed_views: usize,
    /// The errors of that row.
    pub(super) errors: Vec<ViewErrors>,
}

impl Round {
    /// The row that is being certified.
    pub(super) fn row(&self) -> Option<usize> {
        self.sequence.get(self.position).copied().filter(|_| !self.has_failed)
    }
}
