//! Observers of the schedule: metrics, and a log of events to be replayed.

use std::collections::BTreeSet;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use cluster::{ClusterStatus, ErrorInterval, PromiseState};
use parking_lot::Mutex;
use prometheus_client::metrics::{counter::Counter, family::Family, gauge::Gauge};
use prometheus_client::registry::Unit;

use crate::schedule::{Command, Event, Recorder};

/// A gauge for each value of its labels: names and values.
type Gauges<const LABELS: usize> = Family<[(&'static str, String); LABELS], Gauge<f64, AtomicU64>>;

node::metrics! {
    /// Registered gauges of the cluster's state, and counters of plans and measurements.
    pub struct CoordinatorMetrics {
        nodes: Gauge, "cluster_nodes", "P: nodes that have joined";
        workloads: Gauge, "cluster_workloads", "Workloads that are open";
        samplers: Gauge, "cluster_samplers", "K: nodes that sample, of all workloads";
        sessions: Gauge, "cluster_sessions", "Sessions of all workloads";
        views_per_set: Gauge, "cluster_views_per_set", "V: views of a sample set, of all workloads";
        plan_epoch: Gauge, "cluster_plan_epoch", "The last plan";
        plans: Counter, "cluster_plans", "Plans made";
        promises: Family<[(&'static str, String); 1], Gauge>, "cluster_promises",
            "Promises to the sessions of a workload";
        view_probes: Counter, "cluster_view_probes", "Measurements for budgets";
        audit_errors: Gauges<2>, "cluster_audit_error_ratio",
            "The error of a workload's audited views: the interval that has it with 95 % confidence, and the mean";
        known_light: Gauges<1>, "cluster_known_light_ratio",
            "The share of a view's surface points whose light samples know, as measured";
        view_parts_s: Gauges<2>, "cluster_view_part" in Seconds,
            "Parts of a view whose light comes from samples, as measured";
        broken: Counter, "cluster_promises_broken", "Promises that audits have found broken";
    } beside {
        /// Workloads whose promise is broken now.
        broken_workloads: Arc<Mutex<BTreeSet<u64>>>
    }
}

impl CoordinatorMetrics {
    /// Shows the cluster's state, and counts what the schedule has ordered.
    pub fn show(&self, status: &ClusterStatus, commands: &[Command]) {
        let plans = commands.iter().filter(|command| matches!(command, Command::Apply { .. })).count();
        self.plans.inc_by(plans as u64);
        let probes = commands.iter().filter(|command| matches!(command, Command::ProbeViews(_))).count();
        self.view_probes.inc_by(probes as u64);
        self.show_audits(status);
        self.show_shared_light(status);
        for state in [PromiseState::Measuring, PromiseState::Kept, PromiseState::Broken, PromiseState::Unreachable] {
            let promises = status.workloads.iter().filter_map(|workload| workload.promise.as_ref());
            let count = promises.filter(|promise| promise.state == state).count();
            self.promises.get_or_create(&[("state", state.to_string())]).set(count as i64);
        }
        for (gauge, count) in [
            (&self.nodes, status.nodes.len() as u64),
            (&self.workloads, status.workloads.len() as u64),
            (&self.samplers, status.sampler_count() as u64),
            (&self.sessions, status.session_count()),
            (&self.views_per_set, status.views_per_set()),
            (&self.plan_epoch, status.plan_epoch),
        ] {
            gauge.set(i64::try_from(count).unwrap_or(i64::MAX));
        }
    }

    fn show_audits(&self, status: &ClusterStatus) {
        let promised =
            status.workloads.iter().filter_map(|workload| Some((workload.number, workload.promise.as_ref()?)));
        let broken = promised.filter(|(_, promise)| promise.state == PromiseState::Broken);
        let broken: BTreeSet<u64> = broken.map(|(number, _)| number).collect();
        let before = std::mem::replace(&mut *self.broken_workloads.lock(), broken.clone());
        self.broken.inc_by(broken.difference(&before).count() as u64);
        self.audit_errors.clear();
        for workload in &status.workloads {
            let audit = workload.promise.as_ref().and_then(|promise| promise.audit);
            let Some(ErrorInterval { low, mean, high }) = audit.and_then(|audit| audit.error) else { continue };
            for (value, ratio) in [("low", low), ("mean", mean), ("high", high)] {
                let labels = [("workload", workload.number.to_string()), ("value", value.to_owned())];
                self.audit_errors.get_or_create(&labels).set(ratio);
            }
        }
    }

    fn show_shared_light(&self, status: &ClusterStatus) {
        self.known_light.clear();
        self.view_parts_s.clear();
        for status in &status.workloads {
            let Some(light) = status.shared_light else { continue };
            let workload = status.number.to_string();
            self.known_light.get_or_create(&[("workload", workload.clone())]).set(light.known_ratio);
            let parts =
                [("surfaces", light.surfaces_s), ("look_up", light.look_up_s), ("unknown_points", light.unknown_s)];
            for (part, seconds) in parts {
                self.view_parts_s
                    .get_or_create(&[("workload", workload.clone()), ("part", part.to_owned())])
                    .set(seconds);
            }
        }
    }
}

/// A log of all events of the schedule.
pub type EventLog = Recorder<Box<dyn Write + Send>>;

/// Metrics and log; neither changes a decision.
#[derive(Default)]
pub struct Observers {
    /// For Prometheus.
    pub metrics: CoordinatorMetrics,
    /// Ends at the first line that cannot be written.
    pub log: Option<EventLog>,
}

impl Observers {
    pub(crate) fn record(&mut self, now: Duration, event: &Event) {
        let failed = self.log.as_mut().and_then(|log| log.record(now, event).err());
        if let Some(error) = failed {
            tracing::error!(%error, "events are no longer recorded");
            self.log = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use cluster::{SharedLightCosts, WorkloadStatus};
    use node::Telemetry;

    use super::*;

    #[test]
    fn parts_of_views_are_shown_while_their_workload_is_open() {
        let telemetry = Telemetry::default();
        let metrics = CoordinatorMetrics::new(&telemetry);
        let costs = SharedLightCosts { known_ratio: 0.93, surfaces_s: 0.12, look_up_s: 0.04, unknown_s: 0.31 };
        let lit = WorkloadStatus { number: 7, shared_light: Some(costs), ..WorkloadStatus::default() };
        let plain = WorkloadStatus { number: 8, ..WorkloadStatus::default() };
        metrics.show(&ClusterStatus { workloads: vec![lit, plain.clone()], ..ClusterStatus::default() }, &[]);
        let page = telemetry.page();
        for line in [
            "myriorama_cluster_known_light_ratio{workload=\"7\"} 0.93",
            "myriorama_cluster_view_part_seconds{workload=\"7\",part=\"surfaces\"} 0.12",
            "myriorama_cluster_view_part_seconds{workload=\"7\",part=\"look_up\"} 0.04",
            "myriorama_cluster_view_part_seconds{workload=\"7\",part=\"unknown_points\"} 0.31",
        ] {
            assert!(page.contains(line), "{line} in {page}");
        }
        assert!(!page.contains("workload=\"8\""), "{page}");
        metrics.show(&ClusterStatus { workloads: vec![plain], ..ClusterStatus::default() }, &[]);
        assert!(!telemetry.page().contains("workload=\"7\""), "{}", telemetry.page());
    }
}
