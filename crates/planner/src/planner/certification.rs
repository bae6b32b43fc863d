//! Certificates on fresh views: a row that seems to be the best of many by one sample needs another sample for a promise.
//!
//! Rows are tested in a fixed sequence, from the safest to the cheapest, and the first failure ends it. All certificates of
//! a sequence hold together: this is fixed-sequence testing (Angelopoulos et al. 2021, "Learn then Test").

use super::state::{Round, Work};
use super::{Planner, TOLERANCE};
use crate::bounds::{ERROR_RATE, MAX_ROUNDS, round_error_rate};
use crate::costs::Pricing;
use crate::event::MAX_PROBE_VIEWS;
use crate::evidence::Evidence;
use crate::kept::Certificate;
use crate::metric::Metric;
use crate::outcome::RowStatus;
use crate::view::ProbeView;

/// A row that saves less than this is not worth a certificate beside one that is there.
const WORTHWHILE: f64 = 0.05;
/// The least saving from one row of a sequence to the next, which grows until few enough rows are left.
const LEAST_STEP: f64 = 0.02;
/// The most fresh views of one certificate, skipped ones included.
const MAX_FRESH_VIEWS: usize = 256;

impl<P: Pricing> Planner<P> {
    pub(super) fn begin_round(&mut self) {
        let sequence = self.sequence();
        let number = self.round.number;
        self.round = Round { number, sequence, first_view: self.fresh_views_drawn, ..Round::default() };
        self.begin_row();
    }

    pub(super) fn next_certification(&self) -> Option<Work> {
        let row = self.round.row()?;
        let known = self.round.errors.len();
        let next = self.wanted_views().min(known + MAX_PROBE_VIEWS);
        let views = (known..next).map(|view| ProbeView::Fresh(self.round.first_view + view as u64)).collect();
        Some(Work::Certify { row, views })
    }

    /// Decides on the row once all of its views are there.
    pub(super) fn judge(&mut self) {
        let known = self.round.errors.len();
        self.fresh_views_drawn = self.fresh_views_drawn.max(self.round.first_view + known as u64);
        if known < self.wanted_views() {
            return;
        }
        if let Some(row) = self.round.row() {
            match self.certificate() {
                Some(certificate) => {
                    self.rows[row].certificates.push(certificate);
                    self.rows[row].status = RowStatus::Certified;
                    self.round.position += 1;
                }
                None => self.reject(row),
            }
            self.begin_row();
        }
    }

    /// A row that cannot be measured is skipped: nothing was learnt of its errors.
    pub(super) fn skip_failed_row(&mut self) {
        if self.round.row().is_some_and(|row| self.rows[row].status == RowStatus::Failed) {
            self.round.position += 1;
            self.begin_row();
        }
    }

    /// Whether a further round follows one that failed. The row that failed is then judged by its fresh errors alone, as
    /// those of screening may be without light. The next round draws other views.
    pub(super) fn reconsider(&mut self) -> bool {
        if !self.round.has_failed || self.round.number + 1 >= MAX_ROUNDS {
            return false;
        }
        self.round.number += 1;
        for row in std::mem::take(&mut self.round.sequence) {
            let Some(term) = self.term().filter(|_| self.rows[row].status == RowStatus::Rejected) else { continue };
            let is_over = Evidence { term, errors: self.rows[row].fresh() }.is_over(1.0, ERROR_RATE);
            self.rows[row].status = if is_over { RowStatus::Over } else { RowStatus::Passed };
        }
        true
    }

