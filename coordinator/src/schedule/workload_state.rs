//! One workload: its sessions, its nodes, and the plan that serves it.

use std::array;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use cluster::{AchievedTime, AuditOrder, Costs, Policy, PolicyChoice, Promise, Quality, Workload};
use depth_image::{PinholeCamera, SampleCamera, ViewCell};
use glam::UVec2;
use planner::Row;

use super::active_plan::ActivePlan;
use super::budgeted::Budgeted;
use super::cells::Cells;
use super::node_costs::view_s;
use super::operations::operations;
use super::overload::{FULL, Overload};
use super::representation::Representation;
use super::session_mix::SessionMix;
use super::{Load, Opening, PolicyOverride};

/// A workload of which nothing is asked for this long gives nodes to others that need them.
const IDLE_AFTER: Duration = Duration::from_secs(10);

/// Sessions that share samples, and what the cluster does for them.
#[derive(Debug, Clone)]
pub(super) struct WorkloadState {
    /// Undegraded, with the cells' sample cameras where there are cells.
    pub(super) requested: Workload,
    /// Where sample cameras follow viewpoints.
    cells: Option<Cells>,
    /// Of the mean view of its sessions, as measured when they were opened.
    pub(super) costs: Costs,
    /// Its first session as it was opened: its exposure is that of views of all cells, moments and plans.
    pub(super) first: Arc<Opening>,
    pub(super) sessions: SessionMix,
    /// The choice of budgets, in place of the sessions' own.
    pub(super) representation: Option<Representation>,
    /// The promise that sessions know, and since when.
    pub(super) announced: Option<(Duration, Promise)>,
    /// How views in that representation are audited.
    pub(super) audit: Option<AuditOrder>,
    /// Why no plan can be made for their budget.
    pub(super) not_planned: Option<String>,
    /// The present fallback.
    pub(super) overload: Overload,
    /// The nodes that serve it.
    pub(super) nodes: BTreeSet<String>,
    /// Nodes that could not take a plan of it, and since when.
    pub(super) excluded: BTreeMap<String, Duration>,
    /// `None` while no node is there.
    pub(super) active_plan: Option<ActivePlan>,
    /// Times of each policy that has been in force.
    pub(super) achieved: Vec<AchievedTime>,
    /// The last time that something was asked of it.
    active_at: Duration,
    /// A node has taken a plan of it.
    has_been_ready: bool,
    /// Where live viewers are, as their compositors have said.
    live_viewpoints: BTreeMap<String, Vec<PinholeCamera>>,
    /// Viewers have moved, come or gone since cells were placed.
    pub(super) viewers_have_moved: bool,
}

/// The part of the demand that a plan follows at once.
#[derive(Debug, PartialEq)]
pub(super) struct PlanTrigger {
    pub(super) policy_override: PolicyOverride,
    pub(super) sample_cameras: Vec<SampleCamera>,
    fallback: usize,
}

impl WorkloadState {
    /// With its first session.
    pub(super) fn new(now: Duration, opening: &Opening) -> Self {
        let mut workload = Self {
            requested: opening.workload.clone(),
            cells: (!opening.viewpoints.is_empty()).then(|| Cells::of(&opening.workload)),
            costs: opening.costs,
            first: Arc::new(opening.clone()),
            sessions: SessionMix::default(),
            representation: None,
            announced: None,
            audit: None,
            not_planned: None,
            overload: Overload::default(),
            nodes: BTreeSet::new(),
            excluded: BTreeMap::new(),
            active_plan: None,
            achieved: Vec::new(),
            active_at: now,
            has_been_ready: false,
            live_viewpoints: BTreeMap::new(),
            viewers_have_moved: false,
        };
        workload.change(now, |sessions| sessions.add(opening));
        workload.update_cells();
        workload
    }

    /// As it would be with other sessions.
    pub(super) fn changed(&self, now: Duration, change: impl FnOnce(&mut SessionMix)) -> Self {
        let mut changed = self.clone();
        changed.change(now, change);
        changed.update_cells();
        changed
    }

    /// Changes the sessions, and all that follows from them but the cells, which follow when that is due.
    pub(super) fn change(&mut self, now: Duration, change: impl FnOnce(&mut SessionMix)) {
        change(&mut self.sessions);
        self.update_costs();
        self.overload.limit(now, self.sessions.fallbacks().len());
        self.note_movement(now);
    }

    fn update_costs(&mut self) {
        self.costs = self.represented(self.asked_costs());
    }

    /// The costs of what sessions ask for.
    pub(super) fn asked_costs(&self) -> Costs {
        self.sessions.costs(self.set_s()).unwrap_or(self.first.costs)
    }

