//! Sessions: requests, changes, plans and events.

use cluster::limits::MAX_FALLBACKS;
use cluster::{
    ChangeSession, Quality, SceneHash, SessionEvent, SessionPlan, SessionRequest, SessionStage, at_most, reason,
};
use depth_image::ViewPlanes;
use glam::UVec2;

use super::geometry::{
    bounds_from, bounds_to, camera_to, pinhole_from, pinhole_to, sample_cameras_from, viewpoints_from,
};
use super::policy::{choice_from, choice_to};
use crate::error::{WireError, required};
use crate::proto;
use crate::protocol::{PROTOCOL_VERSION, check_version};

/// A number that the wire writes as 0 where it is absent.
fn nonzero(count: u32) -> Option<u32> {
    (count > 0).then_some(count)
}

/// A rate that the wire writes as 0 where it is absent.
fn frame_rate_from(frames_per_s: f64) -> Option<f64> {
    (frames_per_s != 0.0).then_some(frames_per_s)
}

impl TryFrom<proto::OpenSessionRequest> for SessionRequest {
    type Error = WireError;

    fn try_from(r: proto::OpenSessionRequest) -> Result<Self, WireError> {
        check_version(r.protocol_version)?;
        at_most(r.fallbacks.len(), MAX_FALLBACKS, "fallbacks")?;
        let request = Self {
            scene: if r.scene_hash.is_empty() { None } else { Some(SceneHash::parse(&r.scene_hash)?) },
            method: r.reconstruction_method,
            sampling: r.sampling_method,
            lighting: r.lighting,
            codec: r.frame_codec,
            sample_cameras: sample_cameras_from(r.sample_cameras, 1)?,
            sample_size_px: r.sample_image_size.map(|size| UVec2::new(size.width_px, size.height_px)),
            volume: r.volume.map(bounds_from).transpose()?,
            typical_view: pinhole_from(r.typical_view, "typical_view")?,
            views_per_set: r.views_per_set_count,
            planes: ViewPlanes { inverse_depth: r.with_inverse_depth, provenance: r.with_provenance },
            timeline: required(r.timeline, "timeline")?.into(),
            policy: choice_from(r.policy_choice)?,
            forced_sampler_count: nonzero(r.forced_sampler_count),
            refinement_steps: r.refinement_step_count.max(1),
            frames_per_s: frame_rate_from(r.frames_per_s),
            fallbacks: r.fallbacks.into_iter().map(Into::into).collect(),
            forced_tile_count: nonzero(r.forced_tile_count),
            viewpoints: viewpoints_from(r.viewpoints)?,
        };
        request.validate()?;
        Ok(request)
    }
}

impl From<SessionRequest> for proto::OpenSessionRequest {
    fn from(r: SessionRequest) -> Self {
        Self {
            scene_hash: r.scene.map(Into::into).unwrap_or_default(),
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
            policy_choice: choice_to(r.policy),
            forced_sampler_count: r.forced_sampler_count.unwrap_or(0),
            refinement_step_count: r.refinement_steps,
            frames_per_s: r.frames_per_s.unwrap_or(0.0),
            fallbacks: r.fallbacks.into_iter().map(Into::into).collect(),
            forced_tile_count: r.forced_tile_count.unwrap_or(0),
            viewpoints: r.viewpoints.iter().map(pinhole_to).collect(),
            protocol_version: PROTOCOL_VERSION,
        }
    }
}

impl From<proto::Quality> for Quality {
    fn from(q: proto::Quality) -> Self {
        Self {
            lighting: q.lighting,
            method: q.reconstruction_method,
            sample_side_ratio: q.sample_side_ratio,
            frame_rate_ratio: q.frame_rate_ratio,
        }
    }
}

impl From<Quality> for proto::Quality {
    fn from(q: Quality) -> Self {
        Self {
            lighting: q.lighting,
            reconstruction_method: q.method,
            sample_side_ratio: q.sample_side_ratio,
            frame_rate_ratio: q.frame_rate_ratio,
        }
    }
}

impl TryFrom<proto::ChangeSessionRequest> for ChangeSession {
    type Error = WireError;

