//! What every node answers: its costs, and that it is ready for a plan.

use std::sync::Arc;

use tonic::{Status, async_trait};
use wire::{Assignment, Costs, MeasureCosts, Ready, rpc};

use crate::{CurrentPlan, Engine, Scenes, blocking, measure_costs};

/// The node's own service.
pub struct NodeService {
    engine: Arc<dyn Engine>,
    plan: CurrentPlan,
    scenes: Arc<Scenes>,
}

impl NodeService {
    /// Of a node.
    #[must_use]
    pub fn new(engine: Arc<dyn Engine>, plan: CurrentPlan, scenes: Arc<Scenes>) -> Self {
        Self { engine, plan, scenes }
    }
}

#[async_trait]
impl rpc::Node for NodeService {
    async fn measure_costs(&self, request: MeasureCosts) -> Result<Costs, Status> {
        self.scenes.ensure(&request.workload.scene).await?;
        let engine = self.engine.clone();
        blocking(move || measure_costs(engine.as_ref(), &request)).await
    }

    async fn apply_assignment(&self, assignment: Assignment) -> Result<Ready, Status> {
        self.plan.admits(&assignment)?;
        let plan_epoch = assignment.plan_epoch;
        let scene_load_s = self.scenes.ensure(&assignment.workload.scene).await?;
        self.plan.apply(assignment)?;
        tracing::info!(node = self.plan.node_name(), plan_epoch, "plan in force");
        Ok(Ready { plan_epoch, scene_load_s })
    }
}
