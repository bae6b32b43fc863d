//! Everything that the streams of one compositor share.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Instant;

use cluster::{Assignment, Policy};
use node::{CellPlan, CurrentPlan, Deadlines, NodeMetrics, beyond_timeline};
use tonic::Status;

use crate::batch::{Loaded, Source, Waiting};
use crate::outbox::Outbox;
use crate::queue::Arrivals;
use crate::quota::NodeQuota;
use crate::sets::Sets;

/// The parts that all streams share.
pub(crate) struct Shared {
    pub(crate) plan: CurrentPlan,
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
    /// Hands views over to the device.
    pub(crate) fn queue(&self, views: Vec<Waiting>) {
        for Waiting { key, view, .. } in &views {
            tracing::debug!(stream = self.stream, frame = view.frame, set = %key.sample_set_id, "queued");
        }
        self.shared.arrivals.push(self.stream, views);
    }
}

impl Shared {
    /// The plan, if this node makes views in it.
    pub(crate) fn of_compositor(&self, plan: Arc<Assignment>) -> Result<Arc<Assignment>, Status> {
        if plan.composites(&self.plan.node_name) {
            return Ok(plan);
        }
        let (name, plan_epoch) = (&self.plan.node_name, plan.plan_epoch);
        Err(Status::failed_precondition(format!("{name} makes no views in plan_epoch {plan_epoch}")))
    }

    /// Waits for the source of a cell's set.
    pub(crate) async fn source(&self, plan: &Arc<Assignment>, set_index: u32, cell: u32) -> Result<Loaded, Status> {
        let start = Instant::now();
        let beyond = || beyond_timeline(set_index);
        let id = plan.sample_set_id(set_index).ok_or_else(beyond)?;
        let source = match plan.policy {
            Policy::Pipeline | Policy::TimeShare => {
                Source::Set(self.sets.get(&CellPlan::of(plan, cell)?, set_index).await?)
            }
            Policy::Direct => {
                let scene_time_s = plan.workload.timeline.time_s(set_index).ok_or_else(beyond)?;
                Source::Scene { plan: plan.clone(), scene_time_s }
            }
        };
        Ok(Loaded { source, id, cell, wait_s: start.elapsed().as_secs_f64() })
    }
}
