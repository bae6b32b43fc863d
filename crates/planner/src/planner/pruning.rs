//! Rows that are excluded because a better one of their kind fails clearly.
//!
//! The rule is false at times: one row in ten is screened all the same, and the outcome says how many passed.

use super::Planner;
use crate::costs::Pricing;
use crate::kept::MAX_SCREENING_VIEWS;
use crate::outcome::{PruningCheck, RowStatus};
use crate::random::unit;

/// The share of rows that test the rule.
const TESTED_SHARE: f64 = 0.1;
/// The difference of the seed from that of fresh views: "pruning" in ASCII.
const SEED_CHANGE: u64 = 0x0070_7275_6e69_6e67;

impl<P: Pricing> Planner<P> {
    /// Rows that earlier plans measured in full are judged by that.
    pub(super) fn prune_below(&mut self, failed: usize) {
        for row in 0..self.rows.len() {
            let state = &self.rows[row];
            let is_known = state.is_spared || state.screening_views == MAX_SCREENING_VIEWS;
            if state.status != RowStatus::Open || is_known || !self.row(row).is_dominated_by(self.row(failed)) {
                continue;
            }
            if unit(self.request.seed ^ SEED_CHANGE, row as u64) < TESTED_SHARE {
                self.rows[row].is_spared = true;
            } else {
                self.rows[row].status = RowStatus::Pruned;
            }
        }
    }

    /// The rows that tested the rule and are decided.
    pub(super) fn pruning_check(&self) -> PruningCheck {
        let spared = self.rows.iter().filter(|row| row.is_spared);
        let tested = spared.filter(|row| ![RowStatus::Open, RowStatus::Failed].contains(&row.status));
        PruningCheck {
            pruned: self.rows.iter().filter(|row| row.status == RowStatus::Pruned).count(),
            tested: tested.clone().count(),
            wrong: tested.filter(|row| row.status != RowStatus::Over).count(),
        }
    }
}
