//! Sample sets on the device: complete or absent.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use cluster::{Assignment, SetContent};
use codec::EncodedDepthImage;
use node::{CellPlan, CurrentPlan, Engine, NodeConfig, NodeMetrics, Operation, SampleSet, Turn, UploadedSet};
use node::{WorkClass, beyond_timeline, blocking};
use parking_lot::Mutex;
use tokio::sync::OnceCell;
use tonic::Status;
use wire::rpc::Messages;

use crate::fetch::Fetcher;
use crate::fetch_share::{FetchTimes, SetRequest};
use crate::relay_buffer::RelayBuffer;
use crate::reports::Reports;

/// The set that is shown and one that late views still need, besides those that are fetched ahead.
const SETS_IN_USE: usize = 2;

/// While one set is sent and loaded, samplers should have another to work on.
const SETS_AHEAD: u32 = 2;

/// Sets that are fetched before views need them; where samplers take turns, one of each sampler. A timeline may have fewer.
fn sets_ahead(plan: &Assignment) -> u32 {
    let others = plan.workload.timeline.set_count.saturating_sub(1);
    plan.sets_at_once().max(SETS_AHEAD).min(others)
}

/// A complete set, ready to be reconstructed from.
#[derive(Clone)]
pub(crate) struct ReadySet {
    pub(crate) set: Arc<dyn UploadedSet>,
    /// The time at which it was ready.
    pub(crate) since: Instant,
}

/// A set on the device, and its images for other compositors.
#[derive(Clone, Default)]
struct Slot {
    ready: Arc<OnceCell<ReadySet>>,
    relay: RelayBuffer,
}

/// The sets of one compositor, the latest few cached.
pub(crate) struct Sets {
    engine: Arc<dyn Engine>,
    fetcher: Arc<Fetcher>,
    metrics: NodeMetrics,
    current: CurrentPlan,
    reports: Reports,
    cached: Mutex<VecDeque<(SetContent, Slot)>>,
}

impl Sets {
    pub(crate) fn new(
        engine: Arc<dyn Engine>,
        current: CurrentPlan,
        config: &NodeConfig,
        metrics: NodeMetrics,
    ) -> Self {
        Self {
            engine,
            fetcher: Arc::new(Fetcher::new(&config.node_name, config.deadlines)),
            metrics,
            current,
            reports: Reports::new(config),
            cached: Mutex::default(),
        }
    }

    /// Relays the images of a set. Sets that were loaded before others asked are not kept for them: they ask the samplers.
    pub(crate) fn relay(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
    ) -> Result<Messages<(u32, EncodedDepthImage)>, Status> {
        let (_, slot) = self.slot(plan, set_index)?;
        if (slot.ready.initialized() && slot.relay.is_empty()) || slot.relay.has_failed() {
            return Err(Status::failed_precondition(format!("sample set {set_index} is not relayed")));
        }
        let (images, sets, plan) = (slot.relay.images(), self.clone(), plan.clone());
        // The first request begins the loading, whose end the stream of images tells.
        tokio::spawn(async move { sets.load(&plan, set_index).await.map(drop) });
        Ok(images)
    }

    /// Waits for a complete set; the sets after it are then fetched ahead, so that samplers work on them while this one is
    /// shown.
    pub(crate) async fn get(self: &Arc<Self>, plan: &CellPlan, set_index: u32) -> Result<ReadySet, Status> {
        let in_turn = plan.sets_at_once() > 1;
        if in_turn {
            self.fetch_ahead(plan, set_index);
        }
        let set = self.load(plan, set_index).await?;
        if !in_turn {
            self.fetch_ahead(plan, set_index);
        }
        Ok(set)
    }

