//! Opening a session: what a client asks for and what it is told.

use std::fmt;
use std::str::FromStr;

use depth_image::{Aabb, Camera, PinholeCamera, ViewPlanes};
use glam::UVec2;

use crate::demand::{fallbacks_from, rate_from, ratio_from};
use crate::error::{WireError, required};
use crate::geometry::{
    bounds_from, bounds_to, camera_to, pinhole_from, pinhole_to, sample_cameras_from, viewpoints_from,
};
use crate::limits::{MAX_VIEWS_PER_SET, nonempty, reason, seconds};
use crate::plan::tile_count_from;
use crate::protocol::{PROTOCOL_VERSION, same_version};
use crate::workload::refinement_steps_from;
use crate::{Assignment, Costs, Policy, Quality, SceneHash, Timeline, proto};

/// What the client wants to happen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PolicyChoice {
    /// Whatever is predicted to be faster.
    #[default]
    Auto,
    /// Samplers and compositors.
    Pipeline,
    /// Every node draws from the scene.
    Direct,
    /// Every node samples and reconstructs.
    TimeShare,
}

/// A policy that is not there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown policy {0:?}, expected auto, pipeline, direct or time-share")]
pub struct UnknownPolicy(String);

impl fmt::Display for PolicyChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Pipeline => "pipeline",
            Self::Direct => "direct",
            Self::TimeShare => "time-share",
        })
    }
}

impl FromStr for PolicyChoice {
    type Err = UnknownPolicy;

    fn from_str(name: &str) -> Result<Self, UnknownPolicy> {
        let all = [Self::Auto, Self::Pipeline, Self::Direct, Self::TimeShare];
        all.into_iter().find(|choice| choice.to_string() == name).ok_or_else(|| UnknownPolicy(name.to_owned()))
    }
}

impl PolicyChoice {
    fn from_wire(value: i32) -> Result<Self, WireError> {
        match proto::PolicyChoice::try_from(value) {
            Ok(proto::PolicyChoice::Auto) => Ok(Self::Auto),
            Ok(proto::PolicyChoice::Pipeline) => Ok(Self::Pipeline),
            Ok(proto::PolicyChoice::Direct) => Ok(Self::Direct),
            Ok(proto::PolicyChoice::TimeShare) => Ok(Self::TimeShare),
            _ => Err(WireError::UnknownEnum { field: "policy_choice", value }),
        }
    }

    fn to_wire(self) -> i32 {
        match self {
            Self::Auto => proto::PolicyChoice::Auto.into(),
            Self::Pipeline => proto::PolicyChoice::Pipeline.into(),
            Self::Direct => proto::PolicyChoice::Direct.into(),
            Self::TimeShare => proto::PolicyChoice::TimeShare.into(),
        }
    }
}

/// What a client asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionRequest {
    /// `None`: the coordinator's own scene.
    pub scene: Option<SceneHash>,
    /// How views are reconstructed.
    pub method: String,
    /// How images are sampled.
    pub sampling: String,
    /// How samples are lit.
    pub lighting: String,
    /// How frames are encoded.
    pub codec: String,
    /// Empty: the rig that the coordinator was given with the scene.
    pub sample_cameras: Vec<Camera>,
    /// Gives the sample images another size, at the same field of view.
    pub sample_size_px: Option<UVec2>,
    /// `None`: the volume that the coordinator was given with the scene.
    pub volume: Option<Aabb>,
    /// A view as most will be: costs are measured on it.
    pub typical_view: PinholeCamera,
    /// V: views that are asked of each sample set.
    pub views_per_set: u32,
    /// Planes that views will have.
    pub planes: ViewPlanes,
    /// Scene times.
    pub timeline: Timeline,
    /// Who decides how.
    pub policy: PolicyChoice,
    /// K, instead of the balance formula's.
    pub forced_sampler_count: Option<u32>,
    /// Steps in which a still picture is refined, one a set; see [`Workload::refinement`](crate::Workload::refinement).
    /// From 1, where every set is finished, to [`MAX_REFINEMENT_STEPS`](crate::limits::MAX_REFINEMENT_STEPS).
    pub refinement_steps: u32,
    /// Pictures a second, of `views_per_set` views each; 0: as fast as they come, as of a batch.
    pub frames_per_s: f64,
    /// What it makes do with under overload, in this order.
    pub fallbacks: Vec<Quality>,
    /// Tiles of a sample image, instead of as many as are predicted to be fastest.
    pub forced_tile_count: Option<u32>,
    /// From where the session looks, in place of `sample_cameras`: sample cameras are placed around them, in view cells
    /// where they are far apart.
    pub viewpoints: Vec<PinholeCamera>,
}

impl TryFrom<proto::OpenSessionRequest> for SessionRequest {
    type Error = WireError;

