//! What sessions ask for together, and the plan that serves them.

use std::collections::BTreeMap;
use std::time::Duration;

use cluster::{AchievedTime, Assignment, Costs, Policy, Quality, SessionPlan, Workload};
use depth_image::{Camera, PinholeCamera};
use glam::UVec2;

use super::cells::Cells;
use super::overload::Overload;
use super::patience::Patience;
use super::{Load, Opening, Wish};

/// One session's part.
#[derive(Debug, Clone)]
struct Session {
    number: u64,
    views: usize,
    frames_per_s: f64,
    wish: Wish,
    fallbacks: Vec<Quality>,
    viewpoints: Vec<PinholeCamera>,
}

/// Sessions of one workload.
#[derive(Debug, Clone)]
pub(super) struct Work {
    /// As it was asked for, with the cells' sample cameras where there are cells.
    pub(super) asked: Workload,
    /// Of sessions that say from where they look.
    cells: Option<Cells>,
    /// As measured when it was first opened.
    pub(super) costs: Costs,
    /// In the order they were opened.
    sessions: Vec<Session>,
    /// How much of what was asked for can be had.
    pub(super) overload: Overload,
    /// `None` while no node is there.
    pub(super) in_force: Option<InForce>,
    /// Of each policy that has been in force.
    pub(super) achieved: Vec<AchievedTime>,
}

/// A plan and the members it was made for.
#[derive(Debug, Clone)]
pub(super) struct InForce {
    pub(super) plan: SessionPlan,
    /// Incarnations by name.
    pub(super) members: BTreeMap<String, u64>,
    pub(super) patience: Patience,
    /// Seconds that each node has worked for this plan.
    busy_s: BTreeMap<String, f64>,
    /// Views made by this plan.
    views: u64,
}

