//! The service of every node: it measures costs and takes plans.

use std::collections::VecDeque;
use std::sync::Arc;

use cluster::{Assignment, Costs, MeasureCosts, Ready};
use parking_lot::Mutex;
use tonic::{Status, async_trait};
use wire::rpc;

use crate::blocking::blocking;
use crate::engine::Engine;
use crate::measure::measure_costs;
use crate::plan::CurrentPlan;
use crate::scenes::Scenes;
use crate::telemetry::NodeMetrics;

/// Measured costs that are cached.
const MAX_MEASURED: usize = 16;

/// The node's own service.
pub struct NodeService {
    engine: Arc<dyn Engine>,
    plan: CurrentPlan,
    scenes: Arc<Scenes>,
    metrics: NodeMetrics,
    /// Measured costs, the oldest first: a coordinator that was restarted need not wait for them again.
    measured: Mutex<VecDeque<(MeasureCosts, Costs)>>,
}

impl NodeService {
    /// The service of one node.
    #[must_use]
    pub fn new(engine: Arc<dyn Engine>, plan: CurrentPlan, scenes: Arc<Scenes>, metrics: NodeMetrics) -> Self {
        Self { engine, plan, scenes, metrics, measured: Mutex::default() }
    }
}

#[async_trait]
impl rpc::Node for NodeService {
    async fn measure_costs(&self, request: MeasureCosts) -> Result<Costs, Status> {
        let known = self.measured.lock().iter().find(|(known, _)| *known == request).map(|(_, costs)| *costs);
        if let Some(costs) = known {
            return Ok(costs);
        }
        self.scenes.ensure(&request.workload.scene).await?;
        let (engine, measured) = (self.engine.clone(), request.clone());
        let costs = blocking(move || measure_costs(engine.as_ref(), &measured)).await?;
        let mut measured = self.measured.lock();
        measured.push_back((request, costs));
        while measured.len() > MAX_MEASURED {
            measured.pop_front();
        }
        Ok(costs)
    }

    async fn apply_assignment(&self, assignment: Assignment) -> Result<Ready, Status> {
        self.plan.admits(&assignment)?;
        let plan_epoch = assignment.plan_epoch;
        let scene_load_s = self.scenes.ensure(&assignment.workload.scene).await?;
        self.plan.apply(assignment)?;
        self.metrics.plan_epoch.set(i64::try_from(plan_epoch).unwrap_or(i64::MAX));
        tracing::info!(node = &*self.plan.node_name, plan_epoch, "plan in force");
        Ok(Ready { plan_epoch, scene_load_s })
    }
}