    /// Costs of the representation in force, from those of what sessions asked for.
    fn represented(&self, asked: Costs) -> Costs {
        self.representation.as_ref().map_or(asked, |representation| representation.costs(&asked))
    }

    /// Puts a representation in force, in place of the one before.
    pub(super) fn represent(&mut self, representation: Representation) {
        self.representation = Some(representation);
        self.update_costs();
    }

    /// Decisions of sessions and of the representation.
    pub(super) fn policy_override(&self) -> PolicyOverride {
        let asked = self.sessions.policy_override();
        self.representation.as_ref().map_or(asked, |representation| representation.policy_override(asked))
    }

    /// The view cells that budgets are planned for: those that viewpoints may grow to, or the one between the sessions' own
    /// sample cameras.
    pub(super) fn planned_cells(&self) -> Vec<ViewCell> {
        match &self.cells {
            Some(cells) => cells.grown(),
            None => ViewCell::between(&SampleCamera::references(&self.requested.sample_cameras)).into_iter().collect(),
        }
    }

    /// The workload in the row in force.
    fn in_representation(&self) -> Workload {
        match (&self.representation, &self.first.budgeted) {
            (Some(Representation { row, planes, .. }), Some(budgeted)) => {
                Workload { planes: *planes, ..budgeted.in_row(row, &self.requested, &self.planned_cells()) }
            }
            _ => self.requested.clone(),
        }
    }

    pub(super) fn trigger(&self) -> PlanTrigger {
        PlanTrigger {
            policy_override: self.policy_override(),
            sample_cameras: self.requested.sample_cameras.clone(),
            fallback: self.overload.step,
        }
    }

    /// Whether a session asks for this workload, with a budget that can be planned for together; `follows_viewers`: its
    /// sample cameras are those of its viewpoints.
    pub(super) fn is_shared_by(&self, asked: &Workload, budgeted: Option<&Budgeted>, follows_viewers: bool) -> bool {
        if !self.shares_budget(budgeted) {
            return false;
        }
        let asked = self.with_planes(asked);
        match &self.cells {
            Some(cells) => follows_viewers && cells.are_shareable(&self.requested, &asked),
            None => !follows_viewers && self.requested == asked,
        }
    }

    fn shares_budget(&self, asked: Option<&Budgeted>) -> bool {
        match (&self.first.budgeted, asked) {
            (Some(own), Some(asked)) => own.is_shareable(asked),
            (own, asked) => own.is_none() && asked.is_none(),
        }
    }

    /// A workload whose images need no more planes than these is as good with these, however its surfaces are found.
    fn with_planes(&self, other: &Workload) -> Workload {
        let own = self.requested.planes;
        let planes = if own.contain(other.planes) { own } else { other.planes };
        Workload { planes, traced_pixel_count: self.requested.traced_pixel_count, ..other.clone() }
    }

    /// Where a compositor's live viewers are, in place of where they were.
    pub(super) fn set_live_viewpoints(&mut self, node: String, viewpoints: Vec<PinholeCamera>) {
        match viewpoints.is_empty() {
            true => self.live_viewpoints.remove(&node),
            false => self.live_viewpoints.insert(node, viewpoints),
        };
    }

    /// Viewers have moved, come or gone: cells follow when that is due.
    pub(super) fn note_movement(&mut self, now: Duration) {
        self.viewers_have_moved = true;
        self.note_activity(now);
    }

    /// Places cells around the viewpoints of sessions, and of live viewers on nodes that serve it.
    pub(super) fn update_cells(&mut self) {
        self.viewers_have_moved = false;
        self.live_viewpoints.retain(|node, _| self.nodes.contains(node));
        let Some(cells) = &mut self.cells else { return };
        let live: Vec<PinholeCamera> = self.live_viewpoints.values().flatten().copied().collect();
        cells.follow(&self.sessions.viewpoints(), &live, &self.requested.volume);
        cells.place_cameras(&mut self.requested);
    }

    /// The number of view cells, where sample cameras follow viewpoints.
    pub(super) fn cell_count(&self) -> Option<usize> {
        self.cells.as_ref().map(Cells::len)
    }

    /// Something was asked of it, or done for it.
    pub(super) fn note_activity(&mut self, now: Duration) {
        self.active_at = now;
    }

