//! The coordinator's service, the cluster's state and its pure schedule.
//!
//! [`schedule`] decides and does nothing else: no clock, no await. `service` asks it and does the rest.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod config;
mod executor;
mod membership;
mod metrics;
mod observers;
mod opening;
mod probe;
pub mod schedule;
mod service;
mod workload;

pub use config::{CoordinatorConfig, SceneOffer};
pub use metrics::CoordinatorMetrics;
pub use observers::{EventLog, Observers};
pub use service::serve;
