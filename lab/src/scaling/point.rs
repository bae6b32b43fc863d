//! One measured point: V views of several sample sets, delivered by P nodes.

use cluster::{Policy, PolicyChoice, SessionPlan};
use render::Lighting;

use super::fetched::Fetched;
use super::machine::MachineTime;
use crate::cpu_share::Usage;
use crate::process::node_name;

/// Settings of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointSettings {
    pub lighting: Lighting,
    pub policy: PolicyChoice,
    pub views: usize,
    /// True where sample images stay whole; otherwise the schedule may tile them.
    pub whole_images: bool,
    /// The number of sets that time is taken over.
    pub counted_sets: u32,
}

/// Sets of a timeline after the last that counts: one that is being made by then, and those sampled ahead.
const SETS_BEHIND: u32 = 2;

impl PointSettings {
    /// The number of sets of the timeline; the first fills the pipeline.
    pub(super) fn sets(&self) -> u32 {
        1 + self.counted_sets + if self.policy == PolicyChoice::Direct { 0 } else { SETS_BEHIND }
    }

    /// The tiles that the session forces.
    #[must_use]
    pub fn forced_tiles(&self) -> Option<u32> {
        self.whole_images.then_some(1)
    }

    /// The number of views that are waited for.
    #[must_use]
    pub fn awaited_views(&self) -> usize {
        self.views * (1 + self.counted_sets as usize)
    }
}

/// Times of the steps of one set, summed over its images and views.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Steps {
    /// Seconds on samplers' devices.
    pub sample_s: f64,
    /// Seconds on compositors' devices.
    pub reconstruct_s: f64,
    /// Seconds of encoding frames, with waits for a processor.
    pub encode_s: f64,
    /// The client's processor time, with the system's for receiving.
    pub client_s: f64,
    pub frame_bytes: f64,
}

/// Processor time while the counted sets were made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Window {
    pub seconds: f64,
    pub nodes: Vec<Usage>,
    pub quota_cores: f64,
    pub machine: MachineTime,
}

/// One measured point.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    pub settings: PointSettings,
    pub nodes: usize,
    pub plan: SessionPlan,
    /// The number of plans that came while sets were made; each throws away samples taken ahead.
    pub later_plans: u64,
    /// The time between two sets, T.
    pub period_s: f64,
    /// The time from the request to the last view of the first set.
    pub fill_s: f64,
    pub steps: Steps,
    /// Processor time while the counted sets were made.
    pub window: Window,
    /// The images that a compositor fetches from a sampler, in the pipeline.
    pub fetched: Option<Fetched>,
}

impl Window {
    /// Processor time of all nodes together, in seconds of one core.
    #[must_use]
    pub fn nodes_s(&self) -> f64 {
        self.nodes.iter().map(|usage| usage.cpu_s).sum()
    }

    /// The share of the nodes' processor time that they used.
    #[must_use]
    pub fn used_share(&self) -> f64 {
        self.nodes_s() / (self.quota_cores * self.nodes.len() as f64 * self.seconds)
    }

    /// Cores that other programs used meanwhile.
    #[must_use]
    pub fn others_cores(&self) -> f64 {
        let own_s = self.nodes_s() + self.machine.client_s;
        ((self.machine.busy_s + self.machine.stolen_s - own_s) / self.seconds).max(0.0)
    }
}

impl Point {
    /// The policy of the plan.
    #[must_use]
    pub fn policy(&self) -> Policy {
        self.plan.assignment.policy
    }

    /// The number of samplers, K; 0 where nothing is sampled.
    #[must_use]
    pub fn samplers(&self) -> usize {
        self.plan.sampler_count()
    }

    /// The number of compositors: P − K, or P where every node makes views.
    #[must_use]
    pub fn compositors(&self) -> usize {
        self.plan.assignment.compositors.len()
    }

    /// The share of busy periods in which compositors that sample nothing used up their quota. Near 1, the quota is all
    /// that they wait for.
    #[must_use]
    pub fn throttled_share(&self) -> f64 {
        let assignment = &self.plan.assignment;
        let samples = |name: &str| assignment.samplers.iter().any(|share| share.node_name == name);
        let all_sample = assignment.compositors.iter().all(|share| samples(&share.node_name));
        let counts = |number: usize| all_sample || !samples(&node_name(number));
        let used = self.window.nodes.iter().enumerate().filter(|(number, _)| counts(*number));
        let (periods, throttled) = used.fold((0, 0), |sum, (_, node)| (sum.0 + node.periods, sum.1 + node.throttled));
        throttled as f64 / periods as f64
    }
}
