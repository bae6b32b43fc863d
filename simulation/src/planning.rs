//! The real schedule, with the events that a coordinator would hand it.

use std::time::Duration;

use cluster::{
    Assignment, Costs, JoinCluster, NodeStatus, PolicyChoice, SamplePlanes, SceneHash, SceneRef, SessionPlan, Timeline,
    Workload,
};
use coordinator::schedule::{Command, Event, MeasuredCosts, Opening, PolicyOverride, Scheduler};
use depth_image::{Aabb, Environment, ExposureEv, Illumination, PinholeCamera};
use glam::{UVec2, Vec3};

use crate::cluster::{Cluster, Machine};

/// Between two ticks, as the coordinator's.
const TICK: Duration = Duration::from_millis(250);
/// A plan that has not changed for this many ticks, longer than any dwell, is stable.
const STABLE_TICKS: usize = 40;
/// A plan is taken as it is after this many: ten simulated minutes.
const MOST_TICKS: usize = 2400;
/// Timings of each kind that a node reports: the schedule's moving average is then within a thousandth of them.
const REPORTS: usize = 32;

/// The demand of one session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// V.
    pub views: usize,
    /// Sample sets, all different.
    pub sets: u32,
    /// The policy, or that the schedule decides.
    pub policy: PolicyChoice,
    /// Tiles of an image; `None`: the schedule decides.
    pub tiles: Option<usize>,
    /// Whether nodes report their own costs and bytes. Otherwise all count as the slowest, and links as free: a coordinator
    /// knows no more when a session is opened.
    pub nodes_report: bool,
}

/// A schedule and its last commands.
#[derive(Default)]
struct Coordinator {
    scheduler: Scheduler,
    now: Duration,
    plan: Option<SessionPlan>,
    is_refused: bool,
}

/// The stable plan of the schedule; `None` where the schedule refuses the session.
#[must_use]
pub fn plan(cluster: &Cluster, demand: &Demand) -> Option<SessionPlan> {
    let mut coordinator = Coordinator::default();
    for (number, _) in cluster.machines.iter().enumerate() {
        coordinator.tell(joined(&name(number), number as u64 + 1, 0));
    }
    coordinator.tell(open(cluster, demand));
    if demand.nodes_report {
        (0..REPORTS).for_each(|_| coordinator.report_costs(cluster));
    }
    coordinator.wait_until_stable();
    coordinator.plan.filter(|_| !coordinator.is_refused)
}

impl Coordinator {
    fn tell(&mut self, event: Event) {
        for command in self.scheduler.step(self.now, event) {
            match command {
                Command::Apply { plan, .. } => self.apply(*plan),
                Command::Refuse { .. } => self.is_refused = true,
                // Sessions here have no budget, and nodes no faults.
                Command::ProbeViews(_)
                | Command::Promise { .. }
                | Command::Probe(_)
                | Command::Quarantine { .. }
                | Command::Readmit { .. } => (),
            }
        }
    }

    /// Nodes are ready at once.
    fn apply(&mut self, plan: SessionPlan) {
        let plan_epoch = plan.assignment.plan_epoch;
        let names = node_names(&plan.assignment);
        self.plan = Some(plan);
        names.into_iter().for_each(|node_name| self.tell(Event::Ready { plan_epoch, node_name }));
    }

    fn report_costs(&mut self, cluster: &Cluster) {
        for (number, machine) in cluster.machines.iter().enumerate() {
            self.tell(Event::Measured {
                node_name: name(number),
                plan_epoch: self.epoch().unwrap_or(0),
                costs: timings(machine, cluster.image_bytes),
                busy_s: 0.0,
                views: 0,
                dropped_views: 0,
            });
        }
    }

    fn wait_until_stable(&mut self) {
        let mut stable_ticks = 0;
        for _ in 0..MOST_TICKS {
            self.now += TICK;
            let before = self.epoch();
            self.tell(Event::Tick);
            stable_ticks = if self.epoch() == before { stable_ticks + 1 } else { 0 };
            if stable_ticks >= STABLE_TICKS {
                return;
            }
        }
    }

    fn epoch(&self) -> Option<u64> {
        self.plan.as_ref().map(|plan| plan.assignment.plan_epoch)
    }
}

/// The name of a node. Digits are padded, as the schedule lists nodes by name.
fn name(number: usize) -> String {
    format!("node-{number:04}")
}

/// The number in a node's name.
pub(crate) fn number_of(name: &str) -> Option<usize> {
    name.strip_prefix("node-")?.parse().ok()
}

fn node_names(assignment: &Assignment) -> Vec<String> {
    let samplers = assignment.samplers.iter().map(|share| share.node_name.clone());
    let mut names: Vec<String> =
        samplers.chain(assignment.compositors.iter().map(|share| share.node_name.clone())).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// A process of a node joins, which has seen plans up to an epoch.
pub(crate) fn joined(node_name: &str, incarnation: u64, plan_epoch: u64) -> Event {
    let address = format!("http://{node_name}:{incarnation}");
    let node =
        NodeStatus { node_name: node_name.to_owned(), address, device_name: "simulated".to_owned(), is_software: true };
    Event::Joined { incarnation, join: JoinCluster { node, plan_epoch } }
}

fn open(cluster: &Cluster, demand: &Demand) -> Event {
    let slowest = cluster.machines.iter().fold(Costs::default(), |slowest, machine| slowest.max(machine.costs));
    Event::Opened(Box::new(Opening {
        views_per_set: demand.views,
        policy_override: PolicyOverride { policy: demand.policy, forced_samplers: None, forced_tiles: demand.tiles },
        ..opening(1, cluster.images, demand.sets, slowest)
    }))
}

/// A session that asks for one view a set.
pub(crate) fn opening(session: u64, images: usize, sets: u32, costs: Costs) -> Opening {
    Opening {
        session,
        workload: workload(images, sets),
        method: "simulated".to_owned(),
        views_per_set: 1,
        policy_override: PolicyOverride::default(),
        frames_per_s: None,
        fallbacks: Vec::new(),
        viewpoints: Vec::new(),
        costs,
        auto_exposure: ExposureEv::ZERO,
        last_view_time_ratio: 1.0,
        shared_light: None,
        note: String::new(),
        budgeted: None,
    }
}

fn timings(machine: &Machine, image_bytes: f64) -> MeasuredCosts {
    let costs = machine.costs;
    MeasuredCosts {
        sample_image_s: Some(costs.sample_image_s),
        direct_view_s: Some(costs.direct_view_s),
        reconstruct_view_s: Some(costs.reconstruct_view_s),
        load_set_s: Some(costs.load_set_s),
        encode_view_s: Some(costs.encode_view_s),
        transfer_bytes_per_s: Some(machine.bytes_per_s).filter(|rate| rate.is_finite()),
        image_bytes: Some(image_bytes),
    }
}

/// The schedule uses only the number of images and sets of a workload.
fn workload(images: usize, sets: u32) -> Workload {
    let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8));
    Workload {
        scene: SceneRef { hash: SceneHash::of(b""), package_bytes: 0 },
        sample_cameras: vec![camera.into(); images],
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: String::new(),
        lighting: String::new(),
        planes: SamplePlanes::default(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background: Environment::default(),
        timeline: Timeline { start_s: 0.0, step_s: 1.0, set_count: sets },
        illumination: Illumination::default(),
        refinement_steps: 1,
        traced_pixel_count: None,
    }
}
