//! The plan for a workload's budget: what is measured for it, and what it may cost.

use std::time::Duration;

use cluster::{BudgetMeasurement, InvalidField, MeasureCosts, SceneHash, Workload};
use depth_image::{PinholeCamera, ViewCell, ViewPlanes};
use glam::{DVec3, Vec3};
use planner::{
    Budget, Choice, Command as PlannerCommand, Event as PlannerEvent, Kept, KeptKey, Outcome, PlanRequest, Planner,
    ProbeId, ProbeView, Purpose, Row, most_certified,
};

use super::budgeted::Budgeted;
use super::chosen::{Certified, Chosen};
use super::prices::{EqualNodes, STILL_SET_S};
use super::workload_state::WorkloadState;

/// Measuring for a plan may take this long, or as long as these numbers of directly drawn views and of sets.
const LEAST_ALLOWANCE_S: f64 = 30.0;
const ALLOWED_VIEWS: f64 = 100.0;
const ALLOWED_SETS: f64 = 12.0;
/// The share of the nodes' time that measuring may take beyond.
const ALLOWED_SHARE: f64 = 0.05;
/// A measurement is asked for again after this pause, and fails after this number of lost nodes.
const PAUSE: Duration = Duration::from_secs(1);
const MOST_LOST: u32 = 5;
/// Views of one measured call: as in a batch of real work, since fewer views cost more each. A slow device must not
/// take minutes.
pub(crate) const MEASURED_BATCH: u32 = 32;

/// A plan that is made or was made.
#[derive(Debug, Clone)]
pub(super) struct BudgetPlan {
    /// No two plans have the same.
    pub(super) number: u64,
    pub(super) budget: Budget,
    /// The device that measures.
    pub(super) device_name: String,
    pub(super) prices: EqualNodes,
    pub(super) began: Duration,
    /// The result, once there is one.
    pub(super) outcome: Option<Outcome>,
    pub(super) budgeted: Budgeted,
    /// The workload as sessions ask for it, the cells that are planned for, and V of all sessions.
    workload: Workload,
    cells: Vec<ViewCell>,
    /// Audited viewpoints: every other view is at one of them, where there are any.
    poses: Vec<PinholeCamera>,
    views_per_set: usize,
    planner: Planner<EqualNodes>,
    allowance_s: f64,
    /// The measurement that is wanted.
    asked: Option<PlannerCommand>,
    not_before: Duration,
    lost: u32,
    /// A row failed since nodes were lost.
    has_lost_rows: bool,
}

/// Measurements that one node is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewProbe {
    /// The workload.
    pub workload_number: u64,
    /// The measurement.
    pub id: ProbeId,
    /// The node that measures.
    pub node_name: String,
    /// Where the node is reached.
    pub address: String,
    /// Views that are compared, in the order of the request; none where rows are only timed.
    pub views: Vec<ProbeView>,
    /// Each row's place in the ladder, and its request. They are timed in turn.
    pub requests: Vec<(usize, MeasureCosts)>,
    /// How often they are timed.
    pub repeats: usize,
}

impl BudgetPlan {
    /// A plan that waits for the measurements of earlier plans.
    pub(super) fn begin(
        now: Duration,
        number: u64,
        workload: &WorkloadState,
        budget: Budget,
        device_name: &str,
        poses: Vec<PinholeCamera>,
    ) -> Result<Self, InvalidField> {
        let budgeted = workload.first.budgeted.clone().ok_or(InvalidField::Missing { field: "budget" })?;
        let cells = workload.planned_cells();
        if cells.is_empty() {
            return Err(InvalidField::Missing { field: "viewpoints" });
        }
        let allowance_s = allowance_s(workload);
        let prices = prices(workload);
        let is_traced = budgeted.screening_lighting != workload.requested.lighting;
        let request = PlanRequest {
            plan: number,
            budget,
            key: key(&budgeted, &workload.requested, &cells, &poses),
            device: planner::device_name(device_name),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            pricing: format!("{} nodes, {} views a set", prices.nodes, prices.views_a_set),
            allowance_s,
            most_certified: most_certified(is_traced),
            seed: 0,
        };
        let planner = Planner::new(request, budgeted.ladder()?, prices)
            .map_err(|error| InvalidField::out_of_range("budget", error, "a plan"))?;
        Ok(Self {
            number,
            budget,
            device_name: device_name.to_owned(),
            prices,
            began: now,
            outcome: None,
            budgeted,
            workload: workload.requested.clone(),
            cells,
            poses,
            views_per_set: workload.sessions.views(),
            planner,
            allowance_s,
            asked: None,
            not_before: now,
            lost: 0,
            has_lost_rows: false,
        })
    }

