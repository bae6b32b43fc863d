//! Measurements for budgets on one device: the errors of views against the same views drawn from the scene, and what they
//! cost. [`Probers`] measure for a coordinator and for `myriorama plan`. See `docs/planner.md`.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod errors_of_views;
mod prober;
mod service;

pub use errors_of_views::view_errors;
pub use service::Probers;
