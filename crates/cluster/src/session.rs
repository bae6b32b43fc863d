//! Sessions: requests of clients, the lower qualities that they accept, and the answers.

use std::num::NonZeroU32;

use depth_image::{Aabb, Camera, ExposureEv, PinholeCamera, ViewPlanes};
use glam::UVec2;
use serde::{Deserialize, Serialize};

use crate::assignment::Assignment;
use crate::check::{
    InvalidField, at_most, frame_rate, nonempty, pinholes, ratio, reason, text, tile_count, viewpoints, within,
};
use crate::check_seconds;
use crate::costs::Costs;
use crate::limits::{MAX_FALLBACKS, MAX_REFINEMENT_STEPS, MAX_SAMPLE_CAMERAS, MAX_VIEWS_PER_SET};
use crate::policy::{Policy, PolicyChoice};
use crate::promise::{BudgetRequest, Promise};
use crate::timeline::Timeline;
use crate::views::check_view_size;

/// The request that opens a session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionRequest {
    /// The name or the hash of a scene on offer; `None`: the first.
    pub scene: Option<String>,
    /// How views are reconstructed.
    pub method: String,
    /// How images are sampled.
    pub sampling: String,
    /// How samples are lit.
    pub lighting: String,
    /// Mirrors in reconstructed views show the scene, as the lighting says: samples have mirror cells, but for mirrors that a base shows as
    /// finely. A base shows mirrors in any case.
    pub follows_mirrors: bool,
    /// Views take only light from samples, which are then as dense as views. Others take surfaces, too, from samples that are twice as
    /// dense.
    pub takes_light: bool,
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
    /// The exposure of views is the plan's, in place of that of `planes`.
    pub auto_exposure: bool,
    /// Scene times.
    pub timeline: Timeline,
    /// The policy, or that the schedule decides.
    pub policy: PolicyChoice,
    /// K, instead of the balance formula's.
    pub forced_sampler_count: Option<u32>,
    /// Steps in which a still picture is refined, one a set; see [`Workload::refinement`](crate::Workload::refinement).
    /// From 1, where every set is finished, to [`MAX_REFINEMENT_STEPS`](crate::limits::MAX_REFINEMENT_STEPS).
    pub refinement_steps: u32,
    /// Pictures a second, of `views_per_set` views each; `None`: as fast as they come, as of a batch.
    pub frames_per_s: Option<f64>,
    /// Qualities that it accepts under overload, in this order.
    pub fallbacks: Vec<Quality>,
    /// Tiles of a sample image, instead of as many as are predicted to be fastest.
    pub forced_tile_count: Option<u32>,
    /// Viewpoints of the session, in place of `sample_cameras`: sample cameras are placed around them, in view cells where
    /// they are far apart.
    pub viewpoints: Vec<PinholeCamera>,
    /// Its budget.
    pub budget: BudgetRequest,
}

impl SessionRequest {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        within(self.views_per_set, 1..=MAX_VIEWS_PER_SET, "views_per_set_count", "from 1 to 65536")?;
        within(self.refinement_steps, 1..=MAX_REFINEMENT_STEPS, "refinement_step_count", "from 1 to 64")?;
        text(self.scene.as_deref().unwrap_or_default(), "scene")?;
        nonempty(&self.method, "reconstruction_method")?;
        nonempty(&self.sampling, "sampling_method")?;
        nonempty(&self.lighting, "lighting")?;
        nonempty(&self.codec, "frame_codec")?;
        at_most(self.sample_cameras.len(), MAX_SAMPLE_CAMERAS, "sample_cameras")?;
        pinholes(self.sample_cameras.iter())?;
        check_view_size(self.typical_view.size_px, "typical_view.size_px")?;
        self.timeline.validate()?;
        frame_rate(self.frames_per_s)?;
        at_most(self.fallbacks.len(), MAX_FALLBACKS, "fallbacks")?;
        self.fallbacks.iter().try_for_each(Quality::validate)?;
        self.forced_tile_count.map_or(Ok(()), tile_count)?;
        text(self.budget.budget.as_deref().unwrap_or_default(), "budget")?;
        viewpoints(&self.viewpoints)
    }
}

