//! Sample sets on the device: complete or not there at all.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use node::{Connections, Deadlines, Engine, NodeMetrics, UploadedSet, blocking};
use tokio::sync::OnceCell;
use tonic::Status;
use wire::{Assignment, SetContent};

use crate::fetch::fetch_set;

/// The one that is shown and one that late views still need; besides those that are fetched ahead.
const KEPT_SETS: usize = 2;

/// A complete set, ready to be reconstructed from.
pub(crate) type ReadySet = Arc<dyn UploadedSet>;

type Cell = Arc<OnceCell<ReadySet>>;

/// The last few sets.
pub(crate) struct Sets {
    engine: Arc<dyn Engine>,
    connections: Arc<Connections>,
    deadlines: Deadlines,
    metrics: NodeMetrics,
    kept: Mutex<VecDeque<(SetContent, Cell)>>,
}

impl Sets {
    pub(crate) fn new(engine: Arc<dyn Engine>, deadlines: Deadlines, metrics: NodeMetrics) -> Self {
        Self { engine, connections: Arc::default(), deadlines, metrics, kept: Mutex::default() }
    }

    /// A set, once it is completely there; those after it are then fetched ahead, so that samplers
    /// work on them while this one is shown: as many as are sampled at once.
    pub(crate) async fn get(self: &Arc<Self>, plan: &Arc<Assignment>, set_index: u32) -> Result<ReadySet, Status> {
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
    fn fetch_ahead(self: &Arc<Self>, plan: &Arc<Assignment>, set_index: u32) {
        let last = plan.workload.timeline.set_count.saturating_sub(1);
        for next in set_index.saturating_add(1)..=last.min(set_index.saturating_add(plan.sets_at_once())) {
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
    async fn load(self: &Arc<Self>, plan: &Arc<Assignment>, set_index: u32) -> Result<ReadySet, Status> {
        let content = plan
            .set_content(set_index)
            .ok_or_else(|| Status::invalid_argument(format!("set_index {set_index} is beyond the timeline")))?;
        let cell = self.cell(content, KEPT_SETS + plan.sets_at_once() as usize);
        if let Some(set) = cell.get() {
            return Ok(set.clone());
        }
        let (sets, plan) = (self.clone(), plan.clone());
        let loading =
            tokio::spawn(
                async move { cell.get_or_try_init(|| sets.fetch_and_upload(&plan, set_index)).await.cloned() },
            );
        loading.await.map_err(|error| Status::internal(format!("loading a sample set failed: {error}")))?
    }

    async fn fetch_and_upload(&self, plan: &Arc<Assignment>, set_index: u32) -> Result<ReadySet, Status> {
        let start = Instant::now();
        let set = fetch_set(plan, set_index, &self.connections, self.deadlines).await?;
        let fetched_s = start.elapsed().as_secs_f64();
        let engine = self.engine.clone();
        let ready = blocking(move || engine.upload(&set)).await?;
        self.metrics.sets_loaded.inc();
        self.metrics.set_s.observe(start.elapsed().as_secs_f64());
        tracing::debug!(set_index, fetched_s, total_s = start.elapsed().as_secs_f64(), "sample set ready");
        Ok(ready)
    }

    fn cell(&self, content: SetContent, most: usize) -> Cell {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let at = kept.iter().position(|(other, _)| *other == content);
        let entry = at.and_then(|at| kept.remove(at)).unwrap_or_else(|| (content, Cell::default()));
        let cell = entry.1.clone();
        kept.push_back(entry);
        while kept.len() > most {
            kept.pop_front();
        }
        cell
    }
}
