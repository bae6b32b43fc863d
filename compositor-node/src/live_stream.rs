//! A stream that follows a moving camera: the newest pose counts.
//!
//! A pose waits for its set, for its client to take a frame, and for the device. A stream has one pose at most in each of
//! these places, and a newer one replaces it. A set that is being fetched is never given up for a newer one. Where sets
//! arrive more slowly than poses, every set is shown, with its newest pose.
//!
//! A viewer that moves to another view cell waits only for a moment: until the set of that cell is there, the nearest loaded
//! set of the same scene time serves. Where samples hold light, no viewer in motion waits for the first set either: views are
//! drawn from the scene with few rays until it is there.

use std::pin::Pin;
use std::sync::Arc;
use std::time::Instant;

use cluster::{Assignment, DIRECT, Policy, RenderViews, RequestedView, SetContent};
use depth_image::PinholeCamera;
use node::{CellPlan, next_within, view_bytes};
use tokio::sync::Semaphore;
use tonic::Status;
use wire::rpc::Messages;

use crate::batch::{Loaded, Place, Waiting};
use crate::course::Course;
use crate::outbox::Reply;
use crate::quota::{Credit, closed, wait_for};
use crate::sets::RECENTLY;
use crate::shared::ClientStream;

/// Frames that may be in flight until the client acknowledges them: a third would only be older.
const CREDITS: usize = 2;

type Pending<T> = Pin<Box<dyn Future<Output = Result<T, Status>> + Send>>;

/// A view that was requested.
struct Pose {
    request: RenderViews,
    view: RequestedView,
    plan: Arc<Assignment>,
    cell: u32,
    arrived: Instant,
}

impl Pose {
    fn shows_set_of(&self, other: &Self) -> bool {
        self.plan_and_cell() == other.plan_and_cell() && self.request.set_index == other.request.set_index
    }

    fn plan_and_cell(&self) -> (u64, u32) {
        (self.plan.plan_epoch, self.cell)
    }

    fn bytes(&self) -> usize {
        view_bytes(&self.view.camera, self.request.planes)
    }

    fn has_cells(&self) -> bool {
        self.plan.policy != Policy::Direct && self.plan.workload.view_cell_count() > 1
    }
}

/// A set that is being fetched.
struct Fetch {
    /// The newest pose that it is for; `None` once another set has served it.
    pose: Option<Pose>,
    work: Pending<Loaded>,
}

/// A pose whose set is ready. While it waits for room, nothing keeps the set in memory: a client that takes no frames would
/// keep it there.
struct Ready {
    pose: Pose,
    place: Place,
    wait_s: f64,
    /// The wait for room.
    credit: Pending<Credit>,
}

pub(crate) struct LiveStream<'a> {
    client: &'a ClientStream,
    reply: Reply,
    credits: Arc<Semaphore>,
    /// The newest pose, whose set is not being fetched yet.
    newest: Option<Pose>,
    loading: Option<Fetch>,
    ready: Option<Ready>,
    last_frame: Option<u64>,
    /// The plan and the cell of the last set that was its pose's own; `None` before the first, which is waited for.
    own: Option<(u64, u32)>,
    /// The time since which no pose has found its own set.
    without_set: Option<Instant>,
    /// Whether neighbours have been tried since something changed.
    has_tried: bool,
    /// The last view that was drawn from the scene until its set is there: it is not drawn again.
    previewed: Option<PinholeCamera>,
    course: Course,
    /// The last set that was fetched without being waited for.
    aside: Option<SetContent>,
    /// Counts it as open.
    _viewer: Arc<()>,
    /// The device cuts long work into slices meanwhile.
    _on_device: Box<dyn std::any::Any + Send + Sync>,
}

impl<'a> LiveStream<'a> {
    pub(crate) fn new(client: &'a ClientStream, reply: Reply) -> Self {
        client.outbox.set_live();
        Self {
            client,
            reply,
            credits: Arc::new(Semaphore::new(CREDITS)),
            newest: None,
            loading: None,
            ready: None,
            last_frame: None,
            own: None,
            without_set: None,
            has_tried: false,
            previewed: None,
            course: Course::default(),
            aside: None,
            _viewer: client.shared.arrivals.viewers.clone(),
            _on_device: client.shared.node.engine.live_stream(),
        }
    }

