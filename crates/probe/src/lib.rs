//! Measurements for the planner on one device: the errors of a representation's views against the same views drawn from the
//! scene, and its costs.
//!
//! A [`Prober`] measures any [`Representation`] of a [`Subject`], through [`node::Engine`]. [`answer`] measures what one
//! command of a [`planner::Planner`] asks for, and [`plan`] makes a whole plan on this device alone. [`Probers`] measure for a
//! coordinator. See `docs/planner.md`.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod errors_of_views;
mod plan;
mod prober;
mod service;
mod sets;
mod subject;

pub use errors_of_views::view_errors;
pub use plan::{answer, plan};
pub use prober::{DirectCosts, Measured, ProbeError, Prober};
pub use service::Probers;
pub use subject::{Light, Representation, Subject, Viewpoints};
