//! Sessions: offers, requests, changes, plans and events.

use cluster::limits::{MAX_FALLBACKS, MAX_SAMPLE_CAMERAS, MAX_VIEWPOINTS};
use cluster::{
    AuditSummary, ChangeSession, ErrorInterval, OfferStatus, PolicyChoice, Promise, PromiseState, Quality,
    SessionEvent, SessionPlan, SessionRequest, SessionStage, at_most, reason,
};
use depth_image::SourceSpace;
use glam::DVec3;

use super::{Convert, required};
use crate::error::{PROTOCOL_VERSION, WireError, check_version};
use crate::proto::{self, open_session_response::Event};

enums! {
    PolicyChoice { Auto, Pipeline, Direct, TimeShare }
    SessionStage { Measuring, Planning, Preparing }
    PromiseState { Measuring, Kept, Broken, Unreachable }
}

messages! {
    SceneOffer = OfferStatus {
        name, scene as "offer.scene", sample_cameras, volume as "offer.volume", period_s;
        source_space: origin_in_source_x_m | origin_in_source_y_m | origin_in_source_z_m | metres_per_source_unit,
        settings: reconstruction_method | sampling_method | lighting
    }, first |o| at_most(o.sample_cameras.len(), MAX_SAMPLE_CAMERAS, "sample_cameras"), then OfferStatus::validate;
    OpenSessionRequest = SessionRequest {
        scene, lighting, follows_mirrors, takes_light, sample_cameras, volume, typical_view, timeline, forced_sampler_count, frames_per_s, fallbacks,
        forced_tile_count, viewpoints;
        method: reconstruction_method, sampling: sampling_method, codec: frame_codec,
        sample_size_px: sample_image_size, views_per_set: views_per_set_count,
        planes: antialias_sample_count | exposure_ev | tone_curve | with_inverse_depth | with_provenance,
        auto_exposure: with_auto_exposure, policy: policy_choice, refinement_steps: refinement_step_count,
        budget: budget | is_method_named
    }, with protocol_version = PROTOCOL_VERSION, first check_request, then SessionRequest::validate;
    Quality = Quality { lighting, sample_side_ratio, frame_rate_ratio; method: reconstruction_method };
    ChangeSessionRequest = ChangeSession {
        frames_per_s, viewpoints; session: session_number, views_per_set: views_per_set_count
    }, first |c| at_most(c.viewpoints.len(), MAX_VIEWPOINTS, "viewpoints"), then ChangeSession::validate;
    SessionPlan = SessionPlan {
        assignment as "plan.assignment", costs as "plan.costs", reason, predicted_pipeline_s, predicted_direct_s,
        predicted_time_share_s, k_fd_sampler_count, predicted_k_fd_s, enumerated_sampler_count, predicted_enumerated_s,
        scene_load_s, frame_rate_ratio; fallback: fallback_number, method: reconstruction_method, auto_exposure: auto_exposure_ev
    }, then SessionPlan::validate;
    Promise = Promise {
        budget, state, representation, expected_ratio, bound_ratio, probe_view_count, reason, audit
    }, then Promise::validate;
    AuditSummary = AuditSummary {
        error;
        audited_views: audited_view_count, covered_views: covered_view_count, uncovered_views: uncovered_view_count
    };
    ErrorInterval = ErrorInterval { ; low: least_ratio, mean: mean_ratio, high: greatest_ratio };
}

impl Convert<(f64, f64, f64, f64)> for SourceSpace {
    fn read((x, y, z, metres_per_unit): (f64, f64, f64, f64), _: &'static str) -> Result<Self, WireError> {
        Ok(Self { origin_in_source: DVec3::new(x, y, z), metres_per_unit })
    }

    fn write(self) -> (f64, f64, f64, f64) {
        let DVec3 { x, y, z } = self.origin_in_source;
        (x, y, z, self.metres_per_unit)
    }
}

fn check_request(request: &mut proto::OpenSessionRequest) -> Result<(), WireError> {
    check_version(request.protocol_version)?;
    at_most(request.fallbacks.len(), MAX_FALLBACKS, "fallbacks")?;
    at_most(request.sample_cameras.len(), MAX_SAMPLE_CAMERAS, "sample_cameras")?;
    at_most(request.viewpoints.len(), MAX_VIEWPOINTS, "viewpoints")?;
    request.refinement_step_count = request.refinement_step_count.max(1);
    Ok(())
}

impl Convert<proto::OpenSessionResponse> for SessionEvent {
    fn read(response: proto::OpenSessionResponse, _: &'static str) -> Result<Self, WireError> {
        Ok(match required(response.event, "event")? {
            Event::Progress(p) => {
                reason(&p.detail, "detail")?;
                Self::Progress { stage: Convert::read(p.stage, "stage")?, detail: p.detail }
            }
            Event::Plan(plan) => Self::Plan(Box::new(Convert::read(plan, "plan")?)),
            Event::Opened(opened) => Self::Opened { session: opened.session_number },
            Event::Promise(promise) => Self::Promise(Convert::read(promise, "promise")?),
        })
    }

    fn write(self) -> proto::OpenSessionResponse {
        let event = match self {
            Self::Progress { stage, detail } => {
                Event::Progress(proto::SessionProgress { stage: stage.write(), detail })
            }
            Self::Plan(plan) => Event::Plan(plan.write()),
            Self::Opened { session } => Event::Opened(proto::SessionOpened { session_number: session }),
            Self::Promise(promise) => Event::Promise(promise.write()),
        };
        proto::OpenSessionResponse { event: Some(event) }
    }
}