/// A quality below the one that a session asked for. It has no common cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// How samples are lit.
    pub lighting: String,
    /// How views are reconstructed.
    pub method: String,
    /// Sides of sample images, of those asked for: above 0, at most 1.
    pub sample_side_ratio: f64,
    /// Pictures a second, of those asked for: above 0, at most 1.
    pub frame_rate_ratio: f64,
}

impl Quality {
    /// # Errors
    /// For settings that are missing or too long, and for ratios that are not above 0 and at most 1.
    pub fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.lighting, "fallbacks.lighting")?;
        nonempty(&self.method, "fallbacks.reconstruction_method")?;
        ratio(self.sample_side_ratio, "fallbacks.sample_side_ratio")?;
        ratio(self.frame_rate_ratio, "fallbacks.frame_rate_ratio")
    }
}

/// A session asks for more, or for less.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeSession {
    /// The session's number at the coordinator.
    pub session: u64,
    /// V: views that are asked of each sample set.
    pub views_per_set: u32,
    /// Pictures a second; `None`: as fast as they come.
    pub frames_per_s: Option<f64>,
    /// New viewpoints; `None`: as before.
    pub viewpoints: Option<Vec<PinholeCamera>>,
}

impl ChangeSession {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        within(self.views_per_set, 0..=MAX_VIEWS_PER_SET, "views_per_set_count", "from 0 to 65536")?;
        frame_rate(self.frames_per_s)?;
        viewpoints(self.viewpoints.as_deref().unwrap_or_default())
    }
}

/// The coordinator's work on a session before its plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionStage {
    /// Nodes measure their costs.
    Measuring,
    /// K and the policy are chosen.
    Planning,
    /// Nodes load the scene and take their roles.
    Preparing,
}

/// The plan, and why it is so.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionPlan {
    /// The plan that every node gets.
    pub assignment: Assignment,
    /// The slowest node's costs, as measured.
    pub costs: Costs,
    /// Why the plan is so, in plain words, with the figures.
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
    /// K of the best assignment that enumeration finds.
    pub enumerated_sampler_count: u32,
    /// Seconds a sample set with that assignment.
    pub predicted_enumerated_s: f64,
    /// The slowest node's time to load the scene; 0 where all had loaded it.
    pub scene_load_s: f64,
    /// The number of the session's fallback in force, from 1; `None`: the quality that was asked for.
    pub fallback: Option<NonZeroU32>,
    /// How views are reconstructed: as the assignment says, else by most sessions.
    pub method: String,
    /// Pictures a second, of those asked for.
    pub frame_rate_ratio: f64,
    /// The exposure of sessions that leave it to the plan: measured when the workload was opened, and the same in all of its
    /// plans.
    pub auto_exposure: ExposureEv,
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

    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        self.assignment.validate()?;
        self.costs.validate()?;
        reason(&self.reason, "plan.reason")?;
        nonempty(&self.method, "plan.reconstruction_method")?;
        check_seconds!(self; predicted_pipeline_s, predicted_direct_s, predicted_time_share_s, predicted_k_fd_s);
        check_seconds!(self; predicted_enumerated_s, scene_load_s);
        ratio(self.frame_rate_ratio, "frame_rate_ratio")
    }
}

/// A message of a session's stream.
#[derive(Debug, Clone, PartialEq)]
pub enum SessionEvent {
    /// The first message.
    Opened {
        /// The session's number, which changes of the session name.
        session: u64,
    },
    /// Before the plan.
    Progress {
        /// The work under way.
        stage: SessionStage,
        /// Details for a person.
        detail: String,
    },
    /// A plan is in force.
    Plan(Box<SessionPlan>),
    /// The promise to the session has changed.
    Promise(Promise),
}
