//! Everything that the streams of one compositor share.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Instant;

use cluster::{Assignment, DIRECT, Policy, RenderViews};
use depth_image::PinholeCamera;
use node::{CellPlan, NodeParts, Pinned, beyond_timeline};
use tonic::Status;

use crate::batch::{BatchKey, Loaded, Place, Source, Waiting};
use crate::outbox::Outbox;
use crate::queue::{Arrivals, Lane};
use crate::quota::NodeQuota;
use crate::sets::{RECENTLY, ReadySet, Sets, ViewSets};
use crate::view_times::{ViewKind, ViewTimes};

/// A live view that takes longer has a lane beside that of others.
const LONG_LIVE_S: f64 = 0.1;
/// The same for views of batches.
const LONG_BATCH_S: f64 = 1.0;
/// Pixels of a view from which on it counts as long where its time is not known yet.
const LONG_PIXELS: u32 = 1 << 20;

/// The parts that all streams share.
pub(crate) struct Shared {
    pub(crate) node: Arc<NodeParts>,
    pub(crate) sets: Arc<Sets>,
    pub(crate) arrivals: Arc<Arrivals>,
    pub(crate) quota: NodeQuota,
    pub(crate) times: Arc<ViewTimes>,
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
    /// Hands views over to the lanes of the device.
    pub(crate) fn queue(&self, is_live: bool, views: Vec<Waiting>) {
        let mut by_lane = BTreeMap::<Lane, Vec<Waiting>>::new();
        for waiting in views {
            let Waiting { key, view, .. } = &waiting;
            tracing::debug!(stream = self.stream, frame = view.frame, set = %key.sample_set_id, "queued");
            by_lane.entry(self.shared.lane(is_live, key)).or_default().push(waiting);
        }
        for (lane, views) in by_lane {
            self.shared.arrivals.push(lane, self.stream, views);
        }
    }
}

/// However a call ends, nothing of it is left.
impl Drop for ClientStream {
    fn drop(&mut self) {
        let metrics = &self.shared.node.metrics;
        self.shared.arrivals.withdraw(self.stream).iter().for_each(|_| metrics.drop_view("client gone"));
        metrics.done.viewer_left(self.stream);
        metrics.streams.dec();
    }
}

impl Shared {
    fn lane(&self, is_live: bool, key: &BatchKey) -> Lane {
        if key.is_preview {
            return Lane::Preview;
        }
        if key.method == DIRECT
            && self.node.plans.in_force(key.workload_number).is_some_and(|plan| plan.policy != Policy::Direct)
        {
            return Lane::Direct;
        }
        let limit_s = if is_live { LONG_LIVE_S } else { LONG_BATCH_S };
        let is_long = match self.times.predicted_s(&key.kind(), key.size_px) {
            Some(seconds) => seconds > limit_s,
            None => key.size_px.element_product().saturating_mul(key.planes.antialias.samples()) > LONG_PIXELS,
        };
        match (is_live, is_long) {
            (true, true) => Lane::LongLive,
            (true, false) => Lane::Live,
            (false, true) => Lane::LongBatch,
            (false, false) => Lane::Batch,
        }
    }

    /// Checks that no view of a request takes too long or too much memory.
    pub(crate) fn check_views(&self, plan: &Assignment, request: &RenderViews) -> Result<(), Status> {
        let method = if plan.policy == Policy::Direct { DIRECT } else { &request.method };
        let antialias = request.planes.antialias;
        let kind = ViewKind { workload_number: plan.workload_number, method: method.to_owned(), antialias };
        let Some(largest) = request.views.iter().map(|view| view.camera).max_by_key(PinholeCamera::pixel_count) else {
            return Ok(());
        };
        self.quota.limits.check_views(&[largest], request.planes)?;
        self.times.check(Instant::now(), &kind, largest.size_px)
    }

    /// The plan for views by a method, if this node makes views in it. Views that are drawn from the scene ignore the plan's
    /// policy.
    pub(crate) fn of_compositor(&self, plan: Arc<Assignment>, method: &str) -> Result<Arc<Assignment>, Status> {
        let name = &self.node.plans.node_name;
        if !plan.composites(name) {
            let plan_epoch = plan.plan_epoch;
            return Err(Status::failed_precondition(format!("{name} makes no views in plan_epoch {plan_epoch}")));
        }
        self.sets.check_method(&plan, method)?;
        if method != DIRECT || plan.policy == Policy::Direct {
            return Ok(plan);
        }
        Ok(Arc::new(Assignment { policy: Policy::Direct, ..(*plan).clone() }))
    }

