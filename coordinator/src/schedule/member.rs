//! Members of the cluster as the schedule knows them.

use std::collections::BTreeMap;
use std::time::Duration;

use cluster::{Costs, NodeStatus};

use super::estimate::Estimate;

/// One process that has joined.
#[derive(Debug, Clone)]
pub(super) struct Member {
    pub(super) incarnation: u64,
    pub(super) status: NodeStatus,
    /// One for each workload: their operations differ.
    pub(super) estimates: BTreeMap<u64, Estimate>,
    /// Since when the node is in quarantine, from all workloads.
    pub(super) quarantined_at: Option<Duration>,
    pub(super) activity: Activity,
}

/// Work that a node has reported since it joined.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Activity {
    reported_at: Duration,
    pub(super) views: u64,
    pub(super) dropped_views: u64,
    pub(super) busy_ratio: f64,
}

impl Member {
    pub(super) fn new(now: Duration, incarnation: u64, status: NodeStatus) -> Self {
        let activity = Activity { reported_at: now, ..Activity::default() };
        Self { incarnation, status, estimates: BTreeMap::new(), quarantined_at: None, activity }
    }

    /// Another workload begins, or begins anew.
    pub(super) fn expect(&mut self, workload: u64, costs: &Costs) {
        self.estimates.insert(workload, Estimate::starting_at(costs));
    }
}

impl Activity {
    /// Adds work since the last report.
    pub(super) fn add(&mut self, now: Duration, busy_s: f64, views: u64, dropped_views: u64) {
        let since_s = now.saturating_sub(self.reported_at).as_secs_f64();
        *self = Self {
            reported_at: now,
            views: self.views.saturating_add(views),
            dropped_views: self.dropped_views.saturating_add(dropped_views),
            busy_ratio: if since_s > 0.0 { busy_s / since_s } else { 0.0 },
        };
    }
}