impl Work {
    pub(super) fn new(opening: &Opening) -> Self {
        Self {
            asked: opening.workload.clone(),
            cells: (!opening.viewpoints.is_empty()).then(|| Cells::of(&opening.workload)),
            costs: opening.costs,
            sessions: Vec::new(),
            overload: Overload::default(),
            in_force: None,
            achieved: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, opening: &Opening) {
        self.sessions.retain(|session| session.number != opening.session);
        let Opening { policy, forced_samplers, forced_tiles, .. } = *opening;
        self.sessions.push(Session {
            number: opening.session,
            views: opening.views_per_set,
            frames_per_s: opening.frames_per_s,
            wish: Wish { policy, forced_samplers, forced_tiles },
            fallbacks: opening.fallbacks.clone(),
            viewpoints: opening.viewpoints.clone(),
        });
        self.follow_views();
    }

    /// Whether a session can be one of this work's.
    pub(super) fn suits(&self, opening: &Opening) -> bool {
        match &self.cells {
            Some(cells) => !opening.viewpoints.is_empty() && cells.suit(&self.asked, &opening.workload),
            None => opening.viewpoints.is_empty() && self.asked == opening.workload,
        }
    }

    pub(super) fn remove(&mut self, number: u64) {
        self.sessions.retain(|session| session.number != number);
        self.follow_views();
    }

    pub(super) fn look(&mut self, number: u64, viewpoints: &[PinholeCamera]) {
        for session in self.sessions.iter_mut().filter(|session| session.number == number) {
            session.viewpoints = viewpoints.to_vec();
        }
        self.follow_views();
    }

    fn follow_views(&mut self) {
        let Some(cells) = &mut self.cells else { return };
        let viewpoints: Vec<_> = self.sessions.iter().flat_map(|session| session.viewpoints.iter().copied()).collect();
        cells.follow(&viewpoints, &self.asked.volume);
        cells.put_into(&mut self.asked);
    }

    /// View cells, where sessions say from where they look.
    pub(super) fn cell_count(&self) -> Option<usize> {
        self.cells.as_ref().map(Cells::len)
    }

    pub(super) fn demand(&mut self, number: u64, views: usize, frames_per_s: f64) {
        for session in self.sessions.iter_mut().filter(|session| session.number == number) {
            (session.views, session.frames_per_s) = (views, frames_per_s);
        }
    }

    pub(super) fn sessions(&self) -> Vec<u64> {
        self.sessions.iter().map(|session| session.number).collect()
    }

    /// V: of all sessions.
    pub(super) fn views(&self) -> usize {
        self.sessions.iter().fold(0, |sum, session| sum.saturating_add(session.views))
    }

    /// Views a second that sessions with a rate ask for, undegraded.
    pub(super) fn views_per_s(&self) -> f64 {
        self.sessions.iter().map(|session| session.frames_per_s * session.views as f64).sum()
    }

    /// Scene time from set to set; of a still scene, a second.
    fn set_s(&self) -> f64 {
        let timeline = &self.asked.timeline;
        if timeline.moves() { timeline.step_s.abs() } else { 1.0 }
    }

    /// Views of a set: what sessions with a rate ask for while it is shown, and what the others ask for at once.
    pub(super) fn load(&self) -> Load {
        let timeline = &self.asked.timeline;
        let at_once = self.sessions.iter().filter(|session| session.frames_per_s == 0.0).map(|session| session.views);
        let at_once = at_once.fold(0usize, usize::saturating_add);
        let rated = (self.views_per_s() * self.frame_rate_ratio() * self.set_s()).ceil() as usize;
        Load {
            images: self.asked.sample_cameras.len(),
            tiles: 1,
            cells: self.asked.cell_count(),
            // A still picture is one set, though it be refined: its sums are kept where it is sampled.
            sets: if timeline.moves() { timeline.set_count as usize } else { 1 },
            views: at_once.saturating_add(rated),
            in_order: self.costs.in_order,
            still: !timeline.moves() && at_once == 0 && rated > 0,
        }
    }

    /// What share of the time a plan that takes so long a set leaves none of; 0 where a session states no rate.
    pub(super) fn utilisation(&self, time_s: f64) -> f64 {
        let all_rated = !self.sessions.is_empty() && self.sessions.iter().all(|session| session.frames_per_s > 0.0);
        if all_rated { time_s / self.set_s() } else { 0.0 }
    }

    /// The last session that was opened decides.
    pub(super) fn wish(&self) -> Wish {
        self.sessions.last().map(|session| session.wish).unwrap_or_default()
    }

    /// What can be gone down to: the last session's, as with its wish.
    pub(super) fn fallbacks(&self) -> &[Quality] {
        self.sessions.last().map_or(&[], |session| &session.fallbacks)
    }

    fn quality(&self) -> Option<&Quality> {
        self.fallbacks().get(self.overload.step.checked_sub(1)?)
    }

    /// Pictures a second, of those asked for.
    pub(super) fn frame_rate_ratio(&self) -> f64 {
        self.quality().map_or(1.0, |quality| quality.frame_rate_ratio)
    }

    /// What is sampled now: as asked for, or less.
    pub(super) fn workload(&self) -> Workload {
        let Some(quality) = self.quality() else { return self.asked.clone() };
        let sized = |camera: &Camera| smaller(camera, quality.sample_side_ratio);
        Workload {
            lighting: quality.lighting.clone(),
            method: quality.method.clone(),
            sample_cameras: self.asked.sample_cameras.iter().map(sized).collect(),
            ..self.asked.clone()
        }
    }
}

fn smaller(camera: &Camera, side_ratio: f64) -> Camera {
    let Camera::Pinhole(camera) = camera;
    let size_px = (camera.size_px.as_dvec2() * side_ratio).round().as_uvec2().max(UVec2::ONE);
    Camera::Pinhole(camera.resized(size_px))
}

impl InForce {
    pub(super) fn new(plan: SessionPlan, members: BTreeMap<String, u64>, now: Duration) -> Self {
        Self { plan, members, patience: Patience::from(now), busy_s: BTreeMap::new(), views: 0 }
    }

    /// Whether another plan would say the same to every node.
    pub(super) fn assigns(&self, other: &Assignment) -> bool {
        // How views are dealt follows every timing, and is no reason for a plan.
        let told = |plan: &Assignment| {
            let mut plan = Assignment { plan_epoch: 0, ..plan.clone() };
            plan.compositors.iter_mut().for_each(|share| share.view_weight = 0);
            plan
        };
        told(&self.plan.assignment) == told(other)
    }

    pub(super) fn policy(&self) -> Policy {
        self.plan.assignment.policy
    }

    pub(super) fn samples(&self, node_name: &str) -> bool {
        self.plan.assignment.samplers.iter().any(|share| share.node_name == node_name)
    }

    /// Whether the node has anything to do.
    pub(super) fn has_role(&self, node_name: &str) -> bool {
        self.samples(node_name) || self.plan.assignment.composites(node_name)
    }

    /// A node has worked for this plan.
    pub(super) fn worked(&mut self, node_name: &str, busy_s: f64, views: u64) {
        *self.busy_s.entry(node_name.to_owned()).or_default() += busy_s;
        self.views = self.views.saturating_add(views);
    }

    /// Seconds of the busiest node for all views of a set, once so many have been made.
    pub(super) fn achieved(&self, views_per_set: usize) -> Option<AchievedTime> {
        let busiest_s = self.busy_s.values().copied().fold(0.0, f64::max);
        let sets = self.views as f64 / views_per_set.max(1) as f64;
        (sets >= 1.0).then(|| AchievedTime { policy: self.policy(), busy_s: busiest_s / sets })
    }
}