    /// Waits for the source of a cell's set.
    pub(crate) async fn source(&self, plan: &Arc<Assignment>, set_index: u32, cell: u32) -> Result<Loaded, Status> {
        let start = Instant::now();
        let id = plan.sample_set_id(set_index).ok_or_else(|| beyond_timeline(set_index))?;
        let (source, content) = match plan.policy {
            Policy::Pipeline | Policy::TimeShare => {
                let sets = self.sets.of_views(plan, set_index, cell).await?;
                let content = sets.of_cell.content;
                (Source::Sets(sets), Some(content))
            }
            Policy::Direct => (scene(plan, set_index)?, None),
        };
        let place = Place { id, cell, is_neighbour: false, content };
        Ok(Loaded { source, place, wait_s: start.elapsed().as_secs_f64() })
    }

    /// Begins to fetch the sets of cells, one after the other while memory has room.
    pub(crate) fn begin_to_load(&self, plan: &Arc<Assignment>, set_index: u32, cells: impl Iterator<Item = u32>) {
        if plan.policy != Policy::Direct {
            let common = CellPlan::of_common(plan);
            let plans = cells.map_while(|cell| CellPlan::of(plan, cell).ok()).enumerate();
            let plans = plans.take_while(|(ahead, plan)| *ahead <= self.sets.room_ahead(plan, &common));
            plans.map_while(|(_, plan)| self.sets.load_ahead(&plan, set_index, RECENTLY)).for_each(drop);
        }
    }

    /// The source of a place, if it is still there; it is not waited for.
    pub(crate) fn source_at(&self, plan: &Arc<Assignment>, set_index: u32, place: Place) -> Option<Source> {
        match place.content {
            Some(content) => self.with_common(self.sets.cached.loaded(&content)?, plan, set_index).map(Source::Sets),
            None => scene(plan, set_index).ok(),
        }
    }

    /// The set of a cell, if it is loaded.
    pub(crate) fn loaded(&self, plan: &Arc<Assignment>, set_index: u32, cell: u32) -> Option<Loaded> {
        let id = plan.sample_set_id(set_index)?;
        let set = self.sets.cached.loaded(&CellPlan::of(plan, cell).ok()?.set_content(set_index)?)?;
        let place = Place { id, cell, is_neighbour: false, content: Some(set.content) };
        Some(Loaded { source: Source::Sets(self.with_common(set, plan, set_index)?), place, wait_s: 0.0 })
    }

    /// A set with those of common cells; `None` where one is not loaded.
    fn with_common(&self, set: Pinned<ReadySet>, plan: &Arc<Assignment>, set_index: u32) -> Option<ViewSets> {
        self.sets.with_common(set, &CellPlan::of_common(plan), set_index).ok().flatten()
    }

    /// What shows a view until its own set is there: the nearest loaded set of its moment, or the scene itself where views take
    /// their surfaces from it.
    pub(crate) fn meanwhile(&self, plan: &Arc<Assignment>, set_index: u32, view: &PinholeCamera) -> Option<Loaded> {
        let id = plan.sample_set_id(set_index).filter(|_| plan.policy != Policy::Direct)?;
        let Some(set) = self.sets.nearest(plan, set_index, view) else {
            let source = plan.workload.planes.light.then(|| scene(plan, set_index).ok()).flatten()?;
            let place = Place { id, cell: plan.cell_of(view), is_neighbour: true, content: None };
            return Some(Loaded { source, place, wait_s: 0.0 });
        };
        let place = Place { id, cell: set.cell, is_neighbour: true, content: Some(set.content) };
        Some(Loaded { source: Source::Sets(self.with_common(set, plan, set_index)?), place, wait_s: 0.0 })
    }
}

fn scene(plan: &Arc<Assignment>, set_index: u32) -> Result<Source, Status> {
    let scene_time_s = plan.workload.timeline.time_s(set_index).ok_or_else(|| beyond_timeline(set_index))?;
    Ok(Source::Scene { plan: plan.clone(), scene_time_s })
}
