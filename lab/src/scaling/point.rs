//! One measured point: V views of several sample sets, delivered by P nodes.

use cluster::{Policy, PolicyChoice, SessionPlan};

use super::fetched::Fetched;
use super::machine::MachineTime;

/// Sets of a timeline after the last that counts: one that is being made by then, and those sampled ahead.
const SETS_BEHIND: u32 = 2;

/// Settings of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointSettings {
    pub policy: PolicyChoice,
    pub views: usize,
    /// The number of sets that time is taken over.
    pub counted_sets: u32,
}

/// Processor time while the counted sets were made, in seconds of one core.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Window {
    pub seconds: f64,
    pub nodes_s: f64,
    /// The time that the nodes' quotas allow.
    pub quotas_s: f64,
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
    /// Bytes of a frame, in the mean.
    pub frame_bytes: f64,
    pub window: Window,
    /// The images that a compositor fetches from a sampler, in the pipeline.
    pub fetched: Option<Fetched>,
}

impl PointSettings {
    /// The number of sets of the timeline; the first fills the pipeline.
    pub(super) fn sets(&self) -> u32 {
        1 + self.counted_sets + if self.policy == PolicyChoice::Direct { 0 } else { SETS_BEHIND }
    }

    /// The number of views that are waited for.
    pub fn awaited_views(&self) -> usize {
        self.views * (1 + self.counted_sets as usize)
    }
}

impl Window {
    /// The share of the nodes' quotas that they used.
    pub fn used_share(&self) -> f64 {
        self.nodes_s / self.quotas_s
    }

    /// Cores that other programs used meanwhile.
    pub fn others_cores(&self) -> f64 {
        let own_s = self.nodes_s + self.machine.client_s;
        ((self.machine.busy_s + self.machine.stolen_s - own_s) / self.seconds).max(0.0)
    }
}

impl Point {
    /// The policy of the plan.
    pub fn policy(&self) -> Policy {
        self.plan.assignment.policy
    }

    /// The number of samplers, K; 0 where nothing is sampled.
    pub fn samplers(&self) -> usize {
        self.plan.sampler_count()
    }
}
