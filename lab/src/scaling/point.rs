//! One measured point: V views of several sample sets, delivered by P nodes.

use render::Lighting;
use wire::{Policy, PolicyChoice, SessionPlan};

use super::fetched::Fetched;
use super::machine::MachineTime;
use super::processes::NodeProcesses;
use crate::cpu_share::Usage;

/// What is asked of the cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointSettings {
    /// How surfaces are lit.
    pub lighting: Lighting,
    /// Who decides.
    pub policy: PolicyChoice,
    /// V.
    pub views: usize,
    /// Whether sample images stay whole; else the schedule may cut them into tiles.
    pub whole_images: bool,
    /// Sets between which time is taken.
    pub counted_sets: u32,
}

/// Sets of a timeline that follow the last that counts: one that is being made by then, and what is sampled ahead.
const SETS_BEHIND: u32 = 2;

impl PointSettings {
    /// Sets that can be asked for: the first fills.
    pub(super) fn sets(&self) -> u32 {
        1 + self.counted_sets + if self.policy == PolicyChoice::Direct { 0 } else { SETS_BEHIND }
    }

    /// What the session session_settings.
    #[must_use]
    pub fn forced_tiles(&self) -> Option<u32> {
        self.whole_images.then_some(1)
    }

    /// Views that are waited for.
    #[must_use]
    pub fn awaited_views(&self) -> usize {
        self.views * (1 + self.counted_sets as usize)
    }
}

/// What one set takes, summed over its images and views.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Steps {
    /// On samplers' devices.
    pub sample_s: f64,
    /// On compositors' devices.
    pub reconstruct_s: f64,
    /// Encoding frames, waiting for a processor included.
    pub encode_s: f64,
    /// The client's processor time, the system's for receiving included.
    pub client_s: f64,
    /// Bytes of frames.
    pub frame_bytes: f64,
}

/// While the counted sets were made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Window {
    /// Of the wall clock.
    pub seconds: f64,
    /// Of each node.
    pub nodes: Vec<Usage>,
    /// What each had.
    pub quota_cores: f64,
    /// Of all.
    pub machine: MachineTime,
}

/// One measured point.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// What was asked.
    pub settings: PointSettings,
    /// P.
    pub nodes: usize,
    /// What the coordinator decided.
    pub plan: SessionPlan,
    /// Plans that came while sets were made: each throws away what was sampled ahead.
    pub later_plans: u64,
    /// T.
    pub period_s: f64,
    /// From the request to the last view of the first set.
    pub fill_s: f64,
    /// Of one set.
    pub steps: Steps,
    /// While the counted sets were made.
    pub window: Window,
    /// What a compositor gets from a sampler, in the pipeline.
    pub fetched: Option<Fetched>,
}

impl Window {
    /// Processor time of all nodes together, in seconds of one core.
    #[must_use]
    pub fn nodes_s(&self) -> f64 {
        self.nodes.iter().map(|usage| usage.cpu_s).sum()
    }

    /// Of the processor time that all nodes had.
    #[must_use]
    pub fn used_share(&self) -> f64 {
        self.nodes_s() / (self.quota_cores * self.nodes.len() as f64 * self.seconds)
    }

    /// Cores that programs had which have nothing to do with this.
    #[must_use]
    pub fn others_cores(&self) -> f64 {
        let own_s = self.nodes_s() + self.machine.client_s;
        ((self.machine.busy_s + self.machine.stolen_s - own_s) / self.seconds).max(0.0)
    }
}

impl Point {
    /// How the views came about.
    #[must_use]
    pub fn policy(&self) -> Policy {
        self.plan.assignment.policy
    }

    /// K; 0 where nothing is sampled.
    #[must_use]
    pub fn samplers(&self) -> usize {
        self.plan.sampler_count()
    }

    /// P − K, or P where every node makes views.
    #[must_use]
    pub fn compositors(&self) -> usize {
        self.plan.assignment.compositors.len()
    }

    /// Of the periods in which nodes that make views and sample nothing had something to do, the share in which they
    /// used up their quota. Near 1 it is the quota that they wait for, and nothing else.
    #[must_use]
    pub fn throttled_share(&self) -> f64 {
        let assignment = &self.plan.assignment;
        let samples = |name: &str| assignment.samplers.iter().any(|share| share.node_name == name);
        let all_sample = assignment.compositors.iter().all(|share| samples(&share.node_name));
        let counts = |number: usize| all_sample || !samples(&NodeProcesses::name_of(number));
        let used = self.window.nodes.iter().enumerate().filter(|(number, _)| counts(*number));
        let (periods, throttled) = used.fold((0, 0), |sum, (_, node)| (sum.0 + node.periods, sum.1 + node.throttled));
        throttled as f64 / periods as f64
    }
}
