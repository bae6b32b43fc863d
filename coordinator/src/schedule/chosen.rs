//! A choice among representations, and the safer ones that may replace it.

use planner::{Budget, Certificate, Choice, Outcome, Price, PromiseState, Row};

/// The choice of a plan, or one that replaces it when its promise is broken.
#[derive(Debug, Clone)]
pub(super) struct Chosen {
    /// No two choices have the same.
    pub(super) number: u64,
    /// The budget that was planned for.
    pub(super) budget: Budget,
    /// `None` where every view is drawn directly.
    pub(super) row: Option<Row>,
    pub(super) outcome: Outcome,
    /// The rows that the plan has certified, the cheapest first.
    pub(super) certified: Vec<Certified>,
}

/// A row that is certified for a budget.
#[derive(Debug, Clone)]
pub(super) struct Certified {
    pub(super) row: Row,
    pub(super) choice: Choice,
    pub(super) price: Price,
    pub(super) certificate: Certificate,
}

impl Chosen {
    /// The cheapest row that is certified to be more accurate than this choice, in its place for a reason.
    pub(super) fn safer(&self, number: u64, reason: &str) -> Option<Self> {
        let own = self.outcome.certificate.as_ref()?.expected_ratio;
        let mut safer = self.certified.iter().filter(|certified| certified.certificate.expected_ratio < own);
        let Certified { row, choice, price, certificate } = safer.next()?.clone();
        let shown = self.budget.error().map(|term| term.shown(certificate.bound_ratio)).unwrap_or_default();
        let reason = format!(
            "{row} keeps {}: at most {shown} with 95 % confidence, on {} views. {reason}",
            self.budget, certificate.views
        );
        let outcome = Outcome { choice, price, certificate: Some(certificate), reason, ..self.outcome.clone() };
        Some(Self { number, row: Some(row), outcome, ..self.clone() })
    }

    /// What sessions ask for stays in its place: its row cannot be put in force.
    pub(super) fn without_row(self, reason: &str) -> Self {
        let outcome = Outcome {
            state: PromiseState::Unreachable,
            choice: Choice::Direct,
            certificate: None,
            reason: format!("{} It cannot be put in force: {reason}", self.outcome.reason),
            ..self.outcome
        };
        Self { row: None, outcome, ..self }
    }

    /// Direct drawing in its place, at a price.
    pub(super) fn direct(&self, number: u64, price: Price, reason: String) -> Self {
        let is_in_time = self.budget.most_view_s().is_none_or(|limit_s| price.view_s <= limit_s);
        let state = if is_in_time { PromiseState::Kept } else { PromiseState::Unreachable };
        let outcome =
            Outcome { state, choice: Choice::Direct, price, certificate: None, reason, ..self.outcome.clone() };
        Self { number, row: None, outcome, certified: Vec::new(), budget: self.budget }
    }
}

#[cfg(test)]
mod tests {
    use planner::PruningCheck;

    use super::*;
    use crate::schedule::budget_cluster_tests::rows;

    /// The rows of a budget of FLIP 0.06 with these errors, each twice as expensive as the one before; the first is chosen.
    fn chosen(errors: &[f64]) -> Chosen {
        let budget: Budget = "flip 0.06".parse().unwrap();
        let certified = |(place, &expected_ratio): (usize, &f64)| {
            let seconds = 0.001 * f64::from(1 << place);
            let views = 32;
            let skipped_views = 0;
            let foreground_ratio = 0.5;
            let bound_ratio = expected_ratio * 1.1;
            let certificate =
                Certificate { budget, views, skipped_views, expected_ratio, bound_ratio, foreground_ratio };
            let price = Price { node_s: seconds, view_s: seconds };
            Certified { row: rows()[place].clone(), choice: Choice::Row(place), price, certificate }
        };
        let certified: Vec<Certified> = errors.iter().enumerate().map(certified).collect();
        let first = certified[0].clone();
        let outcome = Outcome {
            state: PromiseState::Kept,
            choice: first.choice,
            price: first.price,
            certificate: Some(first.certificate),
            pruning: PruningCheck::default(),
            reason: String::new(),
        };
        Chosen { number: 1, budget, row: Some(first.row), outcome, certified }
    }

    #[test]
    fn the_cheapest_row_that_is_more_accurate_takes_the_place_of_another_until_there_is_none() {
        let first = chosen(&[0.04, 0.05, 0.02, 0.01]);
        let second = first.safer(2, "Audits found more.").unwrap();
        assert_eq!((second.row.as_ref(), second.outcome.choice), (Some(&rows()[2]), Choice::Row(2)));
        assert!(
            second.outcome.reason.contains("at most 0.0220") && second.outcome.reason.ends_with("Audits found more.")
        );
        let third = second.safer(3, "").unwrap();
        assert_eq!(third.outcome.choice, Choice::Row(3));
        assert!(third.safer(4, "").is_none());
    }

    #[test]
    fn direct_drawing_in_its_place_may_take_too_long() {
        let timed = Chosen { budget: "flip 0.06, time 8ms".parse().unwrap(), ..chosen(&[0.04]) };
        let state = |view_s: f64| timed.direct(2, Price { node_s: view_s, view_s }, String::new()).outcome.state;
        assert_eq!((state(0.007), state(0.04)), (PromiseState::Kept, PromiseState::Unreachable));
    }
}
