//! The result of a plan.

use std::fmt;

use crate::costs::Price;
use crate::kept::Certificate;

/// The choice of a plan, and what is promised for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The state of the promise.
    pub state: PromiseState,
    /// The chosen representation.
    pub choice: Choice,
    /// Its price.
    pub price: Price,
    /// The certificate of a chosen row for the error term.
    pub certificate: Option<Certificate>,
    /// Tests of the rule by which rows were excluded without measuring them.
    pub pruning: PruningCheck,
    /// The reason in plain words.
    pub reason: String,
}

/// The state of a promise, as a plan sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PromiseState {
    /// The plan is being made.
    Measuring,
    /// The choice keeps the budget.
    Kept,
    /// Nothing keeps the budget.
    Unreachable,
}

/// A representation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The row at this place of the ladder.
    Row(usize),
    /// Every view is drawn from the scene: it has no error.
    Direct,
}

/// Rows that were excluded because a better one of their kind failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PruningCheck {
    /// Rows that were excluded.
    pub pruned: usize,
    /// Rows that would have been, and were screened all the same.
    pub tested: usize,
    /// The tested rows that passed.
    pub wrong: usize,
}

/// The state and the measurements of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowSummary {
    /// The state of the row.
    pub status: RowStatus,
    /// Views on which it was screened.
    pub screening_views: usize,
    /// The error that the budget limits, as a ratio; FLIP for a budget of time. `None` where no view was measured.
    pub error_ratio: Option<f64>,
    /// Its price, by measured costs or by predicted ones.
    pub price: Price,
    /// Whether the costs were measured.
    pub is_measured: bool,
}

/// The state of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RowStatus {
    /// Nothing is decided.
    #[default]
    Open,
    /// It does not keep the budget.
    Over,
    /// A better one of its kind does not keep the budget.
    Pruned,
    /// It seems to keep the budget.
    Passed,
    /// It was certified to keep the budget.
    Certified,
    /// It seemed to keep the budget, and its certificate failed.
    Rejected,
    /// It could not be measured.
    Failed,
}

impl fmt::Display for RowStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Open => "open",
            Self::Over => "over",
            Self::Pruned => "excluded",
            Self::Passed => "passed",
            Self::Certified => "certified",
            Self::Rejected => "not certified",
            Self::Failed => "failed",
        })
    }
}