    pub(crate) async fn answer(
        mut self,
        first: RenderViews,
        mut requests: Messages<RenderViews>,
    ) -> Result<(), Status> {
        let idle = self.client.shared.node.config.deadlines.idle;
        let mut is_open = true;
        self.accept(first)?;
        while is_open || self.newest.is_some() || self.loading.is_some() || self.ready.is_some() {
            self.fetch_next();
            let patience = self.patience_ends();
            tokio::select! {
                biased;
                request = next_within(&mut requests, idle, "poses"), if is_open => match request? {
                    Some(request) => self.accept(request)?,
                    None => is_open = false,
                },
                set = wait_for(self.loading.as_mut().map(|fetch| &mut fetch.work)) => match set {
                    Ok(set) => self.loaded(set),
                    Err(status) => self.not_loaded(status)?,
                },
                credit = wait_for(self.ready.as_mut().map(|ready| &mut ready.credit)) => self.credited(credit?),
                () = wait_for(patience.map(|time| tokio::time::sleep_until(time.into()))) => self.show_neighbour(),
            }
        }
        Ok(())
    }

    /// Accepts an acknowledgement, and a pose, which replaces an older one of its set.
    fn accept(&mut self, mut request: RenderViews) -> Result<(), Status> {
        let live = request.live.ok_or_else(|| Status::invalid_argument("live: the stream's first request was"))?;
        self.client.outbox.acknowledge(live.acknowledged_frame);
        let plan = self.plan_of(&mut request)?;
        let Some(&view) = request.views.first() else {
            return Ok(());
        };
        if let Some(last) = self.last_frame.replace(view.frame).filter(|last| view.frame <= *last) {
            return Err(Status::invalid_argument(format!("views.frame_number: {} comes after {last}", view.frame)));
        }
        self.client.shared.check_views(&plan, &request)?;
        let cell = plan.cell_of(&view.camera);
        let pose = Pose { request, view, plan, cell, arrived: Instant::now() };
        tracing::debug!(
            stream = self.client.stream,
            client = live.client_id,
            frame = pose.view.frame,
            plan_epoch = pose.plan.plan_epoch,
            set_index = pose.request.set_index,
            "requested"
        );
        self.course.add(pose.arrived, &pose.view.camera);
        let done = &self.client.shared.node.metrics.done;
        done.viewer_moved(self.client.stream, pose.request.workload_number, pose.view.camera);
        self.fetch_ahead(&pose);
        self.has_tried = false;
        let older = self.put(pose);
        self.count_replaced(older.map(|pose| pose.view));
        self.show_loaded();
        Ok(())
    }

    /// Begins to fetch the set of the cell where the viewer will be in a second.
    fn fetch_ahead(&mut self, pose: &Pose) {
        if self.own.is_none() || !pose.has_cells() {
            return;
        }
        let Some(ahead) = self.course.in_a_second(&pose.view.camera) else { return };
        let cell = pose.plan.cell_of(&ahead);
        if cell != pose.cell {
            self.fetch_aside(&pose.plan, pose.request.set_index, cell);
        }
    }

    /// Begins to fetch a set that is not waited for; one at a time, however fast a camera jumps.
    fn fetch_aside(&mut self, plan: &Arc<Assignment>, set_index: u32, cell: u32) {
        let sets = &self.client.shared.sets;
        if self.aside.is_some_and(|aside| sets.cached.is_loading(&aside)) {
            return;
        }
        if let Ok(plan) = CellPlan::of(plan, cell) {
            self.aside = sets.load_ahead(&plan, set_index, RECENTLY);
        }
    }

    /// Puts a pose in place of one of the same set, or else in place of the newest; gives the pose that it replaces.
    fn put(&mut self, pose: Pose) -> Option<Pose> {
        if self.ready.as_ref().is_some_and(|ready| !ready.place.is_neighbour && ready.pose.shows_set_of(&pose)) {
            let credit = self.credit(&pose);
            let ready = self.ready.as_mut()?;
            if ready.pose.bytes() != pose.bytes() {
                ready.credit = credit;
            }
            return Some(std::mem::replace(&mut ready.pose, pose));
        }
        match self.loading.as_mut().and_then(|fetch| fetch.pose.as_mut()) {
            Some(loading) if loading.shows_set_of(&pose) => Some(std::mem::replace(loading, pose)),
            _ => self.newest.replace(pose),
        }
    }

