//! The wire contract: generated messages, domain conversions, the depth codec and the frame codec.
//!
//! Only this crate names prost messages. Everything else sees domain types, made from messages with
//! typed errors that name the field, and the services of [`rpc`] in terms of them.
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod codec;
mod dealing;
mod demand;
mod error;
mod frame;
mod geometry;
mod illumination;
pub mod limits;
mod live;
mod membership;
mod offer;
mod plan;
mod proto;
mod protocol;
mod report;
pub mod rpc;
mod sample;
mod scene;
mod session;
mod stage_times;
mod view;
mod workload;

#[cfg(test)]
mod conventions_tests;
#[cfg(test)]
mod message_tests;

pub use codec::*;
pub use dealing::{Asked, Deal};
pub use demand::{ChangeSession, Quality};
pub use error::WireError;
pub use frame::{FrameAssembly, FrameHeader, FramePart, RenderViews, RequestedView, WholeFrame};
pub use live::LiveRequest;
pub use membership::{
    AchievedTime, ClusterStatus, JoinCluster, MeasureCosts, NodeCondition, NodeStatus, Ready, Welcome,
};
pub use offer::{OfferSettings, OfferStatus};
pub use plan::{Assignment, CompositorShare, Policy, SamplerShare, SetContent};
pub use protocol::PROTOCOL_VERSION;
pub use report::{MeasuredCosts, SamplerReport, WorkReport};
pub use sample::FetchImages;
pub use scene::{FetchScene, SceneAssembly, SceneHash, ScenePart, SceneRef};
pub use session::{PolicyChoice, SessionEvent, SessionPlan, SessionRequest, SessionStage, UnknownPolicy};
pub use stage_times::StageTimes;
pub use view::{EncodedView, ViewCodecError, decode_view, encode_view};
pub use workload::{Costs, ROW_PARTS, Refinement, Timeline, Workload};