    pub(super) fn key(&self) -> KeptKey {
        key(&self.budgeted, &self.workload, &self.cells, &self.poses)
    }

    /// The knowledge so far, in words.
    pub(super) fn reason(&self) -> String {
        self.outcome.as_ref().map_or_else(|| self.planner.outcome().reason, |outcome| outcome.reason.clone())
    }

    /// The choice of the plan, once it is made, with the safer ones that it has certified.
    pub(super) fn chosen(&self) -> Option<Chosen> {
        let outcome = self.outcome.clone()?;
        let row = self.row(outcome.choice).cloned();
        let certified = self.planner.certified().into_iter().filter_map(|(choice, price, certificate)| {
            Some(Certified { row: self.row(choice)?.clone(), choice, price, certificate })
        });
        Some(Chosen { number: self.number, budget: self.budget, row, outcome, certified: certified.collect() })
    }

    /// The shortest side of a view cell that has one, in m; 0 for a cell that is a point.
    pub(super) fn cell_side_m(&self) -> f32 {
        let sides_m = self.cells.iter().flat_map(|cell| {
            let corners = cell.nested_cameras(4, self.budgeted.whole_px);
            [(0, 2), (0, 3)].map(|(a, b)| corners[a].eye_in_world.distance(corners[b].eye_in_world))
        });
        let least_m = sides_m.filter(|side_m| *side_m > 0.0).fold(f32::INFINITY, f32::min);
        if least_m.is_finite() { least_m } else { 0.0 }
    }

    fn row(&self, choice: Choice) -> Option<&Row> {
        match choice {
            Choice::Row(row) => self.budgeted.rows.get(row),
            Choice::Direct => None,
        }
    }

    /// The measurements of a plan that is not made yet: they would be lost otherwise.
    pub(super) fn unfinished(&self) -> Option<Kept> {
        let has_measured = self.outcome.is_none() && self.planner.spent_s() > 0.0;
        has_measured.then(|| self.planner.measured())
    }

    /// Takes an event. Gives what was measured, to be kept, where the plan is made by it. Answers that nobody waits for
    /// change nothing, and impossible ones are failures.
    pub(super) fn take(&mut self, event: PlannerEvent) -> Option<Box<Kept>> {
        let answered = answered(&event).map(|(id, _)| id);
        if answered.is_some() && answered != self.asked.as_ref().and_then(asked_id) {
            return None;
        }
        // Measurements that a plan before this one asked for.
        if matches!(&event, PlannerEvent::Remembered(kept) if kept.key != self.key()) {
            return None;
        }
        self.lost = 0;
        let mut commands = self.planner.step(event);
        if let [PlannerCommand::Refuse(error)] = &commands[..] {
            let reason = error.to_string();
            commands = match answered {
                Some(id) => self.planner.step(PlannerEvent::Failed { id, reason, busy_s: 0.0 }),
                None => self.planner.step(PlannerEvent::Remembered(Kept::empty(self.key()))),
            };
        }
        self.follow(commands)
    }

    fn follow(&mut self, commands: Vec<PlannerCommand>) -> Option<Box<Kept>> {
        let mut measured = None;
        for command in commands {
            match command {
                PlannerCommand::Probe { .. } | PlannerCommand::Time { .. } => self.asked = Some(command),
                PlannerCommand::Keep(kept) => measured = Some(kept),
                PlannerCommand::Conclude(outcome) => (self.asked, self.outcome) = (None, Some(*outcome)),
                PlannerCommand::Refuse(_) => (),
            }
        }
        measured
    }

    /// A node was lost while it measured. The measurement fails where that happens again and again.
    pub(super) fn lose(&mut self, now: Duration, id: ProbeId, reason: String) -> Option<Box<Kept>> {
        if self.asked.as_ref().and_then(asked_id) != Some(id) {
            return None;
        }
        self.lost += 1;
        if self.lost < MOST_LOST {
            self.not_before = now + PAUSE;
            return None;
        }
        self.has_lost_rows = true;
        self.take(PlannerEvent::Failed { id, reason, busy_s: 0.0 })
    }