    /// The plan in force for a request. A stream goes on from plan to plan of its workload, whatever its cells and roles. A
    /// request of the plan before does not know the method of a new one.
    fn plan_of(&self, request: &mut RenderViews) -> Result<Arc<Assignment>, Status> {
        let shared = &self.client.shared;
        let plan = shared.node.plans.follow(request.workload_number, request.plan_epoch)?;
        if let Some(method) = plan.method.as_ref().filter(|_| plan.plan_epoch > request.plan_epoch)
            && request.method != DIRECT
        {
            request.method.clone_from(method);
        }
        shared.of_compositor(plan, &request.method)
    }

    fn count_replaced(&self, older: Option<RequestedView>) {
        if let Some(older) = older {
            tracing::debug!(stream = self.client.stream, frame = older.frame, "replaced by a newer pose");
            self.client.shared.node.metrics.drop_view("newer pose");
        }
    }

    /// Fetches the newest pose's set, if no other is being fetched.
    fn fetch_next(&mut self) {
        if self.loading.is_some() {
            return;
        }
        let Some(pose) = self.newest.take() else { return };
        let shared = self.client.shared.clone();
        let plan = pose.plan.clone();
        let set_index = pose.request.set_index;
        let cell = pose.cell;
        let work = Box::pin(async move { shared.source(&plan, set_index, cell).await });
        self.without_set.get_or_insert(pose.arrived);
        self.loading = Some(Fetch { pose: Some(pose), work });
    }

    fn loaded(&mut self, set: Loaded) {
        let Some(Fetch { pose, .. }) = self.loading.take() else { return };
        self.has_tried = false;
        self.own.get_or_insert((set.place.id.plan_epoch, set.place.cell));
        if pose.is_some() || self.newest.is_none() {
            self.without_set = None;
        }
        if let Some(pose) = pose {
            self.own = Some(pose.plan_and_cell());
            // The pose may have arrived after the fetch began.
            let wait_s = set.wait_s.min(pose.arrived.elapsed().as_secs_f64());
            self.prepare(pose, Loaded { wait_s, ..set });
        }
    }

    /// A set that failed under a plan that was replaced is fetched under the plan in force. One that no pose waits for is
    /// fetched again when one does.
    fn not_loaded(&mut self, status: Status) -> Result<(), Status> {
        let Some(mut pose) = self.loading.take().and_then(|fetch| fetch.pose) else { return Ok(()) };
        self.client.shared.node.metrics.wanted_fetches_ended.inc();
        let plan = self.plan_of(&mut pose.request)?;
        if plan.plan_epoch == pose.plan.plan_epoch {
            return Err(status);
        }
        let cell = plan.cell_of(&pose.view.camera);
        self.newest.get_or_insert(Pose { plan, cell, ..pose });
        Ok(())
    }

    /// Hands a pose over to the device where there is room. Otherwise it waits for room, in place of the one that waited.
    fn prepare(&mut self, pose: Pose, set: Loaded) {
        let older = self.ready.take();
        self.count_replaced(older.as_ref().map(|ready| ready.pose.view));
        if let Some(credit) = self.replaced_credit(&pose).or_else(|| self.try_credit(&pose)) {
            return self.queue(pose, &set, credit);
        }
        let credit = match older {
            Some(older) if older.pose.bytes() == pose.bytes() => older.credit,
            _ => self.credit(&pose),
        };
        self.ready = Some(Ready { pose, place: set.place, wait_s: set.wait_s, credit });
    }

    /// The credit of a view of this stream that still waits for the device, and is replaced.
    fn replaced_credit(&self, pose: &Pose) -> Option<Credit> {
        let waiting = self.client.shared.arrivals.withdraw(self.client.stream).pop_front()?;
        self.count_replaced(Some(waiting.view));
        (view_bytes(&waiting.view.camera, waiting.key.planes) == pose.bytes()).then_some(waiting.credit)
    }

