//! Observers of the schedule: metrics, and a log of events to be replayed.

use std::io::Write;
use std::time::Duration;

use cluster::{ClusterStatus, PromiseState};
use node::Telemetry;
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::{counter::Counter, family::Family, gauge::Gauge};

use crate::schedule::{Command, Event, Recorder};

/// The state of promises.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct State {
    state: String,
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
        };
        registry.register("cluster_plans", "Plans made", metrics.plans.clone());
        registry.register("cluster_promises", "Promises to the sessions of a workload", metrics.promises.clone());
        registry.register("cluster_view_probes", "Measurements for budgets", metrics.view_probes.clone());
        metrics
    }

    pub(crate) fn show(&self, status: &ClusterStatus, commands: &[Command]) {
        let plans = commands.iter().filter(|command| matches!(command, Command::Apply { .. })).count();
        self.plans.inc_by(plans as u64);
        let probes = commands.iter().filter(|command| matches!(command, Command::ProbeViews(_))).count();
        self.view_probes.inc_by(probes as u64);
        for state in [PromiseState::Measuring, PromiseState::Kept, PromiseState::Unreachable] {
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
