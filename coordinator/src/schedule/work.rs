//! What sessions ask for together, and the plan that serves them.

use std::collections::BTreeMap;
use std::time::Duration;

use wire::{Assignment, Costs, Policy, SessionPlan, Workload};

use super::patience::Patience;
use super::{Load, Opening, Wish};

/// One session's part.
#[derive(Debug, Clone)]
struct Session {
    number: u64,
    views: usize,
    wish: Wish,
}

/// Sessions of one workload.
#[derive(Debug, Clone)]
pub(super) struct Work {
    pub(super) workload: Workload,
    /// As measured when it was first opened.
    pub(super) costs: Costs,
    /// In the order they were opened.
    sessions: Vec<Session>,
    /// `None` while no node is there.
    pub(super) in_force: Option<InForce>,
}

/// A plan and the members it was made for.
#[derive(Debug, Clone)]
pub(super) struct InForce {
    pub(super) plan: SessionPlan,
    /// Incarnations by name.
    pub(super) members: BTreeMap<String, u64>,
    pub(super) patience: Patience,
}

/// What a workload asks of a cluster.
pub(super) fn load_of(workload: &Workload, in_order: bool, views: usize) -> Load {
    // A still picture is one set, though it be refined: its sums are kept where it is sampled.
    let sets = if workload.timeline.moves() { workload.timeline.set_count as usize } else { 1 };
    Load { images: workload.sample_cameras.len(), sets, views, in_order }
}

impl Work {
    pub(super) fn new(workload: Workload, costs: Costs) -> Self {
        Self { workload, costs, sessions: Vec::new(), in_force: None }
    }

    pub(super) fn add(&mut self, opening: &Opening) {
        self.remove(opening.session);
        let wish = Wish { policy: opening.policy, forced_samplers: opening.forced_samplers };
        self.sessions.push(Session { number: opening.session, views: opening.views_per_set, wish });
    }

    pub(super) fn remove(&mut self, number: u64) {
        self.sessions.retain(|session| session.number != number);
    }

    pub(super) fn demand(&mut self, number: u64, views: usize) {
        self.sessions.iter_mut().filter(|session| session.number == number).for_each(|session| session.views = views);
    }

    pub(super) fn sessions(&self) -> Vec<u64> {
        self.sessions.iter().map(|session| session.number).collect()
    }

    /// V: of all sessions.
    pub(super) fn views(&self) -> usize {
        self.sessions.iter().fold(0, |sum, session| sum.saturating_add(session.views))
    }

    pub(super) fn load(&self) -> Load {
        load_of(&self.workload, self.costs.in_order, self.views())
    }

    /// The last session that was opened decides.
    pub(super) fn wish(&self) -> Wish {
        self.sessions.last().map(|session| session.wish).unwrap_or_default()
    }
}

impl InForce {
    pub(super) fn new(plan: SessionPlan, members: BTreeMap<String, u64>, now: Duration) -> Self {
        Self { plan, members, patience: Patience::from(now) }
    }

    /// Whether another plan would say the same to every node.
    pub(super) fn assigns(&self, other: &Assignment) -> bool {
        let own = &self.plan.assignment;
        let roles = |plan: &Assignment| (plan.policy, plan.samplers.clone(), plan.compositors.clone());
        own.workload == other.workload && roles(own) == roles(other)
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
}
