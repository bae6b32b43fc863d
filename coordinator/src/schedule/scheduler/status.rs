//! The state of the cluster, for status calls and metrics.

use cluster::{ClusterStatus, NodeCondition};

use super::Scheduler;
use crate::schedule::member::Member;

impl Scheduler {
    /// Members, the plan in force, and the demand of all sessions.
    #[must_use]
    pub fn status(&self) -> ClusterStatus {
        let workload = self.workload.as_ref();
        ClusterStatus {
            plan_epoch: self.plan_epoch,
            nodes: self.members.values().map(|member| member.status.clone()).collect(),
            offer: None,
            plan: self.active_plan().map(|active| active.plan.clone()),
            session_count: workload.map_or(0, |workload| workload.sessions().len() as u32),
            views_per_set: workload.map_or(0, |workload| workload.views() as u64),
            conditions: workload.map_or_else(Vec::new, |_| self.conditions()),
            achieved: workload.map_or_else(Vec::new, |workload| workload.achieved.clone()),
            utilisation: self.utilisation().filter(|&utilisation| utilisation > 0.0),
        }
    }

    fn conditions(&self) -> Vec<NodeCondition> {
        let is_ready = |name: &str| self.active_plan().is_some_and(|active| active.ready.contains(name));
        let condition = |(name, member): (&String, &Member)| NodeCondition {
            node_name: name.clone(),
            is_ready: is_ready(name),
            costs: member.estimate.now().costs,
            views: member.activity.views,
            dropped_views: member.activity.dropped_views,
            busy_ratio: member.activity.busy_ratio,
        };
        self.members.iter().map(condition).collect()
    }
}

/// For tests of the whole schedule.
#[cfg(test)]
impl Scheduler {
    pub(in crate::schedule) fn active_plan_epoch(&self) -> Option<u64> {
        Some(self.active_plan()?.epoch())
    }

    /// Whether the plan in force was made for this node, with or without a role.
    pub(in crate::schedule) fn plans_with(&self, name: &str) -> bool {
        self.active_plan().is_some_and(|active| active.members.contains_key(name))
    }
}