    /// Rows to certify, from the safest on: each is cheaper than those before.
    fn sequence(&self) -> Vec<usize> {
        let Some(term) = self.term() else { return Vec::new() };
        let most_s = self.worthwhile_s();
        let passed = (0..self.rows.len()).filter(|&row| self.rows[row].status == RowStatus::Passed);
        let mut rows: Vec<usize> =
            passed.filter(|&row| self.prices[row].node_s < most_s && self.is_in_time(row, TOLERANCE)).collect();
        rows.sort_by(|&a, &b| self.evidence(b, term).margin().total_cmp(&self.evidence(a, term).margin()));
        let mut step = LEAST_STEP;
        loop {
            let thinned = self.thinned(&rows, step);
            if thinned.len() <= self.request.most_certified {
                return thinned;
            }
            step *= 1.5;
        }
    }

    /// Rows below this price are worth a certificate.
    fn worthwhile_s(&self) -> f64 {
        let certified = (0..self.rows.len())
            .filter(|&row| self.rows[row].status == RowStatus::Certified && self.is_clearly_in_time(row));
        let certified_s = certified.map(|row| self.prices[row].node_s * (1.0 - WORTHWHILE));
        let direct_s = self.direct_in_time().map_or(f64::INFINITY, |direct| direct.node_s);
        // The cheapest assured row is in the sequence, also at a price of 0.
        let assured_s = (self.cheapest_assured_s() * (1.0 + f64::EPSILON)).max(f64::MIN_POSITIVE);
        certified_s.fold(direct_s.min(assured_s), f64::min)
    }

    /// Each row saves at least a share of `step`.
    fn thinned(&self, rows: &[usize], step: f64) -> Vec<usize> {
        let mut last_s = f64::INFINITY;
        let mut thinned = rows.to_vec();
        thinned.retain(|&row| {
            let price_s = self.prices[row].node_s;
            let is_cheaper = last_s.is_infinite() || price_s < last_s * (1.0 - step);
            if is_cheaper {
                last_s = price_s;
            }
            is_cheaper
        });
        thinned
    }

    /// Chooses the number of views from what screening says, before a fresh view is measured.
    fn begin_row(&mut self) {
        let error_rate = round_error_rate(self.round.number);
        let is_last = self.round.number + 1 == MAX_ROUNDS;
        let needed = self.round.row().zip(self.term()).map(|(row, term)| {
            let evidence = self.evidence(row, term);
            if is_last { evidence.most_views(error_rate) } else { evidence.views_to_certify(error_rate) }
        });
        self.round.errors.clear();
        self.round.needed_views = needed.unwrap_or(0);
    }

    /// The views that the row is measured on: more are drawn in place of those that do not count.
    fn wanted_views(&self) -> usize {
        let counted = self.fresh_evidence().map_or(0, |evidence| evidence.count());
        (self.round.needed_views + self.round.errors.len() - counted).min(MAX_FRESH_VIEWS)
    }

    fn fresh_evidence(&self) -> Option<Evidence<'_>> {
        self.term().map(|term| Evidence { term, errors: &self.round.errors })
    }

    /// The certificate of the row whose views are there, if they give one.
    fn certificate(&self) -> Option<Certificate> {
        let evidence = self.fresh_evidence()?;
        let bound_ratio = evidence.upper_bound(round_error_rate(self.round.number))?;
        let errors = &self.round.errors;
        let foreground = errors.iter().map(|errors| errors.weight(Metric::Flip)).sum::<f64>() / errors.len() as f64;
        (bound_ratio <= evidence.term.most_ratio()).then(|| Certificate {
            budget: self.request.budget,
            views: evidence.count(),
            skipped_views: errors.len() - evidence.count(),
            expected_ratio: evidence.estimate(),
            bound_ratio: bound_ratio.max(0.0),
            foreground_ratio: foreground.clamp(0.0, 1.0),
        })
    }

    /// Ends the round at a row that failed, and at all rows behind it.
    fn reject(&mut self, row: usize) {
        for &row in &self.round.sequence[self.round.position..] {
            self.rows[row].has_failed_certificate = true;
        }
        self.rows[row].status = RowStatus::Rejected;
        self.rows[row].errors.extend(self.round.errors.iter());
        self.round.has_failed = true;
    }
}
