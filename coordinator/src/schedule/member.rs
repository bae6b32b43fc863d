//! Members of the cluster as the schedule knows them.

use std::collections::BTreeMap;
use std::time::Duration;

use cluster::{Costs, NodeStatus};

use super::estimate::Estimate;

/// Nodes that work report once a second.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);
/// A node reports each workload by itself: reports within this time are of one interval.
const TOGETHER: Duration = Duration::from_millis(500);
/// A node that has not reported for so long did not work.
const SILENT: Duration = Duration::from_secs(2);
/// The share of its time that an idle node may work.
const MOST_IDLE_RATIO: f64 = 0.2;

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
#[derive(Debug, Clone, Copy)]
pub(super) struct Activity {
    pub(super) views: u64,
    pub(super) dropped_views: u64,
    /// The first of the last reports.
    reported_at: Duration,
    /// The time that these reports are of, and the work in it.
    interval_s: f64,
    busy_s: f64,
    /// The last time that the node was not idle.
    pub(super) busy_at: Option<Duration>,
}

impl Member {
    pub(super) fn new(now: Duration, incarnation: u64, status: NodeStatus) -> Self {
        let activity = Activity::starting_at(now);
        Self { incarnation, status, estimates: BTreeMap::new(), quarantined_at: None, activity }
    }

    /// Another workload begins, or begins anew.
    pub(super) fn expect(&mut self, workload: u64, costs: &Costs) {
        self.estimates.insert(workload, Estimate::starting_at(costs));
    }

    /// The machine at the node's address; its nodes may share a device.
    pub(super) fn machine(&self) -> &str {
        let address = self.status.address.as_str();
        address.rsplit_once(':').map_or(address, |(machine, _)| machine)
    }
}

impl Activity {
    fn starting_at(now: Duration) -> Self {
        let interval_s = REPORT_INTERVAL.as_secs_f64();
        Self { views: 0, dropped_views: 0, reported_at: now, interval_s, busy_s: 0.0, busy_at: None }
    }

    /// Adds a report on one workload.
    pub(super) fn add(&mut self, now: Duration, busy_s: f64, views: u64, dropped_views: u64) {
        let since = now.saturating_sub(self.reported_at);
        if since >= TOGETHER {
            // A node that was silent for longer began its work no earlier than an interval ago, or than the work took.
            let longest_s = if since < SILENT { f64::INFINITY } else { REPORT_INTERVAL.as_secs_f64().max(busy_s) };
            (self.reported_at, self.interval_s, self.busy_s) = (now, since.as_secs_f64().min(longest_s), 0.0);
        }
        self.busy_s += busy_s;
        self.views = self.views.saturating_add(views);
        self.dropped_views = self.dropped_views.saturating_add(dropped_views);
        if self.busy_ratio(now) > MOST_IDLE_RATIO {
            self.busy_at = Some(now);
        }
    }

    /// The share of its time that the node works; operations of several workloads count together.
    pub(super) fn busy_ratio(&self, now: Duration) -> f64 {
        let is_silent = now.saturating_sub(self.reported_at) >= SILENT;
        if is_silent { 0.0 } else { self.busy_s / self.interval_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(reports: impl IntoIterator<Item = (f64, f64)>) -> Activity {
        let mut activity = Activity::starting_at(Duration::ZERO);
        for (now_s, busy_s) in reports {
            activity.add(Duration::from_secs_f64(now_s), busy_s, 1, 0);
        }
        activity
    }

    fn busy_ratio(activity: &Activity, now_s: f64) -> f64 {
        activity.busy_ratio(Duration::from_secs_f64(now_s))
    }

    #[test]
    fn reports_of_several_workloads_add_up_over_their_interval() {
        let seconds = (1..10).map(f64::from);
        let activity = after(seconds.flat_map(|s| [(s, 0.3), (s + 30e-6, 0.2), (s + 70e-6, 0.25)]));
        assert!((busy_ratio(&activity, 9.1) - 0.75).abs() < 1e-3, "{activity:?}");
        assert_eq!(activity.views, 27);
    }

    #[test]
    fn reports_a_little_early_or_late_are_of_their_own_interval() {
        let activity = after([(1.0, 0.5), (1.01, 0.3), (1.8, 0.4), (1.81, 0.24)]);
        assert!((busy_ratio(&activity, 1.9) - 0.8).abs() < 1e-9, "{activity:?}");
        let late = after([(1.0, 0.5), (2.6, 0.8)]);
        assert!((busy_ratio(&late, 2.7) - 0.5).abs() < 1e-9, "{late:?}");
    }

    #[test]
    fn a_node_that_begins_to_work_was_busy_for_the_last_second() {
        let activity = after([(0.001, 0.4)]);
        assert!((busy_ratio(&activity, 0.1) - 0.4).abs() < 1e-9, "{activity:?}");
        assert!((busy_ratio(&after([(1.0, 0.9), (60.0, 0.4)]), 60.1) - 0.4).abs() < 1e-9);
    }

    #[test]
    fn an_operation_longer_than_the_silence_counts_whole_and_none_counts_more_than_its_time() {
        assert!((busy_ratio(&after([(1.0, 0.9), (31.0, 30.0)]), 31.1) - 1.0).abs() < 1e-9);
        assert!((busy_ratio(&after([(1.0, 0.9), (61.0, 30.0)]), 61.1) - 1.0).abs() < 1e-9);
        assert!(busy_ratio(&after([(60.0, f64::MAX)]), 60.1).is_finite());
    }

    #[test]
    fn a_silent_node_is_idle() {
        let activity = after([(1.0, 0.9)]);
        assert_eq!((busy_ratio(&activity, 2.9), busy_ratio(&activity, 3.0)), (0.9, 0.0));
        assert_eq!(activity.busy_at, Some(Duration::from_secs(1)));
        assert_eq!(after([(1.0, 0.1), (2.0, 0.1)]).busy_at, None);
    }
}
