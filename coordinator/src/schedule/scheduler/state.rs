//! The state of the cluster, for those that ask.

use std::time::Duration;

use cluster::{ClusterStatus, NodeCondition, WorkloadStatus};

use super::Scheduler;
use crate::schedule::NodeCosts;
use crate::schedule::workload_state::WorkloadState;

/// Views a second of a viewer, where there is none to compare with.
const TYPICAL_VIEWS_PER_S: f64 = 10.0;

impl Scheduler {
    /// The state of the cluster: members, and every workload.
    #[must_use]
    pub fn status(&self) -> ClusterStatus {
        let workloads = self.workloads.iter().map(|(&number, workload)| self.workload_status(number, workload));
        ClusterStatus {
            plan_epoch: self.plan_epoch,
            nodes: self.members.values().map(|member| member.status.clone()).collect(),
            offers: Vec::new(),
            workloads: workloads.collect(),
        }
    }

    /// How long a node, and all others at its address, have had little to do; no time for a node that is not a member.
    #[must_use]
    pub fn idle_for(&self, node_name: &str) -> Duration {
        let Some(node) = self.members.get(node_name) else { return Duration::ZERO };
        let neighbours = self.members.values().filter(|member| member.machine() == node.machine());
        let busy_at = neighbours.filter_map(|member| member.activity.busy_at).max();
        busy_at.map_or(Duration::MAX, |busy_at| self.now.saturating_sub(busy_at))
    }

    fn workload_status(&self, number: u64, workload: &WorkloadState) -> WorkloadStatus {
        WorkloadStatus {
            number,
            plan: workload.active_plan.as_ref().map(|active| active.plan.clone()),
            session_count: workload.sessions.len() as u32,
            viewer_count: workload.sessions.viewers() as u32,
            views_per_set: workload.sessions.views() as u64,
            conditions: self.conditions(number, workload),
            achieved: workload.achieved.clone(),
            utilisation: self.utilisation(number).filter(|&utilisation| utilisation > 0.0),
            promise: self.promise(number),
            shared_light: workload.sessions.shared_light(),
            one_more_viewer: self.one_more_viewer(number, workload),
        }
    }

    /// The share of all nodes' time that one more viewer would take.
    fn one_more_viewer(&self, number: u64, workload: &WorkloadState) -> f64 {
        let nodes = self.costs_of_all(number);
        let viewers = workload.sessions.viewers();
        let each = workload.sessions.views_per_s() / viewers as f64;
        let views_per_s = if viewers > 0 { each * workload.frame_rate_ratio() } else { TYPICAL_VIEWS_PER_S };
        views_per_s * workload.view_s(&NodeCosts::mean(&nodes)) / nodes.len().max(1) as f64
    }

    fn conditions(&self, number: u64, workload: &WorkloadState) -> Vec<NodeCondition> {
        let conditions = self.serving(workload).map(|(name, member)| NodeCondition {
            node_name: name.clone(),
            is_ready: workload.active_plan.as_ref().is_some_and(|active| active.ready.contains(name)),
            costs: member.estimates.get(&number).map(|estimate| estimate.now().costs).unwrap_or_default(),
            views: member.activity.views,
            dropped_views: member.activity.dropped_views,
            busy_ratio: member.activity.busy_ratio(self.now),
        });
        conditions.collect()
    }
}
