//! The service of every node: it measures costs and views, and takes plans.

use std::collections::VecDeque;
use std::sync::Arc;

use cluster::{ApplyPlan, Assignment, BudgetMeasurement, MeasureCosts, Measured, Ready};
use depth_image::ViewPlanes;
use parking_lot::Mutex;
use tonic::{Status, async_trait};
use wire::rpc;

use crate::blocking::blocking;
use crate::latest::push_latest;
use crate::measure::measure_costs;
use crate::parts::NodeParts;
use crate::view_probes::ViewProbes;

/// Measured costs that are cached.
const MAX_MEASURED: usize = 16;

/// The node's own service.
pub struct NodeService {
    node: Arc<NodeParts>,
    /// Measured costs, the oldest first: a coordinator that was restarted need not wait for them again.
    measured: Mutex<VecDeque<(MeasureCosts, Measured)>>,
    /// One request at a time.
    probes: Arc<tokio::sync::Mutex<Arc<dyn ViewProbes>>>,
}

impl NodeService {
    /// The service of one node.
    #[must_use]
    pub fn new(node: Arc<NodeParts>, probes: Arc<dyn ViewProbes>) -> Self {
        Self { node, measured: Mutex::default(), probes: Arc::new(tokio::sync::Mutex::new(probes)) }
    }

    async fn measure_now(&self, request: &MeasureCosts) -> Result<Measured, Status> {
        self.node.ensure_scene(&request.workload.scene).await?;
        let engine = self.node.engine.clone();
        let request = request.clone();
        blocking(move || measure_costs(engine.as_ref(), &request)).await
    }

    async fn measure_for_budget(&self, request: MeasureCosts, budget: BudgetMeasurement) -> Result<Measured, Status> {
        let planes = ViewPlanes { inverse_depth: true, ..request.planes };
        self.node.config.quotas.check_views(&request.typical_views, planes)?;
        // A call that is cancelled is measured to its end, before the next.
        let probes = self.probes.clone().lock_owned().await;
        self.node.ensure_scene(&request.workload.scene).await?;
        blocking(move || probes.probe(&request, &budget)).await
    }
}

#[async_trait]
impl rpc::Node for NodeService {
    async fn measure_costs(&self, request: MeasureCosts) -> Result<Measured, Status> {
        if let Some(budget) = request.budget.clone() {
            return self.measure_for_budget(request, budget).await;
        }
        let quotas = self.node.config.quotas;
        request.typical_views.chunks(1).try_for_each(|view| quotas.check_views(view, request.planes))?;
        let known =
            self.measured.lock().iter().find(|(known, _)| *known == request).map(|(_, measured)| measured.clone());
        // What is measured in the background was measured before, beside other work.
        if let Some(measured) = known.filter(|_| !request.in_background) {
            return Ok(measured);
        }
        let scene = &request.workload.scene;
        let measured = match self.measure_now(&request).await {
            // The scenes of others may have driven it out meanwhile.
            Err(_) if !self.node.engine.has_scene(scene.hash.as_str()) => self.measure_now(&request).await?,
            done => done?,
        };
        let request = MeasureCosts { in_background: false, ..request };
        let mut cached = self.measured.lock();
        cached.retain(|(known, _)| *known != request);
        push_latest(&mut cached, (request, measured.clone()), MAX_MEASURED);
        Ok(measured)
    }

    async fn apply_assignment(&self, plan: ApplyPlan) -> Result<Ready, Status> {
        let Assignment { plan_epoch, workload_number, workload, .. } = &plan.assignment;
        let plan_epoch = *plan_epoch;
        let workload_number = *workload_number;
        self.node.plans.admits(&plan.assignment)?;
        let scene_load_s = self.node.ensure_scene(&workload.scene).await?;
        let ended = self.node.plans.apply(plan)?;
        if !ended.is_empty() {
            tracing::info!(node = &*self.node.plans.node_name, ?ended, "workloads have ended");
        }
        self.node.metrics.plan_epoch.set(i64::try_from(self.node.plans.epoch()).unwrap_or(i64::MAX));
        tracing::info!(node = &*self.node.plans.node_name, workload_number, plan_epoch, "plan in force");
        Ok(Ready { plan_epoch, scene_load_s })
    }
}
