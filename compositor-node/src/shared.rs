//! Everything that the streams of one compositor share.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Instant;

use cluster::{Assignment, Policy};
use codec::SampleSetId;
use node::{CellPlan, CurrentPlan, Deadlines, NodeMetrics};
use tonic::Status;

use crate::arrivals::Arrivals;
use crate::batch::Source;
use crate::outbox::Outbox;
use crate::quota::NodeQuota;
use crate::sets::Sets;

/// The source of a set's views, the set's name, and the seconds spent waiting for it.
pub(crate) type Loaded = (Source, SampleSetId, f64);

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

impl Shared {
    /// The plan, if this node makes views in it.
    pub(crate) fn of_compositor(&self, plan: Arc<Assignment>) -> Result<Arc<Assignment>, Status> {
        if plan.composites(self.plan.node_name()) {
            return Ok(plan);
        }
        Err(Status::failed_precondition(format!(
            "{} makes no views in plan_epoch {}",
            self.plan.node_name(),
            plan.plan_epoch
        )))
    }

    /// Waits for the source of a cell's set.
    pub(crate) async fn source(&self, plan: &Arc<Assignment>, (set_index, cell): (u32, u32)) -> Result<Loaded, Status> {
        let start = Instant::now();
        let beyond = || Status::invalid_argument(format!("set_index {set_index} is beyond the timeline"));
        let id = plan.sample_set_id(set_index).ok_or_else(beyond)?;
        let source = match plan.policy {
            Policy::Pipeline | Policy::TimeShare => {
                Source::Set(self.sets.get(&CellPlan::of(plan, cell)?, set_index).await?)
            }
            Policy::Direct => Source::Scene {
                scene_hash: plan.workload.scene.hash.to_string(),
                lighting: plan.workload.lighting.clone(),
                scene_time_s: plan.workload.timeline.time_s(set_index).ok_or_else(beyond)?,
            },
        };
        Ok((source, id, start.elapsed().as_secs_f64()))
    }
}
