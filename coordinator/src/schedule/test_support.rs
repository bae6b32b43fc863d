//! Shared by tests: random numbers, costs, and events.

use std::time::Duration;

use cluster::{
    Costs, JoinCluster, NodeStatus, PolicyChoice, SamplePlanes, SceneHash, SceneRef, TileCosts, Timeline, Workload,
    WorkloadStatus,
};
use depth_image::{Aabb, Environment, ExposureEv, Illumination, PinholeCamera};
use glam::{UVec2, Vec3};

use super::command::Command;
use super::demand::PolicyOverride;
use super::event::{Event, Opening};
use super::node_costs::NodeCosts;
use super::scheduler::Scheduler;

/// A scheduler and its clock.
pub(super) struct Cluster {
    pub(super) scheduler: Scheduler,
    pub(super) now: Duration,
}

impl Cluster {
    /// Of nodes n0, n1, …, whose incarnations are their numbers.
    pub(super) fn of(nodes: u64) -> Self {
        let mut cluster = Self { scheduler: Scheduler::default(), now: Duration::ZERO };
        for i in 0..nodes {
            assert_eq!(cluster.step(join(&format!("n{i}"), i, 0)), []);
        }
        cluster
    }

    /// The commands but for probes, which are tested elsewhere.
    pub(super) fn step(&mut self, event: Event) -> Vec<Command> {
        let mut commands = self.scheduler.step(self.now, event);
        commands.retain(|command| !matches!(command, Command::Probe(_)));
        commands
    }

    pub(super) fn workloads(&self) -> Vec<WorkloadStatus> {
        self.scheduler.status().workloads
    }
}

/// Numbers from a seed (SplitMix64).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(super) fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    /// From 0 to 1.
    pub(super) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Evenly spread over the logarithm.
    pub(super) fn between(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf(self.unit())
    }
}

pub(super) const COSTS: Costs = Costs {
    sample_image_s: 0.1,
    direct_view_s: 0.1,
    reconstruct_view_s: 0.009,
    load_set_s: 0.005,
    encode_view_s: 0.001,
    in_order: false,
    tiles: None,
};

/// Expensive lighting, on images whose upper half shows the sky.
pub(super) const TILEABLE: Costs = Costs {
    sample_image_s: 5.0,
    tiles: Some(TileCosts { overhead_s: 0.5, row_shares: Some([0.05, 0.15, 0.4, 0.4]) }),
    reconstruct_view_s: 0.114,
    load_set_s: 0.19,
    ..COSTS
};

/// `count` equal nodes.
pub(super) fn nodes(count: usize, costs: Costs) -> Vec<NodeCosts> {
    vec![NodeCosts { costs, transfer_image_s: None }; count]
}

pub(super) fn join(name: &str, incarnation: u64, plan_epoch: u64) -> Event {
    let node = NodeStatus {
        node_name: name.to_owned(),
        address: format!("http://{name}:{incarnation}"),
        device_name: "cpu".to_owned(),
        is_software: true,
    };
    Event::Joined { incarnation, join: JoinCluster { node, plan_epoch } }
}

pub(crate) fn workload(images: usize) -> Workload {
    let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8));
    Workload {
        scene: SceneRef { hash: SceneHash::of(b""), package_bytes: 0 },
        sample_cameras: vec![camera.into(); images],
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: "conventional".to_owned(),
        lighting: "unlit".to_owned(),
        planes: SamplePlanes::default(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background: Environment::default(),
        timeline: Timeline::still(0.0),
        illumination: Illumination::default(),
        refinement_steps: 1,
        traced_pixel_count: None,
    }
}

/// From a circle around the scene.
pub(super) fn view(azimuth_rad: f32) -> PinholeCamera {
    let eye = Vec3::new(azimuth_rad.sin(), 0.3, azimuth_rad.cos()) * 4.0;
    PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(40, 30))
}

pub(super) fn opening(session: u64, policy: PolicyChoice, views_per_set: usize) -> Opening {
    Opening {
        session,
        workload: workload(4),
        method: "joint_carve".to_owned(),
        views_per_set,
        frames_per_s: None,
        policy_override: PolicyOverride { policy, ..PolicyOverride::default() },
        fallbacks: Vec::new(),
        viewpoints: Vec::new(),
        costs: COSTS,
        auto_exposure: ExposureEv::ZERO,
        last_view_time_ratio: 1.0,
        shared_light: None,
        note: String::new(),
        budgeted: None,
    }
}

pub(super) fn opened(session: u64, policy: PolicyChoice, views_per_set: usize) -> Event {
    Event::Opened(Box::new(opening(session, policy, views_per_set)))
}
