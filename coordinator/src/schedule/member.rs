//! Members of the cluster as the schedule knows them.

use std::time::Duration;

use cluster::{Costs, NodeStatus};

use super::estimate::Estimate;

/// One process that has joined.
#[derive(Debug, Clone)]
pub(super) struct Member {
    pub(super) incarnation: u64,
    pub(super) status: NodeStatus,
    pub(super) estimate: Estimate,
    /// Since when the node is in quarantine.
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
    pub(super) fn new(now: Duration, incarnation: u64, status: NodeStatus, costs: Option<&Costs>) -> Self {
        let estimate = costs.map(Estimate::starting_at).unwrap_or_default();
        let activity = Activity { reported_at: now, ..Activity::default() };
        Self { incarnation, status, estimate, quarantined_at: None, activity }
    }

    /// Another workload: its costs, and no quarantine, for the node may be able to do it.
    pub(super) fn restart(&mut self, costs: &Costs) {
        (self.estimate, self.quarantined_at) = (Estimate::starting_at(costs), None);
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
