//! Measurements of earlier plans, and for later ones.

use super::Planner;
use super::row_state::RowState;
use super::stage::Stage;
use crate::budget::Budget;
use crate::costs::Pricing;
use crate::invalid::InvalidField;
use crate::kept::{Kept, KeptCosts, KeptRow, KeptSearch, newest};
use crate::outcome::RowStatus;

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
        if kept.searches.contains(&self.search()) {
            (self.stage, self.finalists_were_timed) = (Stage::Timing, true);
        }
        self.searches = kept.searches;
        Ok(())
    }

    fn search(&self) -> KeptSearch {
        KeptSearch {
            budget: self.request.budget,
            pricing: self.request.pricing.clone(),
            device: self.request.device.clone(),
            program_version: self.request.program_version.clone(),
        }
    }

    /// Everything that is known, for later plans. A search whose allowance was spent has not come to its end.
    pub(super) fn kept(&self, is_spent: bool) -> Kept {
        let is_known = |state: &RowState| !state.errors.is_empty() || state.costs.is_some();
        let known = (0..self.rows.len()).filter(|&row| is_known(&self.rows[row]));
        let mut kept = Kept {
            key: self.request.key.clone(),
            fresh_views_drawn: self.fresh_views_drawn,
            rows: known.map(|row| self.kept_row(row)).collect(),
            searches: self.searches.clone(),
        };
        if !is_spent {
            kept.add_search(self.search());
        }
        kept
    }

    fn row_from(&self, kept: KeptRow) -> RowState {
        let term = self.term();
        let is_certified = term.is_some_and(|term| kept.certificates.iter().any(|own| own.serves(&term)));
        // A row that failed at a budget fails at a stricter one.
        let fails = |budget: &Budget| term.zip(budget.error()).is_some_and(|(term, failed)| term.implies(&failed));
        let status = match (is_certified, kept.rejected.iter().any(fails)) {
            (true, _) => RowStatus::Certified,
            (false, true) => RowStatus::Rejected,
            (false, false) => RowStatus::Open,
        };
        let is_own = |costs: &KeptCosts| {
            costs.device == self.request.device && costs.program_version == self.request.program_version
        };
        let (own, foreign_costs): (Vec<_>, Vec<_>) = kept.costs.into_iter().partition(is_own);
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
