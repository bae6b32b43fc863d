//! The last rows, and the choice. The last rows are timed in turn: what is timed beside other work is not timed alone.

use super::state::{Stage, Work};
use super::{EXACT, Planner, TOLERANCE};
use crate::command::Command;
use crate::costs::{Price, Pricing};
use crate::kept::Certificate;
use crate::outcome::{Choice, Outcome, PromiseState, RowStatus};

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

    pub(super) fn conclude(&mut self, is_spent: bool) -> Vec<Command> {
        (self.stage, self.pending) = (Stage::Concluded, None);
        let (choice, state) = self.choice();
        let outcome = self.outcome_of(choice, state, is_spent);
        self.outcome = Some(outcome.clone());
        vec![Command::Keep(Box::new(self.kept(choice, is_spent))), Command::Conclude(Box::new(outcome))]
    }

    pub(super) fn price_of(&self, choice: Choice) -> Price {
        match choice {
            Choice::Row(row) => self.prices[row],
            Choice::Direct => self.pricing.direct(),
        }
    }

    /// The certificate that a row has for the budget.
    pub(super) fn certificate_of(&self, choice: Choice) -> Option<&Certificate> {
        let (Choice::Row(row), Some(term)) = (choice, self.term()) else { return None };
        self.rows[row].certificates.iter().rev().find(|certificate| certificate.serves(&term))
    }

    pub(super) fn outcome_of(&self, choice: Choice, state: PromiseState, is_spent: bool) -> Outcome {
        Outcome {
            state,
            choice,
            price: self.price_of(choice),
            certificate: self.certificate_of(choice).cloned(),
            pruning: self.pruning_check(),
            reason: self.reason(choice, state, is_spent),
        }
    }

    pub(super) fn choice(&self) -> (Choice, PromiseState) {
        let direct = self.direct_in_time();
        let best = self.eligible(EXACT).into_iter().find(|&row| self.is_measured_for_time(row));
        match (self.term(), best, direct) {
            (Some(_), Some(row), Some(direct)) if direct.node_s <= self.prices[row].node_s => {
                (Choice::Direct, PromiseState::Kept)
            }
            (None, _, Some(_)) | (_, None, Some(_)) => (Choice::Direct, PromiseState::Kept),
            (_, Some(row), _) => (Choice::Row(row), PromiseState::Kept),
            (Some(_), None, None) => (self.nearest(), PromiseState::Unreachable),
            (None, None, None) => self.nearest_to_time(),
        }
    }

    /// Where no row passed in time: the most accurate that seems to be in time, as after a spent allowance; else the fastest.
    fn nearest_to_time(&self) -> (Choice, PromiseState) {
        let usable = (0..self.rows.len()).filter(|&row| {
            let is_failed = self.rows[row].status == RowStatus::Failed;
            !is_failed && self.rows[row].costs.is_some() && !self.rows[row].errors.is_empty()
        });
        let in_time = usable.clone().filter(|&row| self.is_in_time(row, EXACT));
        if let Some(row) = in_time.min_by(|&a, &b| self.error_ratio(a).total_cmp(&self.error_ratio(b))) {
            return (Choice::Row(row), PromiseState::Kept);
        }
        let fastest = usable.min_by(|&a, &b| self.prices[a].view_s.total_cmp(&self.prices[b].view_s));
        let fastest = fastest.filter(|&row| self.prices[row].view_s < self.pricing.direct().view_s);
        (fastest.map_or(Choice::Direct, Choice::Row), PromiseState::Unreachable)
    }

    /// Direct drawing has no error; where it is not allowed, the row with the least.
    fn nearest(&self) -> Choice {
        let is_allowed = self.pricing.direct().node_s.is_finite();
        let row = if is_allowed { None } else { self.nearest_to_error() };
        row.map_or(Choice::Direct, Choice::Row)
    }

    /// The row that comes nearest to the limit on errors, of those that may be in time.
    pub(super) fn nearest_to_error(&self) -> Option<usize> {
        let known = (0..self.rows.len()).filter(|&row| !self.rows[row].errors.is_empty());
        let in_time = known.filter(|&row| self.is_in_time(row, TOLERANCE));
        in_time.min_by(|&a, &b| self.error_ratio(a).total_cmp(&self.error_ratio(b)))
    }
}
