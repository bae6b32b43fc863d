//! The parts that all services share: the device's boundary, configuration, logging, health, measured costs, the plans
//! in force, scenes by hash, membership and drain.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod auto_exposure;
mod blocking;
mod byte_cache;
mod config;
mod connections;
mod device_monitor;
mod engine;
mod latest;
mod measure;
mod membership;
mod parts;
mod plan;
mod port;
mod scenes;
mod server;
mod service;
mod set_bytes;
mod streams;
mod telemetry;
mod view_probes;
mod viewers;
mod work_done;

pub use blocking::blocking;
pub use byte_cache::{ByteCache, Pinned};
pub use config::{Deadlines, NodeConfig, Quotas, view_bytes};
pub use connections::Connections;
pub use depth_image::{Turn, WorkClass};
pub use device_monitor::DeviceMonitor;
pub use engine::{
    CommonSet, DirectWork, Engine, EngineError, LightParts, OpenEngine, SampleSet, SampleWork, SharedSet, UploadedSet,
    ViewWork, own_time,
};
pub use latest::push_latest;
pub use membership::keep_membership;
pub use parts::NodeParts;
pub use plan::{CellPlan, PlansInForce, Relay, beyond_timeline, has_set};
pub use port::Port;
pub use server::{DRAIN, MAX_STREAMS, ServeError, health, serve};
pub use service::NodeService;
pub use set_bytes::{depth_images_bytes, most_image_bytes, most_set_bytes, set_bytes};
pub use streams::{next_within, until_drained, with_guard};
pub use telemetry::{NodeMetrics, Reason, Telemetry, init_logging};
pub use view_probes::{MadeView, ViewAudit, ViewProbes};
pub use work_done::{Operation, WorkDone};