    fn try_from(r: proto::OpenSessionRequest) -> Result<Self, WireError> {
        same_version(r.protocol_version)?;
        if !(1..=MAX_VIEWS_PER_SET).contains(&r.views_per_set_count) {
            return Err(WireError::out_of_range("views_per_set_count", r.views_per_set_count, "from 1 to 65536"));
        }
        Ok(Self {
            scene: if r.scene_hash.is_empty() { None } else { Some(SceneHash::parse(&r.scene_hash)?) },
            method: nonempty(r.reconstruction_method, "reconstruction_method")?,
            sampling: nonempty(r.sampling_method, "sampling_method")?,
            lighting: nonempty(r.lighting, "lighting")?,
            codec: nonempty(r.frame_codec, "frame_codec")?,
            sample_cameras: sample_cameras_from(r.sample_cameras, 1)?,
            sample_size_px: r.sample_image_size.map(|size| UVec2::new(size.width_px, size.height_px)),
            volume: r.volume.map(bounds_from).transpose()?,
            typical_view: pinhole_from(r.typical_view, "typical_view")?,
            views_per_set: r.views_per_set_count,
            planes: ViewPlanes { inverse_depth: r.with_inverse_depth, provenance: r.with_provenance },
            timeline: required(r.timeline, "timeline")?.try_into()?,
            policy: PolicyChoice::from_wire(r.policy_choice)?,
            forced_sampler_count: (r.forced_sampler_count > 0).then_some(r.forced_sampler_count),
            refinement_steps: refinement_steps_from(r.refinement_step_count.max(1))?,
            frames_per_s: rate_from(r.frames_per_s)?,
            fallbacks: fallbacks_from(r.fallbacks)?,
            forced_tile_count: match r.forced_tile_count {
                0 => None,
                count => Some(tile_count_from(count)?),
            },
            viewpoints: viewpoints_from(r.viewpoints)?,
        })
    }
}

impl From<SessionRequest> for proto::OpenSessionRequest {
    fn from(r: SessionRequest) -> Self {
        Self {
            scene_hash: r.scene.map(|hash| hash.to_string()).unwrap_or_default(),
            reconstruction_method: r.method,
            sampling_method: r.sampling,
            lighting: r.lighting,
            frame_codec: r.codec,
            sample_cameras: r.sample_cameras.iter().map(camera_to).collect(),
            sample_image_size: r.sample_size_px.map(|size| proto::ImageSize { width_px: size.x, height_px: size.y }),
            volume: r.volume.as_ref().map(bounds_to),
            typical_view: Some(pinhole_to(&r.typical_view)),
            views_per_set_count: r.views_per_set,
            with_inverse_depth: r.planes.inverse_depth,
            with_provenance: r.planes.provenance,
            timeline: Some(r.timeline.into()),
            policy_choice: r.policy.to_wire(),
            forced_sampler_count: r.forced_sampler_count.unwrap_or(0),
            refinement_step_count: r.refinement_steps,
            frames_per_s: r.frames_per_s,
            fallbacks: r.fallbacks.into_iter().map(Into::into).collect(),
            forced_tile_count: r.forced_tile_count.unwrap_or(0),
            viewpoints: r.viewpoints.iter().map(pinhole_to).collect(),
            protocol_version: PROTOCOL_VERSION,
        }
    }
}

/// What the coordinator is doing for a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionStage {
    /// Nodes measure their costs.
    Measuring,
    /// K and the policy are chosen.
    Planning,
    /// Nodes load the scene and take their roles.
    Preparing,
}

impl SessionStage {
    fn from_wire(value: i32) -> Result<Self, WireError> {
        match proto::SessionStage::try_from(value) {
            Ok(proto::SessionStage::Measuring) => Ok(Self::Measuring),
            Ok(proto::SessionStage::Planning) => Ok(Self::Planning),
            Ok(proto::SessionStage::Preparing) => Ok(Self::Preparing),
            _ => Err(WireError::UnknownEnum { field: "stage", value }),
        }
    }

    fn to_wire(self) -> i32 {
        match self {
            Self::Measuring => proto::SessionStage::Measuring.into(),
            Self::Planning => proto::SessionStage::Planning.into(),
            Self::Preparing => proto::SessionStage::Preparing.into(),
        }
    }
}

/// The plan, and why it is so.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionPlan {
    /// What every node was told.
    pub assignment: Assignment,
    /// As measured: the slowest node's.
    pub costs: Costs,
    /// In plain words, with the figures.
    pub reason: String,
    /// Seconds a sample set with samplers and compositors.
    pub predicted_pipeline_s: f64,
    /// Seconds a sample set's views when drawn from the scene.
    pub predicted_direct_s: f64,
    /// Seconds a sample set where every node both samples and makes views.
    pub predicted_time_share_s: f64,
    /// K by the balance formula, on the mean of the nodes' costs.
    pub k_fd_sampler_count: u32,
    /// Seconds a sample set with that K.
    pub predicted_k_fd_s: f64,
    /// K of the best assignment that trying finds.
    pub enumerated_sampler_count: u32,
    /// Seconds a sample set with that assignment.
    pub predicted_enumerated_s: f64,
    /// The slowest node's time to load the scene; 0 where all had it.
    pub scene_load_s: f64,
    /// Which of the session's fallbacks, from 1; 0: all that was asked for.
    pub fallback_number: u32,
    /// Pictures a second, of those asked for.
    pub frame_rate_ratio: f64,
}