    fn try_from(c: proto::ChangeSessionRequest) -> Result<Self, WireError> {
        let viewpoints = viewpoints_from(c.viewpoints)?;
        let change = Self {
            session: c.session_number,
            views_per_set: c.views_per_set_count,
            frames_per_s: frame_rate_from(c.frames_per_s),
            viewpoints: (!viewpoints.is_empty()).then_some(viewpoints),
        };
        change.validate()?;
        Ok(change)
    }
}

impl From<ChangeSession> for proto::ChangeSessionRequest {
    fn from(c: ChangeSession) -> Self {
        Self {
            session_number: c.session,
            views_per_set_count: c.views_per_set,
            frames_per_s: c.frames_per_s.unwrap_or(0.0),
            viewpoints: c.viewpoints.iter().flatten().map(pinhole_to).collect(),
        }
    }
}

impl TryFrom<proto::SessionPlan> for SessionPlan {
    type Error = WireError;

    fn try_from(p: proto::SessionPlan) -> Result<Self, WireError> {
        let plan = Self {
            assignment: required(p.assignment, "plan.assignment")?.try_into()?,
            costs: required(p.costs, "plan.costs")?.try_into()?,
            reason: p.reason,
            predicted_pipeline_s: p.predicted_pipeline_s,
            predicted_direct_s: p.predicted_direct_s,
            predicted_time_share_s: p.predicted_time_share_s,
            k_fd_sampler_count: p.k_fd_sampler_count,
            predicted_k_fd_s: p.predicted_k_fd_s,
            enumerated_sampler_count: p.enumerated_sampler_count,
            predicted_enumerated_s: p.predicted_enumerated_s,
            scene_load_s: p.scene_load_s,
            // On the wire they are numbered from 1.
            fallback_index: p.fallback_number.checked_sub(1),
            frame_rate_ratio: p.frame_rate_ratio,
        };
        plan.validate()?;
        Ok(plan)
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
            fallback_number: p.fallback_index.map_or(0, |index| index + 1),
            frame_rate_ratio: p.frame_rate_ratio,
        }
    }
}

fn stage_from(value: i32) -> Result<SessionStage, WireError> {
    match proto::SessionStage::try_from(value) {
        Ok(proto::SessionStage::Measuring) => Ok(SessionStage::Measuring),
        Ok(proto::SessionStage::Planning) => Ok(SessionStage::Planning),
        Ok(proto::SessionStage::Preparing) => Ok(SessionStage::Preparing),
        _ => Err(WireError::UnknownEnum { field: "stage", value }),
    }
}

fn stage_to(stage: SessionStage) -> i32 {
    match stage {
        SessionStage::Measuring => proto::SessionStage::Measuring.into(),
        SessionStage::Planning => proto::SessionStage::Planning.into(),
        SessionStage::Preparing => proto::SessionStage::Preparing.into(),
    }
}

impl TryFrom<proto::OpenSessionResponse> for SessionEvent {
    type Error = WireError;

    fn try_from(r: proto::OpenSessionResponse) -> Result<Self, WireError> {
        use proto::open_session_response::Event;
        Ok(match required(r.event, "event")? {
            Event::Progress(p) => {
                reason(&p.detail, "detail")?;
                Self::Progress { stage: stage_from(p.stage)?, detail: p.detail }
            }
            Event::Plan(plan) => Self::Plan(Box::new(plan.try_into()?)),
            Event::Ended(ended) => {
                reason(&ended.reason, "ended.reason")?;
                Self::Ended { reason: ended.reason }
            }
            Event::Opened(opened) => Self::Opened { session: opened.session_number },
        })
    }
}

impl From<SessionEvent> for proto::OpenSessionResponse {
    fn from(event: SessionEvent) -> Self {
        use proto::open_session_response::Event;
        let event = match event {
            SessionEvent::Progress { stage, detail } => {
                Event::Progress(proto::SessionProgress { stage: stage_to(stage), detail })
            }
            SessionEvent::Plan(plan) => Event::Plan((*plan).into()),
            SessionEvent::Ended { reason } => Event::Ended(proto::SessionEnded { reason }),
            SessionEvent::Opened { session } => Event::Opened(proto::SessionOpened { session_number: session }),
        };
        Self { event: Some(event) }
    }
}