    /// Counts work of a node for the plan in force.
    pub(super) fn count_work(&mut self, now: Duration, name: &str, busy_s: f64, views: u64) {
        if busy_s > 0.0 || views > 0 {
            self.note_activity(now);
        }
        let views_per_set = self.load().views;
        let Some(active) = self.active_plan.as_mut().filter(|active| active.members.contains_key(name)) else { return };
        active.add_work(name, busy_s, views);
        if let Some(achieved) = active.achieved(views_per_set) {
            self.achieved.retain(|other| other.policy != achieved.policy);
            self.achieved.push(achieved);
        }
    }

    /// A node has taken a plan.
    pub(super) fn note_ready(&mut self, now: Duration) {
        if !std::mem::replace(&mut self.has_been_ready, true) {
            self.note_activity(now);
        }
    }

    /// Whether nothing has been asked of it for a while.
    pub(super) fn is_idle(&self, now: Duration) -> bool {
        self.has_been_ready && now.saturating_sub(self.active_at) >= IDLE_AFTER
    }

    /// Whether the views of a policy may differ from their truth: those drawn directly with all rays do not.
    pub(super) fn is_audited_under(&self, policy: Policy) -> bool {
        let is_direct_row =
            self.representation.as_ref().is_some_and(|representation| representation.method().is_none());
        (policy == Policy::Direct) == is_direct_row
    }

    pub(super) fn policy(&self) -> Option<Policy> {
        self.active_plan.as_ref().map(ActivePlan::policy)
    }

    /// Views a second of sessions with a rate.
    fn rated_views_per_s(&self) -> f64 {
        self.sessions.views_per_s() * self.frame_rate_ratio()
    }

    /// Scene time from set to set. That of a static scene is about a second, or longer where views are rare: its views are whole.
    fn set_s(&self) -> f64 {
        let timeline = &self.requested.timeline;
        let views_per_s = self.rated_views_per_s();
        match timeline.moves() {
            true => timeline.step_s.abs(),
            false if views_per_s > 0.0 => views_per_s.ceil() / views_per_s,
            false => 1.0,
        }
    }

    /// Views of a set: those of sessions with a rate while the set is shown, and those of the others at once.
    pub(super) fn load(&self) -> Load {
        self.load_with(self.sessions.views_at_once())
    }

    /// Images of a set.
    fn image_count(&self) -> usize {
        let asked = match self.quality() {
            None => self.requested.sample_cameras.len(),
            Some(_) => self.requested.view_camera_count(),
        };
        match self.representation.as_ref().map(|representation| &representation.row) {
            Some(Row::Samples { camera_count, .. }) => {
                *camera_count as usize * self.cells.as_ref().map_or(1, |cells| cells.grown().len())
            }
            _ => asked,
        }
    }

    /// The load of sessions with a rate alone.
    pub(super) fn rated_load(&self) -> Load {
        self.load_with(0)
    }

    fn load_with(&self, views_at_once: usize) -> Load {
        let timeline = &self.requested.timeline;
        let views_per_s = self.rated_views_per_s();
        let rated = if timeline.moves() { views_per_s * self.set_s() } else { views_per_s }.ceil() as usize;
        Load {
            images: self.image_count(),
            tiles: 1,
            cells: self.requested.view_cell_count(),
            common_cells: if self.quality().is_none() { self.requested.common_cells.len() } else { 0 },
            // A static scene is one set, though it be refined: the sampler keeps its sums.
            sets: if timeline.moves() { timeline.set_count as usize } else { 1 },
            views: views_at_once.saturating_add(rated),
            images_are_sequential: self.costs.in_order,
            is_already_sampled: !timeline.moves() && views_at_once == 0 && rated > 0,
        }
    }

    /// The share of the nodes' time that sessions with a rate take, where a set of their views takes `time_s`.
    pub(super) fn utilisation(&self, time_s: f64) -> f64 {
        if self.sessions.viewers() == 0 { 0.0 } else { time_s / self.set_s() }
    }

    /// The share of the nodes' time that sessions with a rate take at their last fallback, where a set of their views
    /// takes `time_s` now.
    pub(super) fn utilisation_at_last(&self, time_s: f64) -> f64 {
        let last = self.sessions.fallbacks().len();
        time_s / self.set_s() * self.load_ratio(last) / self.load_ratio(self.overload.step)
    }

    /// The share of the nodes' time at a fallback over that of views as they were asked for. Where the time of the last one is known,
    /// those between are taken to differ by equal ratios.
    fn load_ratio(&self, step: usize) -> f64 {
        let fallbacks = self.sessions.fallbacks();
        let rate_ratio = step.checked_sub(1).and_then(|at| fallbacks.get(at)).map_or(1.0, |q| q.frame_rate_ratio);
        rate_ratio * self.view_time_ratio(step)
    }

