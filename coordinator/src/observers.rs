//! Observers of the schedule: metrics, and a log of events to be replayed.

use std::collections::BTreeSet;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use cluster::{ClusterStatus, ErrorInterval, PromiseState, WorkloadStatus};
use node::Telemetry;
use parking_lot::Mutex;
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::{counter::Counter, family::Family, gauge::Gauge};

use crate::schedule::{Command, Event, Recorder};

/// The state of promises.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct State {
    state: String,
}

/// A bound of an audited error, or its mean.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct AuditedError {
    workload: u64,
    value: &'static str,
}

/// Registered gauges of the cluster's state, and counters of plans and measurements.
#[derive(Debug, Clone)]
pub struct CoordinatorMetrics {
    nodes: Gauge,
    workloads: Gauge,
    samplers: Gauge,
    sessions: Gauge,
    views_per_set: Gauge,
    plan_epoch: Gauge,
    plans: Counter,
    promises: Family<State, Gauge>,
    view_probes: Counter,
    audit_errors: Family<AuditedError, Gauge<f64, AtomicU64>>,
    broken: Counter,
    /// Workloads whose promise is broken now.
    broken_workloads: Arc<Mutex<BTreeSet<u64>>>,
}

impl CoordinatorMetrics {
    /// Registered, all at zero.
    #[must_use]
    pub fn new(telemetry: &Telemetry) -> Self {
        let mut registry = telemetry.registry();
        let mut gauge = |name: &str, help: &str| {
            let gauge = Gauge::default();
            registry.register(name, help, gauge.clone());
            gauge
        };
        let metrics = Self {
            nodes: gauge("cluster_nodes", "P: nodes that have joined"),
            workloads: gauge("cluster_workloads", "Workloads that are open"),
            samplers: gauge("cluster_samplers", "K: nodes that sample, of all workloads"),
            sessions: gauge("cluster_sessions", "Sessions of all workloads"),
            views_per_set: gauge("cluster_views_per_set", "V: views of a sample set, of all workloads"),
            plan_epoch: gauge("cluster_plan_epoch", "The last plan"),
            plans: Counter::default(),
            promises: Family::default(),
            view_probes: Counter::default(),
            audit_errors: Family::default(),
            broken: Counter::default(),
            broken_workloads: Arc::default(),
        };
        registry.register("cluster_plans", "Plans made", metrics.plans.clone());
        registry.register("cluster_promises", "Promises to the sessions of a workload", metrics.promises.clone());
        registry.register("cluster_view_probes", "Measurements for budgets", metrics.view_probes.clone());
        let help =
            "The error of a workload's audited views: the interval that has it with 95 % confidence, and the mean";
        registry.register("cluster_audit_error_ratio", help, metrics.audit_errors.clone());
        registry.register("cluster_promises_broken", "Promises that audits have found broken", metrics.broken.clone());
        metrics
    }

    pub(crate) fn show(&self, status: &ClusterStatus, commands: &[Command]) {
        let plans = commands.iter().filter(|command| matches!(command, Command::Apply { .. })).count();
        self.plans.inc_by(plans as u64);
        let probes = commands.iter().filter(|command| matches!(command, Command::ProbeViews(_))).count();
        self.view_probes.inc_by(probes as u64);
        self.show_audits(status);
        for state in [PromiseState::Measuring, PromiseState::Kept, PromiseState::Broken, PromiseState::Unreachable] {
            let promises = status.workloads.iter().filter_map(|workload| workload.promise.as_ref());
            let count = promises.filter(|promise| promise.state == state).count();
            self.promises.get_or_create(&State { state: state.to_string() }).set(count as i64);
        }
        let number = |count: u64| i64::try_from(count).unwrap_or(i64::MAX);
        self.nodes.set(number(status.nodes.len() as u64));
        self.workloads.set(number(status.workloads.len() as u64));
        self.samplers.set(number(status.sampler_count() as u64));
        self.sessions.set(number(status.session_count()));
        self.views_per_set.set(number(status.views_per_set()));
        self.plan_epoch.set(number(status.plan_epoch));
    }
}

impl CoordinatorMetrics {
    fn show_audits(&self, status: &ClusterStatus) {
        let is_broken = |workload: &&WorkloadStatus| {
            workload.promise.as_ref().is_some_and(|promise| promise.state == PromiseState::Broken)
        };
        let broken: BTreeSet<u64> = status.workloads.iter().filter(is_broken).map(|workload| workload.number).collect();
        let before = std::mem::replace(&mut *self.broken_workloads.lock(), broken.clone());
        self.broken.inc_by(broken.difference(&before).count() as u64);
        self.audit_errors.clear();
        for workload in &status.workloads {
            let audit = workload.promise.as_ref().and_then(|promise| promise.audit);
            let Some(ErrorInterval { least, mean, greatest }) = audit.and_then(|audit| audit.error) else { continue };
            for (value, ratio) in [("low", least), ("mean", mean), ("high", greatest)] {
                let labels = AuditedError { workload: workload.number, value };
                self.audit_errors.get_or_create(&labels).set(ratio);
            }
        }
    }
}

impl Default for CoordinatorMetrics {
    fn default() -> Self {
        Self::new(&Telemetry::default())
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
