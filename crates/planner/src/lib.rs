//! Budgets: the cheapest way to make views that keeps one, and the audit of the promise.
//!
//! A [`Budget`] limits the error of views. A [`Planner`] asks for measurements of the [`Row`]s that it may choose, and chooses
//! one. An [`Audit`] watches the errors of views that are served. The crate is pure: it has no clock, no await and no file,
//! and random numbers come from a seed. See `docs/planner.md`.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod audit;
mod budget;
mod invalid;
mod moments;
mod planner;
mod probe_view;
mod random;
mod row;
mod view_errors;

pub use audit::{Audit, Interval};
pub use budget::{Budget, BudgetError, Metric};
pub use invalid::InvalidField;
pub use moments::upper_bound;
pub use planner::{Outcome, PlanRequest, Planner, Probe, ProbeId, Probed, RowSummary, TestedError};
pub use probe_view::{ProbePlace, ProbeView};
pub use row::{Demand, MAX_ROWS, Row, RowCosts};
pub use view_errors::ViewErrors;
