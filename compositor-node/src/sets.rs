//! Sample sets on the device: complete or absent.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{Assignment, CommonCell, DIRECT, Policy, SceneRef, SetContent, Timeline, Workload};
use codec::EncodedImage;
use depth_image::{PinholeCamera, SampleCamera, nearest_set};
use node::{ByteCache, CellPlan, CommonSet, NodeParts, Operation, Pinned, SharedSet, Turn, WorkClass};
use node::{beyond_timeline, most_image_bytes, most_set_bytes, own_time, set_bytes};
use tonic::{Code, Status};
use wire::rpc::Messages;

use crate::fetch::Fetcher;
use crate::fetch_share::SetRequest;
use crate::relay_buffer::{RelayBuffer, RelayBuffers};
use crate::reports::Reports;

/// The set that is shown and one that late views still need, besides those that are fetched ahead.
const SETS_IN_USE: usize = 2;

/// While one set is sent and loaded, samplers should have another to work on.
const SETS_AHEAD: u32 = 2;
/// Sets of earlier moments that stay beside these: a client may ask again for what it has just seen. The next sets are made in
/// the memory of older ones: the system clears new memory page by page, in the time of a software device.
const EARLIER_SETS: usize = 4;
/// Times that a view's sets are waited for, where others evict some of them meanwhile.
const ATTEMPTS: usize = 16;
/// The first of these, after which they take turns.
const CALM_ATTEMPTS: usize = 3;
/// A set that was used within this time is not evicted for that of another cell ahead: a viewer's next pose needs it.
pub(crate) const RECENTLY: Duration = Duration::from_millis(500);

/// Sets that are fetched before views need them; where samplers take turns, one of each sampler. A timeline may have fewer.
fn sets_ahead(plan: &Assignment) -> u32 {
    let others = plan.workload.timeline.set_count.saturating_sub(1);
    plan.sets_at_once().max(SETS_AHEAD).min(others)
}

/// A complete set of one cell on the device.
pub(crate) struct ReadySet {
    /// The scene, which surfaces come from where the set has light in place of colour.
    pub(crate) scene: SceneRef,
    pub(crate) set: SharedSet,
    /// The time at which it was ready.
    pub(crate) since: Instant,
    pub(crate) content: SetContent,
    /// The cell that it was loaded for, in the plan of that time.
    pub(crate) cell: u32,
    /// What its images show, wherever their cameras are; `None` for a common cell's, from which alone no view is made.
    moment: Option<SetContent>,
    /// What its images show, whenever it is.
    subject: SetContent,
    cameras: Vec<PinholeCamera>,
    /// Its images for other compositors, where they ask this one.
    relay: Option<RelayBuffer>,
}

/// What views are reconstructed from. Clones share it.
#[derive(Clone)]
pub(crate) struct ViewSets {
    /// The set of their view cell.
    pub(crate) of_cell: Pinned<ReadySet>,
    /// The same on the device, with those of the common cells.
    pub(crate) on_device: SharedSet,
    _common: Vec<Pinned<ReadySet>>,
}

/// The content of a set without its cameras: equal for the sets of all view cells at one moment.
fn moment(plan: &Assignment, set_index: u32) -> Option<SetContent> {
    let workload = Workload { sample_cameras: Vec::new(), cell_first_indices: Vec::new(), ..plan.workload.clone() };
    SetContent::of(&workload, set_index)
}

/// The sets of one compositor: the latest few moments of each cell, as long as memory has room.
pub(crate) struct Sets {
    node: Arc<NodeParts>,
    fetcher: Arc<Fetcher>,
    reports: Reports,
    pub(crate) cached: ByteCache<SetContent, ReadySet>,
    relays: RelayBuffers,
    /// Held by a view that could not have all of its sets at once.
    assembling: tokio::sync::Mutex<()>,
}

