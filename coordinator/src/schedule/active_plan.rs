//! The plan in force, and its progress.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use cluster::{AchievedTime, Assignment, Policy, SamplerReport, SessionPlan};

use super::hysteresis::PlanHysteresis;

/// A plan and the members it was made for. A plan that has lost a node is invalid.
#[derive(Debug, Clone)]
pub(super) struct ActivePlan {
    pub(super) plan: SessionPlan,
    /// Incarnations by name.
    pub(super) members: BTreeMap<String, u64>,
    pub(super) hysteresis: PlanHysteresis,
    /// Nodes that have taken the plan.
    pub(super) ready: BTreeSet<String>,
    /// Nodes that refuse the plan, and their reasons.
    pub(super) rejected: BTreeMap<String, String>,
    /// Samplers of which an image is being fetched to check it.
    pub(super) probed_samplers: BTreeSet<String>,
    /// Seconds that each node has worked for this plan.
    busy_s: BTreeMap<String, f64>,
    /// Views made by this plan.
    views: u64,
}

impl ActivePlan {
    pub(super) fn new(plan: SessionPlan, members: BTreeMap<String, u64>, now: Duration) -> Self {
        Self {
            plan,
            members,
            hysteresis: PlanHysteresis::starting_at(now),
            ready: BTreeSet::new(),
            rejected: BTreeMap::new(),
            probed_samplers: BTreeSet::new(),
            busy_s: BTreeMap::new(),
            views: 0,
        }
    }

    pub(super) fn epoch(&self) -> u64 {
        self.plan.assignment.plan_epoch
    }

    /// Whether another plan would change nothing: neither the roles of nodes nor the quality of views.
    pub(super) fn is_like(&self, other: &SessionPlan) -> bool {
        self.plan.fallback == other.fallback
            && self.plan.frame_rate_ratio.to_bits() == other.frame_rate_ratio.to_bits()
            && roles(&self.plan.assignment) == roles(&other.assignment)
    }

    pub(super) fn policy(&self) -> Policy {
        self.plan.assignment.policy
    }

    pub(super) fn samples(&self, node_name: &str) -> bool {
        self.plan.assignment.samplers.iter().any(|share| share.node_name == node_name)
    }

    pub(super) fn has_role(&self, node_name: &str) -> bool {
        self.samples(node_name) || self.plan.assignment.composites(node_name)
    }

    /// What the plan would lose with a node: nothing without a role, more with more views.
    pub(super) fn worth_of(&self, node_name: &str) -> f64 {
        let views = self.plan.assignment.compositors.iter().find(|share| share.node_name == node_name);
        let role = if self.has_role(node_name) { 1.0 } else { 0.0 };
        role + views.map_or(0.0, |share| f64::from(share.view_weight))
    }

    /// Whether both nodes have the reported roles in this plan.
    pub(super) fn concerns(&self, report: &SamplerReport) -> bool {
        self.epoch() == report.plan_epoch
            && self.plan.assignment.composites(&report.compositor)
            && self.samples(&report.sampler)
    }

    /// Counts work of a node for this plan.
    pub(super) fn add_work(&mut self, node_name: &str, busy_s: f64, views: u64) {
        *self.busy_s.entry(node_name.to_owned()).or_default() += busy_s;
        self.views = self.views.saturating_add(views);
    }

    /// Seconds of the busiest node for all views of a set, once a set's worth of views has been made.
    pub(super) fn achieved(&self, views_per_set: usize) -> Option<AchievedTime> {
        let busiest_s = self.busy_s.values().copied().fold(0.0, f64::max);
        let sets = self.views as f64 / views_per_set.max(1) as f64;
        (sets >= 1.0).then(|| AchievedTime { policy: self.policy(), busy_s: busiest_s / sets })
    }
}

/// The roles of all nodes. Weights of views follow every timing, and are no reason for a plan.
fn roles(plan: &Assignment) -> Assignment {
    let mut roles = Assignment { plan_epoch: 0, ..plan.clone() };
    roles.compositors.iter_mut().for_each(|share| share.view_weight = 0);
    roles
}