    /// Whether another plan would find the same: all was measured that had to be.
    pub(super) fn is_final(&self) -> bool {
        !self.planner.is_spent() && !self.has_lost_rows
    }

    /// Raises what measuring may take, with time.
    pub(super) fn allow(&mut self, now: Duration, plans: usize) -> Option<Box<Kept>> {
        let since_s = now.saturating_sub(self.began).as_secs_f64();
        let of_time_s = ALLOWED_SHARE * self.prices.nodes as f64 * since_s / plans.max(1) as f64;
        let commands = self.planner.step(PlannerEvent::Allowed { allowance_s: self.allowance_s + of_time_s });
        self.follow(commands)
    }

    /// Whether a node is to be asked now.
    pub(super) fn is_due(&self, now: Duration) -> bool {
        self.asked.is_some() && now >= self.not_before
    }

    /// The measurement that is wanted, as a node is asked for it.
    pub(super) fn probe(&self, workload_number: u64, node_name: &str, address: &str) -> Option<ViewProbe> {
        let node_name = node_name.to_owned();
        let address = address.to_owned();
        Some(match self.asked.as_ref()? {
            PlannerCommand::Probe { id, row, views, purpose } => {
                let light = match purpose {
                    Purpose::Screening => &self.budgeted.screening_lighting,
                    Purpose::Certification => &self.workload.lighting,
                };
                let requests = vec![(*row, self.request(*row, views, Some(light))?)];
                let id = *id;
                let views = views.clone();
                ViewProbe { workload_number, id, node_name, address, views, requests, repeats: 1 }
            }
            PlannerCommand::Time { id, rows, view_count, repeats } => {
                let views: Vec<ProbeView> = (0..*view_count as u32).map(ProbeView::Screening).collect();
                let requests = rows.iter().map(|&row| Some((row, self.request(row, &views, None)?)));
                let requests = requests.collect::<Option<Vec<_>>>()?;
                let id = *id;
                let views = Vec::new();
                let repeats = *repeats;
                ViewProbe { workload_number, id, node_name, address, views, requests, repeats }
            }
            PlannerCommand::Keep(_) | PlannerCommand::Conclude(_) | PlannerCommand::Refuse(_) => return None,
        })
    }

    fn request(&self, row: usize, views: &[ProbeView], compared: Option<&String>) -> Option<MeasureCosts> {
        let row = self.budgeted.rows.get(row)?;
        let budget = BudgetMeasurement { compared_lighting: compared.cloned() };
        let workload = self.budgeted.sampled_as(row, &self.workload, &self.cells);
        let typical_views = views.iter().map(|&view| self.camera(view)).collect();
        Some(MeasureCosts { budget: Some(budget), typical_views, ..self.measurement_of(row, workload) })
    }

    /// The camera of a view: one of a cell or, every other time, one of the audited viewpoints.
    fn camera(&self, view: ProbeView) -> PinholeCamera {
        let number = match view {
            ProbeView::Screening(number) => u64::from(number),
            ProbeView::Fresh(number) => number,
        };
        let poses = self.poses.len();
        if poses == 0 {
            return self.camera_in_cell(view);
        }
        if number % 2 == 0 {
            return self.camera_in_cell(match view {
                ProbeView::Screening(number) => ProbeView::Screening(number / 2),
                ProbeView::Fresh(number) => ProbeView::Fresh(number / 2),
            });
        }
        let view = match view {
            // Every second number of the sequence would be in one half of the places.
            ProbeView::Screening(number) => ProbeView::Screening(number / 2),
            fresh => fresh,
        };
        let place = (view.place(0)[0] * poses as f64) as usize;
        self.poses[place.min(poses - 1)].resized(self.budgeted.typical_view.size_px)
    }

    /// The camera of a view in a cell: all cells are equally likely, and all places of a cell.
    fn camera_in_cell(&self, view: ProbeView) -> PinholeCamera {
        let cells = self.cells.len() as u64;
        // Common places are even within each cell.
        let (number, placed) = match view {
            ProbeView::Screening(number) => {
                (u64::from(number), ProbeView::Screening((u64::from(number) / cells) as u32))
            }
            ProbeView::Fresh(number) => (number, view),
        };
        let cell = &self.cells[(number % cells) as usize];
        let place: Vec3 = (DVec3::from_array(placed.place(0)) * 2.0 - 1.0).as_vec3();
        cell.view_at(place, &self.budgeted.typical_view)
    }

