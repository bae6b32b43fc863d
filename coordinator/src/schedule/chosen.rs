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
        let is_safer = |certified: &&Certified| certified.certificate.expected_ratio < own;
        let Certified { row, choice, price, certificate } = self.certified.iter().find(is_safer)?.clone();
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
        let outcome = Outcome { choice: Choice::Direct, price, certificate: None, reason, ..self.outcome.clone() };
        Self { number, row: None, outcome, certified: Vec::new(), budget: self.budget }
    }
}
