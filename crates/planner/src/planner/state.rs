//! The state of a plan: its stage, the measurement that is asked for, its round of certificates, and its rows.

use crate::budget::Budget;
use crate::costs::RowCosts;
use crate::kept::{Certificate, KeptCosts};
use crate::outcome::RowStatus;
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

/// The measurements and the state of a row.
#[derive(Debug, Clone, Default)]
pub(super) struct RowState {
    pub(super) status: RowStatus,
    /// It would be pruned, but tests the rule.
    pub(super) is_spared: bool,
    /// The errors on the first screening views, then those of certificates of this plan that failed.
    pub(super) errors: Vec<ViewErrors>,
    pub(super) screening_views: usize,
    /// Costs on the request's device, by its program.
    pub(super) costs: Option<RowCosts>,
    /// Views from which these costs are.
    pub(super) timed_views: usize,
    /// The costs were timed in turn with other finalists'.
    pub(super) is_settled: bool,
    pub(super) certificates: Vec<Certificate>,
    pub(super) rejected: Vec<Budget>,
    /// A certificate failed for the row, or for a safer one before it in the sequence. A further round leaves it so.
    pub(super) has_failed_certificate: bool,
    /// Costs on other devices or by other programs, for the next plans there.
    pub(super) foreign_costs: Vec<KeptCosts>,
}

impl RowState {
    pub(super) fn screening(&self) -> &[ViewErrors] {
        &self.errors[..self.screening_views]
    }

    /// The errors of certificates of this plan that failed.
    pub(super) fn fresh(&self) -> &[ViewErrors] {
        &self.errors[self.screening_views..]
    }

    /// Takes the mean over all views that were timed.
    pub(super) fn add_costs(&mut self, costs: &RowCosts, views: usize) {
        if self.is_settled {
            return;
        }
        let old = self.timed_views as f64;
        let total = (self.timed_views + views) as f64;
        let before = self.costs.unwrap_or(*costs);
        let mean = |before: f64, now: f64| (before * old + now * views as f64) / total;
        self.costs = Some(RowCosts {
            sample_image_s: mean(before.sample_image_s, costs.sample_image_s),
            load_set_s: mean(before.load_set_s, costs.load_set_s),
            reconstruct_view_s: mean(before.reconstruct_view_s, costs.reconstruct_view_s),
        });
        self.timed_views += views;
    }
}
