//! Promises: a session's budget, and whether it is kept.

use serde::{Deserialize, Serialize};

use crate::audit::AuditSummary;
use crate::check::{InvalidField, nonempty, reason, within};

/// The budget of a session, whose views are then made in the cheapest way that keeps it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct BudgetRequest {
    /// The budget as on the command line; `None`: the coordinator's, if it has one.
    pub budget: Option<String>,
    /// The user named the reconstruction method: the coordinator's budget is not for this session.
    pub names_method: bool,
}

/// The promise to the sessions of a workload.
#[derive(Debug, Clone, PartialEq)]
pub struct Promise {
    /// The budget.
    pub budget: String,
    /// Whether it is kept.
    pub state: PromiseState,
    /// The representation in force.
    pub representation: String,
    /// The error of the representation on the views of its test, as a ratio; 0 without one.
    pub expected_ratio: f64,
    /// The bound on the error, as a ratio; 0 without a test.
    pub bound_ratio: f64,
    /// Views of the test.
    pub probe_view_count: u32,
    /// The reason in plain words, with the figures.
    pub reason: String,
    /// The audits of the representation in force; `None` where there are none.
    pub audit: Option<AuditSummary>,
}

/// The state of a promise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PromiseState {
    /// Representations are measured; the one in force was not tested.
    Measuring,
    /// The representation in force keeps the budget.
    Kept,
    /// Audits have found errors above the budget, and another representation is not in force yet.
    Broken,
    /// Nothing keeps the budget.
    Unreachable,
}

impl std::fmt::Display for PromiseState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Measuring => "measuring",
            Self::Kept => "kept",
            Self::Broken => "broken",
            Self::Unreachable => "unreachable",
        })
    }
}

impl std::fmt::Display for Promise {
    /// One line: the budget, the state and the reason; while representations are measured, also the one in force.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { budget, state, representation, reason, .. } = self;
        let now = match state {
            PromiseState::Measuring => format!(", now {representation}"),
            _ => String::new(),
        };
        write!(f, "promise {budget}: {state}{now}: {reason}")
    }
}

impl Promise {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.budget, "promise.budget")?;
        reason(&self.representation, "promise.representation")?;
        within(self.expected_ratio, 0.0..=1.0, "promise.expected_ratio", "from 0 to 1")?;
        within(self.bound_ratio, 0.0..=1.0, "promise.bound_ratio", "from 0 to 1")?;
        self.audit.as_ref().map_or(Ok(()), AuditSummary::validate)?;
        reason(&self.reason, "promise.reason")
    }
}
