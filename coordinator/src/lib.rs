//! The coordinator's service, the cluster's state and its pure schedule.
//!
//! [`schedule`] makes all decisions, and does nothing else: no clock, no await. `service` turns calls into its events, and
//! `executor` carries its commands out.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod config;
mod cost_table;
mod executor;
mod grpc_status;
mod light_samples;
mod measuring;
mod measuring_queue;
mod membership;
mod observers;
mod probe;
pub mod schedule;
mod service;
mod session_budget;
mod session_opening;
mod sessions;
mod shared;
mod view_probes;
mod workload;

pub use config::{CoordinatorConfig, OfferError, OfferedCell, OfferedCube, SceneOffer, SceneOffers};
pub use observers::{CoordinatorMetrics, EventLog, Observers};
pub use service::serve;
pub use session_budget::plan_for_session;
