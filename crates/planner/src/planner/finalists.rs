//! The last rows, which are timed in turn: what is timed beside other work is not timed alone.

use super::stage::Work;
use super::{Planner, TOLERANCE};
use crate::costs::Pricing;
use crate::outcome::RowStatus;

/// The most rows that are timed again.
const MOST_FINALISTS: usize = 4;
/// Rows within this factor of the cheapest are timed again.
const CLOSE: f64 = 1.15;

impl<P: Pricing> Planner<P> {
    pub(super) fn next_timing(&self) -> Option<Work> {
        let finalists = self.finalists();
        let rows: Vec<usize> = finalists.iter().copied().filter(|&row| !self.rows[row].is_settled).collect();
        let is_needed = !self.finalists_were_timed && !rows.is_empty() && self.timing_matters(&finalists);
        is_needed.then_some(Work::Time { rows })
    }

    /// The status of rows that may be chosen: nothing is certified for a budget of time alone.
    pub(super) fn status_to_choose(&self) -> RowStatus {
        if self.term().is_some() { RowStatus::Certified } else { RowStatus::Passed }
    }

    /// Rows that may be chosen, the best first.
    pub(super) fn eligible(&self, tolerance: f64) -> Vec<usize> {
        let status = self.status_to_choose();
        let mut rows: Vec<usize> = (0..self.rows.len()).filter(|&row| self.rows[row].status == status).collect();
        rows.retain(|&row| self.is_in_time(row, tolerance));
        rows.sort_by(|&a, &b| self.rank(a).total_cmp(&self.rank(b)));
        rows
    }

    /// The price under a limit on errors, FLIP under one on time alone.
    fn rank(&self, row: usize) -> f64 {
        if self.term().is_some() { self.prices[row].node_s } else { self.error_ratio(row) }
    }

    pub(super) fn finalists(&self) -> Vec<usize> {
        let eligible = self.eligible(TOLERANCE);
        let Some(&best) = eligible.first() else { return eligible };
        let most_s = if self.term().is_some() { CLOSE * self.prices[best].node_s } else { f64::INFINITY };
        let close = eligible.iter().copied().filter(|&row| self.prices[row].node_s <= most_s);
        let mut finalists: Vec<usize> = close.take(MOST_FINALISTS).collect();
        // Where all are at the edge of the time, one that is clearly within it must be among them.
        let safe = eligible.into_iter().find(|&row| self.is_clearly_in_time(row));
        if let Some(safe) = safe.filter(|safe| !finalists.contains(safe)) {
            finalists.truncate(MOST_FINALISTS - 1);
            finalists.push(safe);
        }
        finalists
    }

    fn timing_matters(&self, finalists: &[usize]) -> bool {
        let cheapest_s = finalists.iter().map(|&row| self.prices[row].node_s).fold(f64::INFINITY, f64::min);
        let is_near_direct = self.direct_in_time().is_some_and(|direct| cheapest_s * CLOSE > direct.node_s);
        finalists.len() > 1 || is_near_direct || self.request.budget.most_view_s().is_some()
    }
}
