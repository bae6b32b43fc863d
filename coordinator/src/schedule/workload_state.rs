//! The demand of all sessions together, and the plan that serves them.

use cluster::{AchievedTime, Costs, Quality, Workload};
use depth_image::{Camera, PinholeCamera};
use glam::UVec2;

use super::active_plan::ActivePlan;
use super::cells::Cells;
use super::overload::Overload;
use super::{Load, Opening, PolicyOverride};

/// The demand of one session.
#[derive(Debug, Clone)]
struct Session {
    number: u64,
    views: usize,
    frames_per_s: Option<f64>,
    policy_override: PolicyOverride,
    fallbacks: Vec<Quality>,
    viewpoints: Vec<PinholeCamera>,
    method: String,
}

/// Sessions of one workload.
#[derive(Debug, Clone)]
pub(super) struct WorkloadState {
    /// Undegraded, with the cells' sample cameras where there are cells.
    pub(super) requested: Workload,
    /// Where sample cameras follow viewpoints.
    cells: Option<Cells>,
    /// As measured when it was first opened.
    pub(super) costs: Costs,
    /// In the order they were opened.
    sessions: Vec<Session>,
    /// The present fallback.
    pub(super) overload: Overload,
    /// `None` while no node is there.
    pub(super) active_plan: Option<ActivePlan>,
    /// Times of each policy that has been in force.
    pub(super) achieved: Vec<AchievedTime>,
}

impl WorkloadState {
    pub(super) fn new(opening: &Opening) -> Self {
        Self {
            requested: opening.workload.clone(),
            cells: (!opening.viewpoints.is_empty()).then(|| Cells::of(&opening.workload)),
            costs: opening.costs,
            sessions: Vec::new(),
            overload: Overload::default(),
            active_plan: None,
            achieved: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, opening: &Opening) {
        self.sessions.retain(|session| session.number != opening.session);
        self.sessions.push(Session {
            number: opening.session,
            views: opening.views_per_set,
            frames_per_s: opening.frames_per_s,
            policy_override: opening.policy_override,
            fallbacks: opening.fallbacks.clone(),
            viewpoints: opening.viewpoints.clone(),
            method: opening.method.clone(),
        });
        self.update_cells();
    }

    /// Whether a session asks for this workload.
    pub(super) fn is_shared_by(&self, opening: &Opening) -> bool {
        match &self.cells {
            Some(cells) => !opening.viewpoints.is_empty() && cells.are_shareable(&self.requested, &opening.workload),
            None => opening.viewpoints.is_empty() && self.requested == opening.workload,
        }
    }

    pub(super) fn remove(&mut self, number: u64) {
        self.sessions.retain(|session| session.number != number);
        self.update_cells();
    }

    pub(super) fn set_viewpoints(&mut self, number: u64, viewpoints: &[PinholeCamera]) {
        for session in self.sessions.iter_mut().filter(|session| session.number == number) {
            session.viewpoints = viewpoints.to_vec();
        }
        self.update_cells();
    }

    fn update_cells(&mut self) {
        let Some(cells) = &mut self.cells else { return };
        let viewpoints: Vec<_> = self.sessions.iter().flat_map(|session| session.viewpoints.iter().copied()).collect();
        cells.follow(&viewpoints, &self.requested.volume);
        cells.place_cameras(&mut self.requested);
    }

    /// The number of view cells, where sample cameras follow viewpoints.
    pub(super) fn cell_count(&self) -> Option<usize> {
        self.cells.as_ref().map(Cells::len)
    }

    pub(super) fn set_demand(&mut self, number: u64, views: usize, frames_per_s: Option<f64>) {
        for session in self.sessions.iter_mut().filter(|session| session.number == number) {
            (session.views, session.frames_per_s) = (views, frames_per_s);
        }
    }

    pub(super) fn sessions(&self) -> Vec<u64> {
        self.sessions.iter().map(|session| session.number).collect()
    }

    /// V of all sessions.
    pub(super) fn views(&self) -> usize {
        self.sessions.iter().fold(0, |sum, session| sum.saturating_add(session.views))
    }

    /// Views a second that sessions with a rate ask for, undegraded.
    pub(super) fn views_per_s(&self) -> f64 {
        self.sessions.iter().filter_map(|session| Some(session.frames_per_s? * session.views as f64)).sum()
    }

    /// Scene time from set to set; a second for a static scene.
    fn set_s(&self) -> f64 {
        let timeline = &self.requested.timeline;
        if timeline.moves() { timeline.step_s.abs() } else { 1.0 }
    }

    /// Views of a set: those of sessions with a rate while the set is shown, and those of the others at once.
    pub(super) fn load(&self) -> Load {
        let timeline = &self.requested.timeline;
        let at_once =
            self.sessions.iter().filter(|session| session.frames_per_s.is_none()).map(|session| session.views);
        let at_once = at_once.fold(0usize, usize::saturating_add);
        let rated = (self.views_per_s() * self.frame_rate_ratio() * self.set_s()).ceil() as usize;
        Load {
            images: self.requested.sample_cameras.len(),
            tiles: 1,
            cells: self.requested.cell_count(),
            // A static scene is one set, though it be refined: the sampler keeps its sums.
            sets: if timeline.moves() { timeline.set_count as usize } else { 1 },
            views: at_once.saturating_add(rated),
            images_are_sequential: self.costs.in_order,
            is_already_sampled: !timeline.moves() && at_once == 0 && rated > 0,
        }
    }

    /// The share of the nodes' time that a plan of `time_s` a set takes; 0 where a session states no rate.
    pub(super) fn utilisation(&self, time_s: f64) -> f64 {
        let all_rated = !self.sessions.is_empty() && self.sessions.iter().all(|session| session.frames_per_s.is_some());
        if all_rated { time_s / self.set_s() } else { 0.0 }
    }

    /// The last session that was opened decides.
    pub(super) fn policy_override(&self) -> PolicyOverride {
        self.sessions.last().map(|session| session.policy_override).unwrap_or_default()
    }

    /// The fallbacks of the last session, which decides on these, too.
    pub(super) fn fallbacks(&self) -> &[Quality] {
        self.sessions.last().map_or(&[], |session| &session.fallbacks)
    }

    fn quality(&self) -> Option<&Quality> {
        self.fallbacks().get(self.overload.step.checked_sub(1)?)
    }

    /// Pictures a second over those asked for.
    pub(super) fn frame_rate_ratio(&self) -> f64 {
        self.quality().map_or(1.0, |quality| quality.frame_rate_ratio)
    }

    /// How views are reconstructed: under a fallback as it says, else as the last session asks.
    pub(super) fn method(&self) -> String {
        let asked = self.sessions.last().map(|session| &session.method);
        self.quality().map(|quality| &quality.method).or(asked).cloned().unwrap_or_default()
    }

    /// The workload at the present fallback.
    pub(super) fn degraded(&self) -> Workload {
        let Some(quality) = self.quality() else { return self.requested.clone() };
        let sized = |Camera::Pinhole(camera): &Camera| {
            let size_px = (camera.size_px.as_dvec2() * quality.sample_side_ratio).round().as_uvec2().max(UVec2::ONE);
            Camera::Pinhole(camera.resized(size_px))
        };
        Workload {
            lighting: quality.lighting.clone(),
            sample_cameras: self.requested.sample_cameras.iter().map(sized).collect(),
            ..self.requested.clone()
        }
    }
}
