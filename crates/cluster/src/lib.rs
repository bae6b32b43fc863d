//! The cluster's model: requests of sessions, reports of members, and the plans that give members their roles.
//!
//! These are the types of the domain, without protobuf: `wire` converts messages to them. A value that a type does not
//! allow is an [`InvalidField`], which names the field. Types with a `validate` can be read from any source and checked
//! afterwards.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod assignment;
mod audit;
mod check;
mod common_cell;
mod costs;
pub mod limits;
mod node;
mod policy;
mod promise;
mod scene;
mod session;
mod status;
mod timeline;
mod views;
mod workload;

#[cfg(test)]
mod assignment_tests;
#[cfg(test)]
mod test_support;

pub use assignment::{ApplyPlan, Assignment, CompositorShare, SamplerShare};
pub use audit::{AuditOrder, AuditReport, AuditSummary, AuditedView, MAX_AUDIT_TIME_RATIO, MOST_PLANNED_PIXELS};
pub use check::{
    InvalidField, at_most, finite_seconds, frame_rate, nonempty, ratio, reason, text, tile_count, viewpoints,
};
pub use common_cell::{CommonCell, CommonKind};
pub use costs::{Costs, MeasuredCosts, ROW_PARTS, TileCosts, TimedSize};
pub use depth_image::Refinement;
pub use node::{
    BudgetMeasurement, JoinCluster, MeasureCosts, Measured, NodeStatus, Ready, SamplerReport, SharedLightCosts,
    Welcome, WorkReport,
};
pub use planner::{Interval as ErrorInterval, ViewErrors};
pub use policy::{Policy, PolicyChoice, UnknownPolicy};
pub use promise::{BudgetRequest, Promise, PromiseState};
pub use scene::{FetchScene, SceneHash, ScenePart, SceneRef};
pub use session::{ChangeSession, Quality, SessionEvent, SessionPlan, SessionRequest, SessionStage};
pub use status::{AchievedTime, ClusterStatus, NodeCondition, OfferSettings, OfferStatus, WorkloadStatus};
pub use timeline::Timeline;
pub use views::{DIRECT, FetchImages, LiveRequest, RenderViews, RequestedView, check_view_count, check_view_size};
pub use workload::{SamplePlanes, SetContent, Workload, has_indirect_light};
