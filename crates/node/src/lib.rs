//! What every service shares: the device's boundary, configuration, logging, health, measured costs,
//! the plan in force, scenes by hash, membership and drain.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod blocking;
mod config;
mod connections;
mod engine;
mod logging;
mod measure;
mod membership;
mod plan;
mod scenes;
mod server;
mod service;
mod streams;
mod telemetry;

pub use blocking::blocking;
pub use config::{Deadlines, NodeConfig};
pub use connections::Connections;
pub use engine::{DirectWork, Engine, EngineError, SampleSet, SampleWork, UploadedSet, ViewWork};
pub use logging::init_logging;
pub use measure::{MeasureError, measure_costs};
pub use membership::keep_membership;
pub use plan::CurrentPlan;
pub use scenes::Scenes;
pub use server::{DRAIN, MAX_STREAMS, ServeError, health, serve};
pub use service::NodeService;
pub use streams::{next_within, until_drained, with_guard};
pub use telemetry::{NodeMetrics, Telemetry};
