//! Measurements of earlier plans, and for later ones.

use super::Planner;
use super::state::{RowState, Stage};
use crate::budget::Budget;
use crate::costs::Pricing;
use crate::invalid::InvalidField;
use crate::kept::{Kept, KeptCosts, KeptRow, KeptSearch, newest};
use crate::outcome::{Choice, RowStatus};

impl<P: Pricing> Planner<P> {
    pub(super) fn remember(&mut self, kept: Kept) -> Result<(), InvalidField> {
        if self.stage != Stage::Waiting {
            return Err(InvalidField::new("remembered", "a second one", "the first event"));
        }
        if let Some(field) = kept.key.difference(&self.request.key) {
            return Err(InvalidField::new(field, "another", "that of the request"));
        }
        self.fresh_views_drawn = kept.fresh_views_drawn;
        for kept in kept.rows {
            let place = self.ladder.rows().iter().position(|row| *row == kept.row);
            if let Some(place) = place {
                self.rows[place] = self.row_from(kept);
            }
        }
        self.predict();
        (0..self.rows.len()).for_each(|row| self.assess(row));
        self.stage = Stage::Screening;
        self.searches = kept.searches;
        if self.is_searched() {
            self.stage = Stage::Timing;
            self.finalists_were_timed = self.finalists().iter().all(|&row| self.rows[row].costs.is_some());
        }
        Ok(())
    }

    /// Whether an earlier plan has made this search to its end. Its row may have lost its certificate meanwhile.
    fn is_searched(&self) -> bool {
        let own = self.search(Choice::Direct);
        let Some(made) = self.searches.iter().find(|search| search.is_like(&own)) else { return false };
        let Some(chosen) = &made.row else { return true };
        let place = self.ladder.rows().iter().position(|row| row == chosen);
        place.is_some_and(|row| self.rows[row].status == self.status_to_choose())
    }

    fn search(&self, choice: Choice) -> KeptSearch {
        KeptSearch {
            budget: self.request.budget,
            pricing: self.request.pricing.clone(),
            device: self.request.device.clone(),
            program_version: self.request.program_version.clone(),
            row: match choice {
                Choice::Row(row) => Some(self.row(row).clone()),
                Choice::Direct => None,
            },
        }
    }

    /// Everything that is known, for later plans. A search has not come to its end where the allowance was spent, or where a
    /// row could not be measured.
    pub(super) fn kept(&self, choice: Choice, is_spent: bool) -> Kept {
        let known =
            (0..self.rows.len()).filter(|&row| !self.rows[row].errors.is_empty() || self.rows[row].costs.is_some());
        let mut kept = Kept {
            key: self.request.key.clone(),
            fresh_views_drawn: self.fresh_views_drawn,
            rows: known.map(|row| self.kept_row(row)).collect(),
            searches: self.searches.clone(),
        };
        if !is_spent && self.rows.iter().all(|row| row.status != RowStatus::Failed) {
            kept.add_search(self.search(choice));
        }
        kept
    }

    fn row_from(&self, kept: KeptRow) -> RowState {
        let term = self.term();
        let is_certified = term.is_some_and(|term| kept.certificates.iter().any(|own| own.serves(&term)));
        // A row that failed at a budget fails at a stricter one.
        let mut failed = kept.rejected.iter().filter_map(Budget::error);
        let is_rejected = term.is_some_and(|term| failed.any(|failed| term.implies(&failed)));
        let status = match (is_certified, is_rejected) {
            (true, _) => RowStatus::Certified,
            (false, true) => RowStatus::Rejected,
            (false, false) => RowStatus::Open,
        };
        let (own, foreign_costs): (Vec<_>, Vec<_>) = kept.costs.into_iter().partition(|costs| {
            costs.device == self.request.device && costs.program_version == self.request.program_version
        });
        let own = own.last();
        RowState {
            status,
            screening_views: kept.screening.len(),
            timed_views: kept.screening.len(),
            errors: kept.screening,
            costs: own.map(|own| own.costs),
            is_settled: own.is_some_and(|own| own.is_settled),
            certificates: kept.certificates,
            rejected: kept.rejected,
            foreign_costs,
            ..RowState::default()
        }
    }

    fn kept_row(&self, row: usize) -> KeptRow {
        let state = &self.rows[row];
        let own = state.costs.map(|costs| KeptCosts {
            device: self.request.device.clone(),
            program_version: self.request.program_version.clone(),
            is_settled: state.is_settled,
            costs,
        });
        let is_rejected = state.has_failed_certificate && state.status != RowStatus::Certified;
        let rejected = is_rejected.then_some(self.request.budget);
        let rejected = rejected.filter(|budget| !state.rejected.contains(budget));
        let kept = KeptRow::new(self.row(row).clone(), state.screening().to_vec());
        KeptRow {
            certificates: newest(&state.certificates),
            rejected: newest(&state.rejected.iter().copied().chain(rejected).collect::<Vec<_>>()),
            costs: newest(&state.foreign_costs.iter().cloned().chain(own).collect::<Vec<_>>()),
            ..kept
        }
    }
}
