//! Everything that the streams of one compositor share.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Instant;

use cluster::{Assignment, DIRECT, Policy};
use depth_image::PinholeCamera;
use node::{CellPlan, Deadlines, NodeMetrics, PlansInForce, beyond_timeline};
use tonic::Status;

use crate::batch::{Loaded, Place, Source, Waiting};
use crate::outbox::Outbox;
use crate::queue::{Arrivals, Lane};
use crate::quota::NodeQuota;
use crate::sets::Sets;

/// The parts that all streams share.
pub(crate) struct Shared {
    pub(crate) plans: PlansInForce,
    pub(crate) sets: Arc<Sets>,
    pub(crate) arrivals: Arc<Arrivals>,
    pub(crate) quota: NodeQuota,
    pub(crate) deadlines: Deadlines,
    pub(crate) metrics: NodeMetrics,
    pub(crate) stream_count: AtomicU64,
}

/// One client's call.
pub(crate) struct ClientStream {
    pub(crate) shared: Arc<Shared>,
    /// The number of the stream, for the queue and in logs.
    pub(crate) stream: u64,
    pub(crate) outbox: Arc<Outbox>,
}

impl ClientStream {
    /// Hands views of one request over to a lane of the device, or to that of views that are drawn whatever the plan.
    pub(crate) fn queue(&self, lane: Lane, views: Vec<Waiting>) {
        let lane = if views.first().is_some_and(|view| view.key.method == DIRECT) { Lane::Direct } else { lane };
        for Waiting { key, view, .. } in &views {
            tracing::debug!(stream = self.stream, frame = view.frame, set = %key.sample_set_id, "queued");
        }
        self.shared.arrivals.push(lane, self.stream, views);
    }
}

impl Shared {
    /// The plan for views by a method, if this node makes views in it. Views that are drawn from the scene ignore the plan's
    /// policy.
    pub(crate) fn of_compositor(&self, plan: Arc<Assignment>, method: &str) -> Result<Arc<Assignment>, Status> {
        if plan.composites(&self.plans.node_name) {
            self.sets.check_method(&plan, method)?;
            let is_as_planned = method != DIRECT || plan.policy == Policy::Direct;
            return Ok(if is_as_planned {
                plan
            } else {
                Arc::new(Assignment { policy: Policy::Direct, ..(*plan).clone() })
            });
        }
        let (name, plan_epoch) = (&self.plans.node_name, plan.plan_epoch);
        Err(Status::failed_precondition(format!("{name} makes no views in plan_epoch {plan_epoch}")))
    }

    /// Waits for the source of a cell's set.
    pub(crate) async fn source(&self, plan: &Arc<Assignment>, set_index: u32, cell: u32) -> Result<Loaded, Status> {
        let start = Instant::now();
        let id = plan.sample_set_id(set_index).ok_or_else(|| beyond_timeline(set_index))?;
        let (source, content) = match plan.policy {
            Policy::Pipeline | Policy::TimeShare => {
                let set = self.sets.get(&CellPlan::of(plan, cell)?, set_index).await?;
                let content = set.content;
                (Source::Set(set), Some(content))
            }
            Policy::Direct => (scene(plan, set_index)?, None),
        };
        let place = Place { id, cell, is_neighbour: false, content };
        Ok(Loaded { source, place, wait_s: start.elapsed().as_secs_f64() })
    }

    /// The source of a place, if it is still there; it is not waited for.
    pub(crate) fn source_at(&self, plan: &Arc<Assignment>, set_index: u32, place: Place) -> Option<Source> {
        match place.content {
            Some(content) => self.sets.loaded(&content).map(Source::Set),
            None => scene(plan, set_index).ok(),
        }
    }

    /// The set of a cell, if it is loaded.
    pub(crate) fn loaded(&self, plan: &Arc<Assignment>, set_index: u32, cell: u32) -> Option<Loaded> {
        let id = plan.sample_set_id(set_index)?;
        let set = self.sets.loaded(&CellPlan::of(plan, cell).ok()?.set_content(set_index)?)?;
        let place = Place { id, cell, is_neighbour: false, content: Some(set.content) };
        Some(Loaded { source: Source::Set(set), place, wait_s: 0.0 })
    }

    /// The nearest loaded set of a view's moment.
    pub(crate) fn nearest(&self, plan: &Assignment, set_index: u32, view: &PinholeCamera) -> Option<Loaded> {
        let id = plan.sample_set_id(set_index).filter(|_| plan.policy != Policy::Direct)?;
        let set = self.sets.nearest(plan, set_index, view)?;
        let place = Place { id, cell: set.cell, is_neighbour: true, content: Some(set.content) };
        Some(Loaded { source: Source::Set(set), place, wait_s: 0.0 })
    }
}

fn scene(plan: &Arc<Assignment>, set_index: u32) -> Result<Source, Status> {
    let scene_time_s = plan.workload.timeline.time_s(set_index).ok_or_else(|| beyond_timeline(set_index))?;
    Ok(Source::Scene { plan: plan.clone(), scene_time_s })
}