    /// The measurement before a row is in force: its costs alone, tiles included.
    pub(super) fn measurement(&self, row: &Row) -> MeasureCosts {
        let workload = self.budgeted.sampled_as(row, &self.workload, &self.cells);
        self.measurement_of(row, workload.of_cell(0).unwrap_or(workload))
    }

    fn measurement_of(&self, row: &Row, workload: Workload) -> MeasureCosts {
        MeasureCosts {
            workload,
            method: row.method.clone(),
            codec: self.budgeted.codec.clone(),
            typical_views: vec![self.budgeted.typical_view],
            batch_count: (self.views_per_set as u32).clamp(1, MEASURED_BATCH),
            planes: ViewPlanes { antialias: self.budgeted.antialias(), ..ViewPlanes::COLOR },
            in_background: true,
            budget: None,
        }
    }
}

/// The nodes' time that measuring for a workload may take at once, in s.
fn allowance_s(workload: &WorkloadState) -> f64 {
    let costs = &workload.costs;
    let images = workload.requested.sample_cameras.len() as f64;
    let needed_s = ALLOWED_VIEWS * costs.direct_view_s + ALLOWED_SETS * images * costs.sample_image_s;
    needed_s.max(LEAST_ALLOWANCE_S)
}

/// Prices on the nodes that serve a workload.
pub(super) fn prices(workload: &WorkloadState) -> EqualNodes {
    let load = workload.load();
    let costs = &workload.costs;
    let shown = (workload.sessions.views_per_s() * STILL_SET_S) as usize;
    let is_still = !workload.requested.timeline.moves();
    let views_a_set = if is_still { workload.sessions.views_at_once() + shown } else { load.views };
    let may_draw = workload.sessions.policy_override().may_draw_directly();
    EqualNodes {
        nodes: workload.nodes.len().max(1),
        cells: workload.requested.cell_count(),
        views_a_set: views_a_set.max(1),
        direct_view_s: may_draw.then_some(costs.direct_view_s),
        encode_view_s: costs.encode_view_s,
    }
}

fn asked_id(command: &PlannerCommand) -> Option<ProbeId> {
    match command {
        PlannerCommand::Probe { id, .. } | PlannerCommand::Time { id, .. } => Some(*id),
        PlannerCommand::Keep(_) | PlannerCommand::Conclude(_) | PlannerCommand::Refuse(_) => None,
    }
}

/// The measurement that an event answers, and the node's time.
pub(super) fn answered(event: &PlannerEvent) -> Option<(ProbeId, f64)> {
    match event {
        PlannerEvent::Probed(probed) => Some((probed.id, probed.busy_s)),
        PlannerEvent::Timed(timed) => Some((timed.id, timed.busy_s)),
        PlannerEvent::Failed { id, busy_s, .. } => Some((*id, *busy_s)),
        PlannerEvent::Remembered(_) | PlannerEvent::Allowed { .. } => None,
    }
}

/// The name of the measurements that a plan may use.
fn key(budgeted: &Budgeted, workload: &Workload, cells: &[ViewCell], poses: &[PinholeCamera]) -> KeptKey {
    let Budgeted { rows, whole_px, keeps_cameras, typical_view, antialias_samples, screening_lighting, .. } = budgeted;
    let light = format!(
        "{}; screened in {screening_lighting}; at {} s; {:?}; {:?}",
        workload.lighting, workload.timeline.start_s, workload.illumination, workload.background
    );
    let audited = if poses.is_empty() { String::new() } else { format!(" {poses:?}") };
    let cameras = keeps_cameras.then_some(&workload.sample_cameras);
    let [width_px, height_px] = typical_view.size_px.to_array();
    KeptKey {
        scene: workload.scene.hash.to_string(),
        cell: hashed(&format!("{cells:?} {:?} {:?}{audited}", typical_view.focal_px, workload.volume)),
        lighting: hashed(&light),
        view_size: format!("{width_px}x{height_px}, {antialias_samples} samples a pixel"),
        ladder_version: hashed(&format!("{rows:?} {whole_px} {cameras:?}")),
    }
}

fn hashed(text: &str) -> String {
    SceneHash::of(text.as_bytes()).to_string()
}
