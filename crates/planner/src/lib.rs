//! Budgets: the cheapest representation that keeps one, its certificate, and the audit of its promise.
//!
//! A [`Budget`] limits the error of views, the time of a view, or both. A [`Planner`] turns measurements into commands until
//! it has chosen among the rows of a [`Ladder`]; an [`Audit`] watches the promise afterwards. The crate is pure: no clock, no
//! await, no file; random numbers come from a seed. See `docs/planner.md`.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod audit;
mod binomial;
mod bounds;
mod budget;
mod command;
mod cost_model;
mod costs;
mod event;
mod evidence;
mod gaussian_process;
mod invalid;
mod kept;
mod ladder;
mod metric;
mod outcome;
mod planner;
mod random;
mod view;
mod view_errors;

/// What budgets choose among, for those who expect more.
pub const CHOICE_OF_BUDGETS: &str =
    "Budgets choose among views from samples alone and direct drawing: they do not know shared light yet.";

pub use audit::{Audit, Interval};
pub use binomial::{at_most_over, is_over, most_over, views_needed};
pub use bounds::{ERROR_RATE, MAX_ROUNDS, Moments, round_error_rate};
pub use budget::{Budget, BudgetError, ErrorTerm, Statistic};
pub use command::{Command, Purpose};
pub use cost_model::{CostModel, TimedRow};
pub use costs::{Price, Pricing, RowCosts, median, median_costs};
pub use event::{Event, MAX_PROBE_VIEWS, ProbeId, Probed, Timed, shortened_reason};
pub use invalid::InvalidField;
pub use kept::{
    Certificate, Kept, KeptCosts, KeptError, KeptKey, KeptRow, KeptSearch, MAX_KEPT_BYTES, MAX_SCREENING_VIEWS,
};
pub use ladder::{Ladder, MAX_ROWS, Row};
pub use metric::{Metric, UnknownMetric};
pub use outcome::{Choice, Outcome, PromiseState, PruningCheck, RowStatus, RowSummary};
pub use planner::{PlanRequest, Planner, device_name, most_certified};
pub use view::ProbeView;
pub use view_errors::ViewErrors;