    /// The newest pose that waits for a set.
    fn waiting(&self) -> Option<&Pose> {
        self.newest.as_ref().or_else(|| self.loading.as_ref()?.pose.as_ref())
    }

    /// The time at which a pose has waited long enough for another cell; `None` where none waits, or no other set can serve.
    /// A viewer that stays in its cell waits for the next set there: another cell's would look worse.
    fn patience_ends(&self) -> Option<Instant> {
        let pose = self.waiting()?;
        let may_show_other = match self.own {
            Some(own) => own != pose.plan_and_cell(),
            None => pose.plan.workload.planes.light,
        };
        let in_motion = pose.request.live.is_some_and(|live| !live.waits_for_set);
        let since = self.without_set.filter(|_| in_motion && may_show_other && !self.has_tried)?;
        Some(since + self.client.shared.node.config.deadlines.neighbour)
    }

    /// Makes the newest pose's view where its own set is loaded while another is being fetched; gives whether it is.
    fn show_loaded(&mut self) -> bool {
        let newest = self.newest.as_ref().filter(|pose| self.loading.is_some() && pose.has_cells());
        let own = newest.and_then(|pose| self.client.shared.loaded(&pose.plan, pose.request.set_index, pose.cell));
        let Some((pose, set)) = own.and_then(|set| Some((self.take_newest()?, set))) else { return false };
        (self.without_set, self.own) = (None, Some(pose.plan_and_cell()));
        self.prepare(pose, set);
        true
    }

    /// Makes the newest pose's view from its own set if that has been loaded meanwhile, or else from the nearest loaded set
    /// of its moment. Its own set is fetched all the same.
    fn show_neighbour(&mut self) {
        self.has_tried = true;
        if self.show_loaded() {
            return;
        }
        let Some(pose) = self.waiting() else { return };
        let plan = pose.plan.clone();
        let set_index = pose.request.set_index;
        let cell = pose.cell;
        let camera = pose.view.camera;
        let Some(set) = self.client.shared.meanwhile(&plan, set_index, &camera) else { return };
        if set.place.is_preview() && self.previewed.replace(camera) == Some(camera) {
            return;
        }
        if self.newest.is_some() {
            self.fetch_aside(&plan, set_index, cell);
        }
        if let Some(pose) = self.take_newest() {
            let wait_s = pose.arrived.elapsed().as_secs_f64();
            self.prepare(pose, Loaded { wait_s, ..set });
        }
    }

    /// The newest pose that waits for a set; it replaces the other.
    fn take_newest(&mut self) -> Option<Pose> {
        let loading = self.loading.as_mut().and_then(|fetch| fetch.pose.take());
        let Some(newest) = self.newest.take() else { return loading };
        self.count_replaced(loading.map(|pose| pose.view));
        Some(newest)
    }

    /// A pose that waited has room now. One whose set has been evicted meanwhile waits for it again.
    fn credited(&mut self, credit: Credit) {
        let Some(Ready { pose, place, wait_s, .. }) = self.ready.take() else { return };
        match self.client.shared.source_at(&pose.plan, pose.request.set_index, place) {
            Some(source) => self.queue(pose, &Loaded { source, place, wait_s }, credit),
            None => {
                self.newest.get_or_insert(pose);
            }
        }
    }

    fn queue(&self, pose: Pose, set: &Loaded, credit: Credit) {
        let view = Waiting::new(&pose.request, pose.view, pose.arrived, set, self.reply.clone(), credit);
        self.client.queue(true, vec![view]);
    }

    fn try_credit(&self, pose: &Pose) -> Option<Credit> {
        let stream = self.credits.clone().try_acquire_owned().ok()?;
        Some(Credit { stream, _node: self.client.shared.quota.try_live_view(pose.bytes())? })
    }

    fn credit(&self, pose: &Pose) -> Pending<Credit> {
        let credits = self.credits.clone();
        let shared = self.client.shared.clone();
        let bytes = pose.bytes();
        Box::pin(async move {
            let stream = credits.acquire_owned().await.map_err(closed)?;
            Ok(Credit { stream, _node: shared.quota.live_view(bytes).await? })
        })
    }
}
