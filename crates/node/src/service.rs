//! The service of every node: it measures costs and takes plans.

use std::collections::VecDeque;
use std::sync::Arc;

use cluster::{ApplyPlan, MeasureCosts, Measured, Ready};
use parking_lot::Mutex;
use tonic::{Status, async_trait};
use wire::rpc;

use crate::blocking::blocking;
use crate::engine::Engine;
use crate::measure::measure_costs;
use crate::plan::PlansInForce;
use crate::scenes::Scenes;
use crate::telemetry::NodeMetrics;

/// Measured costs that are cached.
const MAX_MEASURED: usize = 16;

/// The node's own service.
pub struct NodeService {
    engine: Arc<dyn Engine>,
    plans: PlansInForce,
    scenes: Arc<Scenes>,
    metrics: NodeMetrics,
    /// Measured costs, the oldest first: a coordinator that was restarted need not wait for them again.
    measured: Mutex<VecDeque<(MeasureCosts, Measured)>>,
}

impl NodeService {
    /// The service of one node.
    #[must_use]
    pub fn new(engine: Arc<dyn Engine>, plans: PlansInForce, scenes: Arc<Scenes>, metrics: NodeMetrics) -> Self {
        Self { engine, plans, scenes, metrics, measured: Mutex::default() }
    }
}

#[async_trait]
impl rpc::Node for NodeService {
    async fn measure_costs(&self, request: MeasureCosts) -> Result<Measured, Status> {
        let known = self.measured.lock().iter().find(|(known, _)| *known == request).map(|(_, measured)| *measured);
        // What is measured in the background was measured before, beside other work.
        if let Some(measured) = known.filter(|_| !request.in_background) {
            return Ok(measured);
        }
        self.scenes.ensure(&request.workload.scene).await?;
        let (engine, measurement) = (self.engine.clone(), request.clone());
        let measured = blocking(move || measure_costs(engine.as_ref(), &measurement)).await?;
        let mut cached = self.measured.lock();
        cached.push_back((request, measured));
        while cached.len() > MAX_MEASURED {
            cached.pop_front();
        }
        Ok(measured)
    }

    async fn apply_assignment(&self, ApplyPlan { assignment, .. }: ApplyPlan) -> Result<Ready, Status> {
        self.plans.admits(&assignment)?;
        let (plan_epoch, workload_number) = (assignment.plan_epoch, assignment.workload_number);
        let scene_load_s = self.scenes.ensure(&assignment.workload.scene).await?;
        self.plans.apply(assignment)?;
        self.metrics.plan_epoch.set(i64::try_from(self.plans.epoch()).unwrap_or(i64::MAX));
        tracing::info!(node = &*self.plans.node_name, workload_number, plan_epoch, "plan in force");
        Ok(Ready { plan_epoch, scene_load_s })
    }
}
