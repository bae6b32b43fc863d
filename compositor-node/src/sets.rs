//! Sample sets on the device: complete or not there at all.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use cluster::{Assignment, SetContent};
use codec::EncodedDepthImage;
use node::{CellPlan, CurrentPlan, Engine, NodeConfig, NodeMetrics, Operation, Relay, UploadedSet, blocking};
use tokio::sync::OnceCell;
use tonic::{Status, async_trait};
use wire::rpc::Messages;

use crate::fetch::{Fetched, Fetcher};
use crate::passing::Passing;
use crate::reports::Reports;

/// The one that is shown and one that late views still need; besides those that are fetched ahead.
const KEPT_SETS: usize = 2;

/// While one travels and is loaded, samplers should have another to work on.
const SETS_AHEAD: u32 = 2;

/// Sets that are asked for before views need them; where sets are sampled in turn, one of each sampler. A timeline may have
/// fewer.
fn sets_ahead(plan: &Assignment) -> u32 {
    let others = plan.workload.timeline.set_count.saturating_sub(1);
    plan.sets_at_once().max(SETS_AHEAD).min(others)
}

/// Of every view cell as many: views of all of them come in turn.
fn most_kept(plan: &CellPlan) -> usize {
    (KEPT_SETS + sets_ahead(plan) as usize) * plan.cell_count()
}

/// A complete set, ready to be reconstructed from.
#[derive(Clone)]
pub(crate) struct ReadySet {
    pub(crate) set: Arc<dyn UploadedSet>,
    /// When it was.
    pub(crate) since: Instant,
}

/// A set on the device, and what of it is passed on.
#[derive(Clone, Default)]
struct Slot {
    ready: Arc<OnceCell<ReadySet>>,
    passing: Passing,
}

/// The last few sets.
pub(crate) struct Sets {
    engine: Arc<dyn Engine>,
    node_name: String,
    fetcher: Arc<Fetcher>,
    metrics: NodeMetrics,
    current: CurrentPlan,
    reports: Reports,
    kept: Mutex<VecDeque<(SetContent, Slot)>>,
}

/// Passes on what the sets of this node are loaded from.
pub(crate) struct SetRelay(pub(crate) Arc<Sets>);

#[async_trait]
impl Relay for SetRelay {
    async fn images(&self, plan: &CellPlan, set_index: u32) -> Result<Messages<(u32, EncodedDepthImage)>, Status> {
        let images = self.0.passed_on(plan, set_index)?;
        let (sets, plan) = (self.0.clone(), plan.clone());
        // Whoever asks first begins the loading; it tells those who listen how it ends.
        tokio::spawn(async move { sets.load(&plan, set_index).await.map(drop) });
        Ok(images)
    }
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
            node_name: config.node_name.clone(),
            fetcher: Arc::new(Fetcher::new(&config.node_name, config.deadlines)),
            metrics,
            current,
            reports: Reports::new(config),
            kept: Mutex::default(),
        }
    }

    /// What was loaded before others asked is not kept for them: they ask the samplers.
    fn passed_on(&self, plan: &CellPlan, set_index: u32) -> Result<Messages<(u32, EncodedDepthImage)>, Status> {
        let beyond = || Status::invalid_argument(format!("set_index {set_index} is beyond the timeline"));
        let content = plan.set_content(set_index).ok_or_else(beyond)?;
        let slot = self.slot(content, most_kept(plan));
        if (slot.ready.initialized() && slot.passing.is_empty()) || slot.passing.has_failed() {
            return Err(Status::failed_precondition(format!("sample set {set_index} is not passed on")));
        }
        Ok(slot.passing.images())
    }

    /// A set, once it is completely there; those after it are then fetched ahead, so that samplers
    /// work on them while this one is shown.
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

    /// Where sets are sampled in turn, the others' samplers need not wait for this one's.
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

    /// Loads once, however many wait; goes on when the first of them leaves.
    async fn load(self: &Arc<Self>, plan: &CellPlan, set_index: u32) -> Result<ReadySet, Status> {
        let content = plan
            .set_content(set_index)
            .ok_or_else(|| Status::invalid_argument(format!("set_index {set_index} is beyond the timeline")))?;
        let slot = self.slot(content, most_kept(plan));
        if let Some(set) = slot.ready.get() {
            return Ok(set.clone());
        }
        let (sets, plan) = (self.clone(), plan.clone());
        let loading = tokio::spawn(async move {
            let load = || sets.fetch_and_upload(&plan, set_index, &slot.passing);
            let loaded = slot.ready.get_or_try_init(load).await.cloned();
            if loaded.is_err() {
                sets.forget(&content);
            }
            loaded
        });
        loading.await.map_err(|error| Status::internal(format!("loading a sample set failed: {error}")))?
    }

    async fn fetch_and_upload(&self, plan: &CellPlan, set_index: u32, passing: &Passing) -> Result<ReadySet, Status> {
        let start = Instant::now();
        let passing = plan.relays(&self.node_name).then_some(passing).filter(|passing| !passing.has_failed());
        let fetched = self.fetch(plan, set_index, passing).await?;
        let (fetched_s, took, set) = (start.elapsed().as_secs_f64(), fetched.took, fetched.set);
        let (engine, uploading) = (self.engine.clone(), Instant::now());
        let set = blocking(move || engine.upload(&set)).await?;
        self.metrics.done.add(Operation::LoadSet, 1.0, took.decode_s + uploading.elapsed().as_secs_f64());
        self.metrics.done.transferred(took.bytes, took.transfer_s);
        self.metrics.sets_loaded.inc();
        self.metrics.set_s.observe(start.elapsed().as_secs_f64());
        tracing::debug!(set_index, fetched_s, total_s = start.elapsed().as_secs_f64(), "sample set ready");
        Ok(ReadySet { set, since: Instant::now() })
    }

    /// A set that failed is begun anew by the next who asks.
    fn forget(&self, content: &SetContent) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(other, slot)| other != content || slot.ready.initialized());
    }

    /// Stops when a later plan is in force: a sampler that is not of it may be gone without a word.
    async fn fetch(&self, plan: &CellPlan, set_index: u32, passing: Option<&Passing>) -> Result<Fetched, Status> {
        let fetched = tokio::select! {
            fetched = self.fetcher.fetch(plan, set_index, passing) => fetched,
            () = self.current.replaced(plan.plan_epoch) => {
                return Err(Status::failed_precondition(format!("plan_epoch {} was replaced", plan.plan_epoch)));
            }
        };
        fetched.map_err(|failed| {
            self.reports.tell(plan.plan_epoch, &failed);
            failed.status
        })
    }

    fn slot(&self, content: SetContent, most: usize) -> Slot {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let at = kept.iter().position(|(other, _)| *other == content);
        let entry = at.and_then(|at| kept.remove(at)).unwrap_or_else(|| (content, Slot::default()));
        let slot = entry.1.clone();
        kept.push_back(entry);
        while kept.len() > most {
            kept.pop_front();
        }
        slot
    }
}
