//! The measurements and the state of a row.

use crate::budget::Budget;
use crate::costs::RowCosts;
use crate::kept::{Certificate, KeptCosts};
use crate::outcome::RowStatus;
use crate::view_errors::ViewErrors;

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