impl SessionPlan {
    /// K: nodes that sample.
    #[must_use]
    pub fn sampler_count(&self) -> usize {
        self.assignment.samplers.len()
    }

    /// Seconds of one view on a compositor, as costs were measured.
    #[must_use]
    pub fn view_s(&self) -> f64 {
        let device_s = match self.assignment.policy {
            Policy::Direct => self.costs.direct_view_s,
            Policy::Pipeline | Policy::TimeShare => self.costs.reconstruct_view_s,
        };
        device_s + self.costs.encode_view_s
    }

    /// Seconds a sample set by the policy that was chosen.
    #[must_use]
    pub fn predicted_s(&self) -> f64 {
        match self.assignment.policy {
            Policy::Pipeline => self.predicted_pipeline_s,
            Policy::Direct => self.predicted_direct_s,
            Policy::TimeShare => self.predicted_time_share_s,
        }
    }
}

/// What a session's stream carries.
#[derive(Debug, Clone, PartialEq)]
pub enum SessionEvent {
    /// First.
    Opened {
        /// To change what the session asks for.
        session: u64,
    },
    /// Before the plan.
    Progress {
        /// What is being done.
        stage: SessionStage,
        /// For a person.
        detail: String,
    },
    /// Once.
    Plan(Box<SessionPlan>),
    /// The plan no longer holds.
    Ended {
        /// Why.
        reason: String,
    },
}

impl TryFrom<proto::SessionPlan> for SessionPlan {
    type Error = WireError;

    fn try_from(p: proto::SessionPlan) -> Result<Self, WireError> {
        Ok(Self {
            assignment: required(p.assignment, "plan.assignment")?.try_into()?,
            costs: required(p.costs, "plan.costs")?.try_into()?,
            reason: reason(p.reason, "plan.reason")?,
            predicted_pipeline_s: seconds(p.predicted_pipeline_s, "predicted_pipeline_s")?,
            predicted_direct_s: seconds(p.predicted_direct_s, "predicted_direct_s")?,
            predicted_time_share_s: seconds(p.predicted_time_share_s, "predicted_time_share_s")?,
            k_fd_sampler_count: p.k_fd_sampler_count,
            predicted_k_fd_s: seconds(p.predicted_k_fd_s, "predicted_k_fd_s")?,
            enumerated_sampler_count: p.enumerated_sampler_count,
            predicted_enumerated_s: seconds(p.predicted_enumerated_s, "predicted_enumerated_s")?,
            scene_load_s: seconds(p.scene_load_s, "scene_load_s")?,
            fallback_number: p.fallback_number,
            frame_rate_ratio: ratio_from(p.frame_rate_ratio, "frame_rate_ratio")?,
        })
    }
}

impl From<SessionPlan> for proto::SessionPlan {
    fn from(p: SessionPlan) -> Self {
        Self {
            assignment: Some(p.assignment.into()),
            costs: Some(p.costs.into()),
            reason: p.reason,
            predicted_pipeline_s: p.predicted_pipeline_s,
            predicted_direct_s: p.predicted_direct_s,
            predicted_time_share_s: p.predicted_time_share_s,
            k_fd_sampler_count: p.k_fd_sampler_count,
            predicted_k_fd_s: p.predicted_k_fd_s,
            enumerated_sampler_count: p.enumerated_sampler_count,
            predicted_enumerated_s: p.predicted_enumerated_s,
            scene_load_s: p.scene_load_s,
            fallback_number: p.fallback_number,
            frame_rate_ratio: p.frame_rate_ratio,
        }
    }
}

impl TryFrom<proto::OpenSessionResponse> for SessionEvent {
    type Error = WireError;

    fn try_from(r: proto::OpenSessionResponse) -> Result<Self, WireError> {
        use proto::open_session_response::Event;
        Ok(match required(r.event, "event")? {
            Event::Progress(p) => {
                Self::Progress { stage: SessionStage::from_wire(p.stage)?, detail: reason(p.detail, "detail")? }
            }
            Event::Plan(plan) => Self::Plan(Box::new(plan.try_into()?)),
            Event::Ended(ended) => Self::Ended { reason: reason(ended.reason, "ended.reason")? },
            Event::Opened(opened) => Self::Opened { session: opened.session_number },
        })
    }
}

impl From<SessionEvent> for proto::OpenSessionResponse {
    fn from(event: SessionEvent) -> Self {
        use proto::open_session_response::Event;
        let event = match event {
            SessionEvent::Progress { stage, detail } => {
                Event::Progress(proto::SessionProgress { stage: stage.to_wire(), detail })
            }
            SessionEvent::Plan(plan) => Event::Plan((*plan).into()),
            SessionEvent::Ended { reason } => Event::Ended(proto::SessionEnded { reason }),
            SessionEvent::Opened { session } => Event::Opened(proto::SessionOpened { session_number: session }),
        };
        Self { event: Some(event) }
    }
}
