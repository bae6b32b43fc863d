//! Which rows seem to keep the budget, on common views.
//!
//! A limit on errors is searched from the cheapest row upwards, up to the first that will probably be certified. A row that
//! was not measured counts as one standard deviation cheaper than predicted, in each cost: else a cheap row that seems expensive is
//! missed. A limit on time is searched from the most expensive row downwards: a row that is worse than the best one so far is dropped.
//!
//! Rows are excluded because a better one of their kind fails clearly. That rule is false at times: one row in ten is screened
//! all the same, and the outcome says how many passed.

use super::state::Work;
use super::{Planner, TOLERANCE};
use crate::bounds::{ERROR_RATE, MAX_ROUNDS, Moments, round_error_rate};
use crate::costs::Pricing;
use crate::kept::MAX_SCREENING_VIEWS;
use crate::metric::Metric;
use crate::outcome::{PruningCheck, RowStatus};
use crate::random::unit;
use crate::view::ProbeView;

/// Numbers of views after which a row may be dropped.
const LEVELS: [usize; 4] = [4, 8, 16, MAX_SCREENING_VIEWS];
/// Measured rows from which costs of others are predicted. The search measures more where predictions are uncertain.
const MODEL_ROWS: usize = 16;
/// A row whose error is above this multiple of the budget fails clearly. Worse rows of its kind are then not measured.
const CLEARLY_OVER: f64 = 1.1;
/// The chance of a certificate from which more expensive rows are not measured, by round. After the last there is only
/// direct drawing; and the best of many by a sample is not as good as it seems.
const ASSURED: [f64; MAX_ROUNDS as usize] = [0.95, 0.9999];

/// The share of rows that test the rule.
const TESTED_SHARE: f64 = 0.1;
/// The difference of the seed from that of fresh views: "pruning" in ASCII.
const SEED_CHANGE: u64 = 0x0070_7275_6e69_6e67;

impl<P: Pricing> Planner<P> {
    pub(super) fn next_screening(&self) -> Option<Work> {
        // Nothing is more accurate than direct drawing.
        if self.term().is_none() && self.direct_in_time().is_some() {
            return None;
        }
        self.next_for_model().or_else(|| self.next_candidate().map(|row| self.screen(row)))
    }

    /// Decides on a row as far as its views allow.
    pub(super) fn assess(&mut self, row: usize) {
        let views = self.rows[row].screening_views;
        if self.rows[row].status != RowStatus::Open || !LEVELS.contains(&views) {
            return;
        }
        if self.is_over(row, 1.0) {
            self.rows[row].status = RowStatus::Over;
            if self.is_over(row, CLEARLY_OVER) {
                self.prune_below(row);
            }
        } else if views == MAX_SCREENING_VIEWS {
            self.rows[row].status = RowStatus::Passed;
        }
    }

    /// The price of the cheapest row that is certified, or will probably be.
    pub(super) fn cheapest_assured_s(&self) -> f64 {
        let assured = (0..self.rows.len()).filter(|&row| self.is_assured(row));
        assured.map(|row| self.prices[row].node_s).fold(f64::INFINITY, f64::min)
    }

    /// Whether the row is worse than the budget, or than the best row so far, by a factor.
    fn is_over(&self, row: usize, scale: f64) -> bool {
        match self.term() {
            Some(term) => self.evidence(row, term).is_over(scale, ERROR_RATE),
            None => self.leader().is_some_and(|leader| self.is_worse(row, leader, scale)),
        }
    }

    /// Compares FLIP on common views.
    fn is_worse(&self, row: usize, leader: usize, scale: f64) -> bool {
        let pairs = self.rows[row].screening().iter().zip(self.rows[leader].screening());
        let differences = pairs.map(|(a, b)| a.excess(Metric::Flip, 0.0) - scale * b.excess(Metric::Flip, 0.0));
        Moments::of(differences).lower_bound(ERROR_RATE).is_some_and(|bound| bound > 0.0)
    }

    /// The most accurate row that is clearly in time.
    fn leader(&self) -> Option<usize> {
        let passed = (0..self.rows.len())
            .filter(|&row| self.rows[row].status == RowStatus::Passed && self.is_clearly_in_time(row));
        passed.min_by(|&a, &b| self.error_ratio(a).total_cmp(&self.error_ratio(b)))
    }

    fn is_assured(&self, row: usize) -> bool {
        let Some(term) = self.term().filter(|_| self.is_clearly_in_time(row)) else { return false };
        match self.rows[row].status {
            RowStatus::Certified => true,
            RowStatus::Passed => {
                let error_rate = round_error_rate(self.round.number);
                self.evidence(row, term).chance_to_certify(error_rate) >= ASSURED[self.round.number as usize]
            }
            _ => false,
        }
    }

    /// The row of which least is known, until costs can be predicted. A row whose errors are known is only timed.
    fn next_for_model(&self) -> Option<Work> {
        let known = self.rows.iter().filter(|row| row.costs.is_some()).count();
        if known >= MODEL_ROWS {
            return None;
        }
        let useful = (0..self.rows.len()).filter(|&row| {
            let state = &self.rows[row];
            let may_be_chosen = [RowStatus::Open, RowStatus::Passed, RowStatus::Certified].contains(&state.status);
            state.costs.is_none() && may_be_chosen
        });
        let rows = useful.map(|row| (row, self.model.uncertainty(self.row(row))));
        let (row, _) = rows.min_by(|a, b| b.1.total_cmp(&a.1))?;
        Some(if self.rows[row].errors.is_empty() { self.screen(row) } else { Work::Time { rows: vec![row] } })
    }

    /// The next row in the order of the search.
    fn next_candidate(&self) -> Option<usize> {
        let open = (0..self.rows.len()).filter(|&row| self.rows[row].status == RowStatus::Open);
        let open = open.filter(|&row| self.is_in_time(row, TOLERANCE));
        if self.term().is_none() {
            return open.max_by(|&a, &b| self.prices[a].node_s.total_cmp(&self.prices[b].node_s));
        }
        let direct_s = self.direct_in_time().map_or(f64::INFINITY, |direct| direct.node_s);
        let enough_s = self.cheapest_assured_s().min(direct_s);
        let cheapest = open.min_by(|&a, &b| self.least_prices[a].node_s.total_cmp(&self.least_prices[b].node_s));
        cheapest.filter(|&row| self.least_prices[row].node_s < enough_s)
    }

    fn screen(&self, row: usize) -> Work {
        let known = self.rows[row].screening_views;
        let next = LEVELS.into_iter().find(|&level| level > known).unwrap_or(known);
        Work::Screen { row, views: (known as u32..next as u32).map(ProbeView::Screening).collect() }
    }

    /// Rows that earlier plans measured in full are judged by that.
    fn prune_below(&mut self, failed: usize) {
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