    /// The time of a view at a fallback over that of one as it was asked for.
    pub(super) fn view_time_ratio(&self, step: usize) -> f64 {
        let steps = self.sessions.fallbacks().iter().take_while(|quality| quality.frame_rate_ratio >= 1.0).count();
        self.first.last_view_time_ratio.powf(step.min(steps) as f64 / steps.max(1) as f64)
    }

    /// Begins at the first fallback that has room, where views as asked for would take this share of the nodes' time, and the time of
    /// others is known.
    pub(super) fn begin_with_room(&mut self, now: Duration, utilisation: f64) {
        if self.first.last_view_time_ratio >= 1.0 || self.sessions.viewers() == 0 {
            return;
        }
        let last = self.sessions.fallbacks().len();
        let step = (0..last).find(|&step| utilisation * self.load_ratio(step) <= FULL).unwrap_or(last);
        let view_utilisation = utilisation / self.sessions.views_per_s();
        let when_left = (0..step).map(|step| view_utilisation * self.view_time_ratio(step)).collect();
        self.overload.begin_at(now, step, when_left);
    }

    /// A node's costs of the views of sessions with a rate, from those of the mean view: batches may ask for larger ones.
    /// How many of these the node makes is not known, so that a cost lies between the timed one and the one alone.
    pub(super) fn of_viewers(&self, node: &Costs) -> Costs {
        let Some(rated) = self.sessions.rated_costs(self.set_s()).map(|asked| self.represented(asked)) else {
            return *node;
        };
        let node_s = operations(node);
        let rated_s = operations(&rated);
        let mean_s = operations(&self.costs);
        let [_, direct_view_s, reconstruct_view_s, _, encode_view_s] = array::from_fn(|i| {
            let ratio = rated_s[i] / mean_s[i];
            let is_mixed = ratio.is_finite() && rated_s[i] != mean_s[i];
            if !is_mixed {
                return node_s[i];
            }
            (node_s[i] * ratio).clamp(node_s[i].min(rated_s[i]), node_s[i].max(rated_s[i]))
        });
        Costs { direct_view_s, reconstruct_view_s, encode_view_s, ..*node }
    }

    /// Nodes that do nothing but serve sessions with a rate, at these mean costs. It does not depend on the policy in force,
    /// which depends on the number of nodes.
    pub(super) fn live_nodes(&self, mean: &Costs) -> f64 {
        let mean = &self.of_viewers(mean);
        let is_direct = self.policy_override().policy == PolicyChoice::Direct;
        let direct_s = mean.direct_view_s + mean.encode_view_s;
        let each_s = if is_direct { direct_s } else { direct_s.min(view_s(mean)) };
        let views_s = self.rated_views_per_s() * each_s;
        let samples = !is_direct && self.requested.timeline.moves() && views_s > 0.0;
        let set_s = self.image_count() as f64 * mean.sample_image_s + mean.load_set_s;
        views_s + if samples { set_s / self.set_s() } else { 0.0 }
    }

    /// A view by the policy in force, encoded.
    pub(super) fn view_s(&self, costs: &Costs) -> f64 {
        match self.policy() {
            Some(Policy::Direct) => costs.direct_view_s + costs.encode_view_s,
            Some(Policy::Pipeline | Policy::TimeShare) | None => view_s(costs),
        }
    }

    fn quality(&self) -> Option<&Quality> {
        self.sessions.fallbacks().get(self.overload.step.checked_sub(1)?)
    }

    /// Pictures a second over those asked for.
    pub(super) fn frame_rate_ratio(&self) -> f64 {
        self.quality().map_or(1.0, |quality| quality.frame_rate_ratio)
    }

    /// How the views of all sessions are reconstructed: under a fallback, and in a representation.
    pub(super) fn common_method(&self) -> Option<String> {
        let chosen = self.representation.as_ref().and_then(Representation::method);
        self.quality().map(|quality| &quality.method).or(chosen).cloned()
    }

    /// How views are reconstructed: those of all sessions, else those of most.
    pub(super) fn method(&self) -> String {
        self.common_method().unwrap_or_else(|| self.sessions.usual_method().unwrap_or_default().to_owned())
    }

    /// The workload in the representation in force, at the present fallback.
    pub(super) fn degraded(&self) -> Workload {
        let workload = self.in_representation();
        let Some(quality) = self.quality() else { return workload };
        let mut workload = workload.without_common_cells();
        for camera in &mut workload.sample_cameras {
            let size_px = (camera.size_px().as_dvec2() * quality.sample_side_ratio).round().as_uvec2();
            *camera = camera.resized(size_px.max(UVec2::ONE));
        }
        Workload { lighting: quality.lighting.clone(), ..workload }
    }
}
