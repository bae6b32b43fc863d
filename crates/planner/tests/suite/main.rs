//! The planner against made-up scenes, and the alarm and the bounds against made-up errors.
#![allow(clippy::unwrap_used, reason = "tests")]

mod audits;
mod budgets;
mod made_up;
mod plans;