impl Sets {
    /// Checks that a plan's samples have the planes that a method needs, where there are samples.
    pub(crate) fn check_method(&self, plan: &Assignment, method: &str) -> Result<(), Status> {
        let needed = self.node.engine.sample_planes(method)?;
        let is_drawn = plan.policy == Policy::Direct || method == DIRECT;
        if is_drawn || plan.workload.planes.contain(needed) {
            return Ok(());
        }
        let text = "needs planes that this workload does not sample; a session of this method does";
        Err(Status::invalid_argument(format!("reconstruction_method: {method} {text}")))
    }

    pub(crate) fn new(node: Arc<NodeParts>) -> Self {
        Self {
            fetcher: Arc::new(Fetcher::new(node.plans.clone(), node.config.deadlines)),
            reports: Reports::new(&node.config),
            // The other half is for packed images.
            cached: ByteCache::new("sample sets", node.config.set_memory_bytes / 2),
            node,
            relays: RelayBuffers::default(),
            assembling: tokio::sync::Mutex::default(),
        }
    }

    /// Relays the images of a set. Sets that were loaded before others asked are not kept for them: they ask the samplers.
    pub(crate) fn relay(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
    ) -> Result<Messages<(u32, EncodedImage)>, Status> {
        let content = content_of(plan, set_index)?;
        let relay = match self.cached.loaded(&content) {
            Some(set) => set.relay.clone(),
            None => Some(self.relays.of(content)),
        };
        let Some(relay) = relay.filter(|relay| !relay.has_failed()) else {
            return Err(Status::failed_precondition(format!("sample set {set_index} is not relayed")));
        };
        let images = relay.images();
        let sets = self.clone();
        let plan = plan.clone();
        // The first request begins the loading, whose end the stream of images tells. The set stays while images are sent.
        tokio::spawn(async move {
            let is_sent = async {
                let _in_use = sets.load(&plan, set_index, &[]).await?;
                relay.unwanted().await;
                Ok::<_, Status>(())
            };
            tokio::select! {
                sent = is_sent => drop(sent),
                () = relay.unwanted() => (),
            }
        });
        Ok(images)
    }

    /// Waits for the complete sets of a view cell and of all common cells; the sets after them are then fetched ahead, so that
    /// samplers work on them while these are shown. While it waits for one it keeps no other in memory: two that wait never
    /// wait for each other.
    pub(crate) async fn of_views(
        self: &Arc<Self>,
        plan: &Arc<Assignment>,
        set_index: u32,
        cell: u32,
    ) -> Result<ViewSets, Status> {
        let of_cell = CellPlan::of(plan, cell)?;
        let common = CellPlan::of_common(plan);
        self.check_room(&of_cell, &common)?;
        // Where samplers take turns, those of later sets need not wait for this one's.
        let in_turn = of_cell.sets_at_once() > 1;
        if in_turn {
            self.fetch_ahead(&of_cell, &common, set_index);
        }
        let mut _turn = None;
        for attempt in 0..ATTEMPTS {
            // Views that evict each other's sets go one after the other.
            if attempt == CALM_ATTEMPTS {
                _turn = Some(self.assembling.lock().await);
            }
            let set = self.load(&of_cell, set_index, &common).await?;
            if let Some(sets) = self.with_common(set, &common, set_index)? {
                if !in_turn {
                    self.fetch_ahead(&of_cell, &common, set_index);
                }
                return Ok(sets);
            }
            for (_, cell) in &common {
                self.load(cell, set_index, &[]).await?;
            }
        }
        Err(Status::resource_exhausted(format!("set-memory: other views need the room of sample set {set_index}")))
    }

    /// A view's sets fit into memory together, or never will.
    fn check_room(&self, of_cell: &CellPlan, common: &[(CommonCell, CellPlan)]) -> Result<(), Status> {
        let bytes = self.most_bytes(of_cell) + self.most_bytes_of(common);
        let max_bytes = self.cached.max_bytes();
        if common.is_empty() || bytes <= max_bytes {
            return Ok(());
        }
        let reason = format!("set-memory: {bytes} bytes of a view's sample sets exceed the {max_bytes} of this node");
        Err(Status::resource_exhausted(reason))
    }

