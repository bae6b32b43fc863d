//! The service of every node: it measures costs and takes plans.

use std::collections::VecDeque;
use std::sync::Arc;

use cluster::{ApplyPlan, Assignment, MeasureCosts, Measured, Ready};
use parking_lot::Mutex;
use tonic::{Status, async_trait};
use wire::rpc;

use crate::blocking::blocking;
use crate::config::Quotas;
use crate::measure::measure_costs;
use crate::plan::PlansInForce;
use crate::scenes::Scenes;
use crate::telemetry::NodeMetrics;

/// Measured costs that are cached.
const MAX_MEASURED: usize = 16;

/// The node's own service.
pub struct NodeService {
    plans: PlansInForce,
    scenes: Arc<Scenes>,
    quotas: Quotas,
    metrics: NodeMetrics,
    /// Measured costs, the oldest first: a coordinator that was restarted need not wait for them again.
    measured: Mutex<VecDeque<(MeasureCosts, Measured)>>,
}

impl NodeService {
    /// The service of one node.
    #[must_use]
    pub fn new(plans: PlansInForce, scenes: Arc<Scenes>, quotas: Quotas, metrics: NodeMetrics) -> Self {
        Self { plans, scenes, quotas, metrics, measured: Mutex::default() }
    }

    async fn measure_now(&self, request: &MeasureCosts) -> Result<Measured, Status> {
        self.scenes.ensure(&request.workload.scene).await?;
        let (engine, request) = (self.scenes.engine(), request.clone());
        blocking(move || measure_costs(engine.as_ref(), &request)).await
    }
}

#[async_trait]
impl rpc::Node for NodeService {
    async fn measure_costs(&self, request: MeasureCosts) -> Result<Measured, Status> {
        request.typical_views.iter().try_for_each(|view| self.quotas.check_view(view, request.planes))?;
        let known = self.measured.lock().iter().find(|(known, _)| *known == request).map(|(_, measured)| *measured);
        // What is measured in the background was measured before, beside other work.
        if let Some(measured) = known.filter(|_| !request.in_background) {
            return Ok(measured);
        }
        let scene = &request.workload.scene;
        let measured = match self.measure_now(&request).await {
            // The scenes of others may have driven it out meanwhile.
            Err(_) if !self.scenes.engine().has_scene(scene.hash.as_str()) => self.measure_now(&request).await?,
            done => done?,
        };
        let request = MeasureCosts { in_background: false, ..request };
        let mut cached = self.measured.lock();
        cached.retain(|(known, _)| *known != request);
        cached.push_back((request, measured));
        while cached.len() > MAX_MEASURED {
            cached.pop_front();
        }
        Ok(measured)
    }

    async fn apply_assignment(&self, plan: ApplyPlan) -> Result<Ready, Status> {
        let Assignment { plan_epoch, workload_number, workload, .. } = &plan.assignment;
        let (plan_epoch, workload_number) = (*plan_epoch, *workload_number);
        self.plans.admits(&plan.assignment)?;
        let scene_load_s = self.scenes.ensure(&workload.scene).await?;
        let ended = self.plans.apply(plan)?;
        if !ended.is_empty() {
            tracing::info!(node = &*self.plans.node_name, ?ended, "workloads have ended");
        }
        self.metrics.plan_epoch.set(i64::try_from(self.plans.epoch()).unwrap_or(i64::MAX));
        tracing::info!(node = &*self.plans.node_name, workload_number, plan_epoch, "plan in force");
        Ok(Ready { plan_epoch, scene_load_s })
    }
}
