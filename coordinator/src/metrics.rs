//! Metrics of the coordinator.

use cluster::ClusterStatus;
use node::Telemetry;
use prometheus_client::metrics::{counter::Counter, gauge::Gauge};

use crate::schedule::Command;

/// Registered gauges of the cluster's state, and a counter of its plans.
#[derive(Debug, Clone)]
pub struct CoordinatorMetrics {
    nodes: Gauge,
    samplers: Gauge,
    sessions: Gauge,
    views_per_set: Gauge,
    plan_epoch: Gauge,
    plans: Counter,
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
            samplers: gauge("cluster_samplers", "K: nodes that sample"),
            sessions: gauge("cluster_sessions", "Sessions of the plan"),
            views_per_set: gauge("cluster_views_per_set", "V: views of a sample set"),
            plan_epoch: gauge("cluster_plan_epoch", "The plan in force"),
            plans: Counter::default(),
        };
        registry.register("cluster_plans", "Plans made", metrics.plans.clone());
        metrics
    }

    pub(crate) fn show(&self, status: &ClusterStatus, commands: &[Command]) {
        let plans = commands.iter().filter(|command| matches!(command, Command::Apply { .. })).count();
        self.plans.inc_by(plans as u64);
        let number = |count: u64| i64::try_from(count).unwrap_or(i64::MAX);
        self.nodes.set(number(status.nodes.len() as u64));
        self.samplers.set(number(status.plan.as_ref().map_or(0, |plan| plan.assignment.samplers.len() as u64)));
        self.sessions.set(number(status.session_count.into()));
        self.views_per_set.set(number(status.views_per_set));
        self.plan_epoch.set(number(status.plan_epoch));
    }
}

impl Default for CoordinatorMetrics {
    fn default() -> Self {
        Self::new(&Telemetry::default())
    }
}
