//! The planner through its public interface: against a made-up ladder, on streams of made-up errors, and with damaged input.

#![allow(clippy::unwrap_used)]

mod audits;
mod bounds;
mod budgets;
mod costs;
mod damaged;
mod ladders;
mod made_up;
mod random;
mod real_errors;
mod remembered;
mod rules;
mod searches;