    /// Where samplers take turns, those of later sets need not wait for this one's.
    fn fetch_ahead(self: &Arc<Self>, plan: &CellPlan, set_index: u32) {
        let last = plan.workload.timeline.set_count.saturating_sub(1);
        for next in set_index.saturating_add(1)..=last.min(set_index.saturating_add(sets_ahead(plan))) {
            if plan.set_content(next) == plan.set_content(set_index) {
                continue;
            }
            let (sets, plan) = (self.clone(), plan.clone());
            tokio::spawn(async move {
                if let Err(status) = sets.load(&plan, next).await {
                    tracing::debug!(set_index = next, reason = status.message(), "not fetched ahead");
                }
            });
        }
    }

    /// Loads a set once for all that wait for it; loading goes on when the first of them leaves.
    async fn load(self: &Arc<Self>, plan: &CellPlan, set_index: u32) -> Result<ReadySet, Status> {
        let (content, slot) = self.slot(plan, set_index)?;
        if let Some(set) = slot.ready.get() {
            return Ok(set.clone());
        }
        let (sets, plan) = (self.clone(), plan.clone());
        let loading = tokio::spawn(async move {
            let load = || sets.fetch_and_upload(&plan, set_index, &slot.relay);
            let loaded = slot.ready.get_or_try_init(load).await.cloned();
            if loaded.is_err() {
                sets.remove_failed(&content);
            }
            loaded
        });
        loading.await.map_err(|error| Status::internal(format!("loading a sample set failed: {error}")))?
    }

    async fn fetch_and_upload(&self, plan: &CellPlan, set_index: u32, relay: &RelayBuffer) -> Result<ReadySet, Status> {
        let start = Instant::now();
        let relay = Some(relay).filter(|relay| plan.relays(&self.current.node_name) && !relay.has_failed());
        let request = SetRequest { plan: plan.clone(), set_index, relay: relay.cloned() };
        let (set, times) = self.fetch(&request).await?;
        let fetched_s = start.elapsed().as_secs_f64();
        let (engine, uploading) = (self.engine.clone(), Instant::now());
        let set = blocking(move || engine.upload(&set, Turn::of(WorkClass::Batch))).await?;
        self.metrics.done.add(Operation::LoadSet, 1.0, times.decode_s + uploading.elapsed().as_secs_f64());
        self.metrics.done.transferred(times.bytes, times.transfer_s);
        self.metrics.sets_loaded.inc();
        self.metrics.set_s.observe(start.elapsed().as_secs_f64());
        tracing::debug!(set_index, fetched_s, total_s = start.elapsed().as_secs_f64(), "sample set ready");
        Ok(ReadySet { set, since: Instant::now() })
    }

    /// Removes a set that failed: the next request loads it again.
    fn remove_failed(&self, content: &SetContent) {
        self.cached.lock().retain(|(other, slot)| other != content || slot.ready.initialized());
    }

    /// Stops when a later plan is in force: a sampler without a place in it may be lost without a word.
    async fn fetch(&self, request: &SetRequest) -> Result<(SampleSet, FetchTimes), Status> {
        let plan_epoch = request.plan.plan_epoch;
        let fetched = tokio::select! {
            fetched = self.fetcher.fetch(request) => fetched,
            () = self.current.replaced(plan_epoch) => {
                return Err(Status::failed_precondition(format!("plan_epoch {plan_epoch} was replaced")));
            }
        };
        fetched.map_err(|failed| {
            self.reports.report(plan_epoch, &failed);
            failed.status
        })
    }

    /// A set's content and its slot, new or cached; evicts the sets that were used longest ago. As many sets of every view
    /// cell stay cached, since views of all cells take turns.
    fn slot(&self, plan: &CellPlan, set_index: u32) -> Result<(SetContent, Slot), Status> {
        let content = plan.set_content(set_index).ok_or_else(|| beyond_timeline(set_index))?;
        let max_cached = (SETS_IN_USE + sets_ahead(plan) as usize) * plan.cell_count;
        let mut cached = self.cached.lock();
        let at = cached.iter().position(|(other, _)| *other == content);
        let entry = at.and_then(|at| cached.remove(at)).unwrap_or_else(|| (content, Slot::default()));
        cached.push_back(entry.clone());
        while cached.len() > max_cached {
            cached.pop_front();
        }
        Ok(entry)
    }
}