    fn most_bytes_of(&self, common: &[(CommonCell, CellPlan)]) -> usize {
        common.iter().map(|(_, cell)| self.most_bytes(cell)).sum()
    }

    /// A view cell's set with those of the common cells of its moment; `None` where one of these is not loaded.
    pub(crate) fn with_common(
        &self,
        of_cell: Pinned<ReadySet>,
        common: &[(CommonCell, CellPlan)],
        set_index: u32,
    ) -> Result<Option<ViewSets>, Status> {
        let mut sets: Vec<CommonSet> = Vec::new();
        let mut in_use = Vec::new();
        for (cell, plan) in common {
            let ready = plan.set_content(set_index).and_then(|content| self.cached.loaded(&content));
            let Some(ready) = ready else { return Ok(None) };
            sets.push((cell.clone(), ready.set.clone()));
            in_use.push(ready);
        }
        let on_device = match sets.is_empty() {
            true => of_cell.set.clone(),
            false => self.node.engine.with_common(of_cell.set.clone(), sets)?,
        };
        Ok(Some(ViewSets { of_cell, on_device, _common: in_use }))
    }

    /// The loaded set of the same moment whose cameras are nearest to a view.
    pub(crate) fn nearest(&self, plan: &Assignment, set_index: u32, view: &PinholeCamera) -> Option<Pinned<ReadySet>> {
        let moment = moment(plan, set_index)?;
        let mut sets = self.cached.loaded_where(|set| set.moment == Some(moment));
        let nearest = nearest_set(view, sets.iter().map(|set| set.cameras.clone()), &plan.workload.volume)?;
        Some(sets.swap_remove(nearest))
    }

    /// Begins to load the sets after one, moment by moment, as far as memory has room.
    fn fetch_ahead(self: &Arc<Self>, of_cell: &CellPlan, common: &[(CommonCell, CellPlan)], set_index: u32) {
        let last = of_cell.workload.timeline.set_count.saturating_sub(1);
        let bytes = self.most_bytes(of_cell) + self.most_bytes_of(common);
        let room = self.cached.max_bytes() / bytes.max(1);
        let ahead = sets_ahead(of_cell).min(u32::try_from(room.saturating_sub(SETS_IN_USE)).unwrap_or(u32::MAX));
        for next in set_index.saturating_add(1)..=last.min(set_index.saturating_add(ahead)) {
            if of_cell.set_content(next) != of_cell.set_content(set_index) {
                for cell in [of_cell].into_iter().chain(common.iter().map(|(_, cell)| cell)) {
                    self.load_ahead(cell, next, Duration::ZERO);
                }
            }
        }
    }

    /// The number of further view cells of a moment for which memory has room: more would evict the sets in use.
    pub(crate) fn room_ahead(&self, of_cell: &CellPlan, common: &[(CommonCell, CellPlan)]) -> usize {
        let free_bytes = self.cached.max_bytes().saturating_sub(self.most_bytes_of(common));
        let room = free_bytes / self.most_bytes(of_cell).max(1);
        room.saturating_sub(SETS_IN_USE)
    }

    /// Begins to load the set of a cell that no view needs yet, where it has room beside sets that were used within `recently`;
    /// gives its content if it is loaded or being loaded.
    pub(crate) fn load_ahead(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        recently: Duration,
    ) -> Option<SetContent> {
        let content = plan.set_content(set_index)?;
        let loading = self.loading(plan, set_index, content);
        self.cached.load_ahead(content, self.most_bytes(plan), recently, loading).then_some(content)
    }

    /// A load that another workload's plan began may end with that plan. This plan, if it is in force, then begins its own.
    /// The sets of `beside` are begun to be loaded meanwhile, as far as memory has room.
    async fn load(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        beside: &[(CommonCell, CellPlan)],
    ) -> Result<Pinned<ReadySet>, Status> {
        let content = content_of(plan, set_index)?;
        // It is about to be used: what is loaded beside it must not evict it.
        let _in_use = self.cached.loaded(&content);
        for (_, other) in beside {
            self.load_ahead(other, set_index, Duration::ZERO);
        }
        let load = || self.cached.get(content, self.most_bytes(plan), self.loading(plan, set_index, content));
        match load().await {
            Err(status) if status.code() == Code::FailedPrecondition => {
                let in_force = self.node.plans.in_force(plan.workload_number);
                let is_in_force = in_force.is_some_and(|in_force| in_force.plan_epoch == plan.plan_epoch);
                if is_in_force { load().await } else { Err(status) }
            }
            loaded => loaded,
        }
    }

    /// The most bytes of a cell's set, with its images for others.
    fn most_bytes(&self, plan: &CellPlan) -> usize {
        let relayed = plan.relays(&self.node.plans.node_name);
        let illumination = &plan.workload.illumination;
        let cameras = &*plan.workload.sample_cameras;
        let packed = if relayed { most_image_bytes(illumination, cameras) } else { 0 };
        most_set_bytes(illumination, cameras) + packed
    }

    fn loading(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        content: SetContent,
    ) -> impl Future<Output = Result<(ReadySet, usize), Status>> + Send + 'static {
        let sets = self.clone();
        let plan = plan.clone();
        async move {
            let loaded = sets.fetch_and_upload(&plan, set_index, content).await;
            if let Err(status) = &loaded {
                tracing::debug!(set_index, reason = status.message(), "a sample set was not loaded");
            }
            loaded
        }
    }

    async fn fetch_and_upload(
        &self,
        plan: &CellPlan,
        set_index: u32,
        content: SetContent,
    ) -> Result<(ReadySet, usize), Status> {
        let start = Instant::now();
        let relay = plan.relays(&self.node.plans.node_name).then(|| self.relays.of(content));
        let relay = relay.filter(|relay| !relay.has_failed());
        let request = SetRequest { plan: plan.clone(), set_index, relay: relay.clone() };
        let (set, times) = self.fetcher.fetch(&request).await.map_err(|failed| {
            self.reports.report(plan.plan_epoch, &failed);
            failed.status
        })?;
        let still = Workload { timeline: Timeline::still(0.0), refinement_steps: 1, ..plan.workload.clone() };
        let subject = SetContent::of(&still, 0).ok_or_else(|| beyond_timeline(set_index))?;
        let latest = SETS_IN_USE + sets_ahead(plan) as usize + EARLIER_SETS;
        self.cached.keep_latest(latest - 1, |set| set.subject == subject);
        let bytes = set_bytes(&set.images) + relay.as_ref().map_or(0, RelayBuffer::bytes);
        let fetched_s = start.elapsed().as_secs_f64();
        let set = Arc::new(set);
        let uploading = self.node.on_device(&plan.workload.scene, move |engine| {
            let (set, upload_s) = own_time(engine, || engine.upload(&set, Turn::of(WorkClass::Batch)));
            Ok((set?, upload_s))
        });
        let (set, upload_s) = uploading.await?;
        self.node.metrics.done.add(plan.workload_number, Operation::LoadSet, 1.0, times.decode_s + upload_s);
        self.node.metrics.done.transferred(plan.workload_number, times.bytes, times.transfer_s);
        self.node.metrics.sets_loaded.inc();
        self.node.metrics.set_s.observe(start.elapsed().as_secs_f64());
        tracing::debug!(set_index, fetched_s, total_s = start.elapsed().as_secs_f64(), "sample set ready");
        let moment = moment(plan, set_index).filter(|_| !plan.is_common);
        let cameras = SampleCamera::references(&plan.workload.sample_cameras);
        let since = Instant::now();
        let cell = plan.cell;
        let scene = plan.workload.scene.clone();
        Ok((ReadySet { set, scene, since, content, cell, moment, subject, cameras, relay }, bytes))
    }
}

fn content_of(plan: &CellPlan, set_index: u32) -> Result<SetContent, Status> {
    plan.set_content(set_index).ok_or_else(|| beyond_timeline(set_index))
}
