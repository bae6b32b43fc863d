//! A stream that follows a moving camera: the newest pose counts.
//!
//! A pose waits for its set, for its client to take a frame, and for the device. A stream has one pose at most in each of
//! these places, and a newer one replaces it. A set that is being fetched is never given up for a newer one. Where sets
//! arrive more slowly than poses, every set is shown, with its newest pose.

use std::pin::Pin;
use std::sync::Arc;
use std::time::Instant;

use cluster::{Assignment, RenderViews, RequestedView};
use node::next_within;
use tokio::sync::Semaphore;
use tonic::Status;
use wire::rpc::Messages;

use crate::batch::{Loaded, Waiting};
use crate::outbox::Reply;
use crate::queue::Viewer;
use crate::quota::{Credit, closed};
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
        let set = |pose: &Self| (pose.plan.plan_epoch, pose.request.set_index, pose.cell);
        set(self) == set(other)
    }
}

/// A pose whose set is ready.
struct Ready {
    pose: Pose,
    set: Loaded,
    /// The wait for room.
    credit: Pending<Credit>,
}

pub(crate) struct LiveStream<'a> {
    client: &'a ClientStream,
    reply: Reply,
    credits: Arc<Semaphore>,
    /// The newest pose, whose set is not being fetched yet.
    newest: Option<Pose>,
    /// The pose whose set is being fetched.
    loading: Option<(Pose, Pending<Loaded>)>,
    ready: Option<Ready>,
    /// The plan that the stream was opened under, or its successor.
    plan: Option<Arc<Assignment>>,
    last_frame: Option<u64>,
    _viewer: Viewer,
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
            plan: None,
            last_frame: None,
            _viewer: client.shared.arrivals.viewer(),
        }
    }

    pub(crate) async fn answer(
        mut self,
        first: RenderViews,
        mut requests: Messages<RenderViews>,
    ) -> Result<(), Status> {
        let idle = self.client.shared.deadlines.idle;
        let mut is_open = true;
        self.accept(first)?;
        while is_open || self.newest.is_some() || self.loading.is_some() || self.ready.is_some() {
            self.fetch_next();
            tokio::select! {
                biased;
                request = next_within(&mut requests, idle, "poses"), if is_open => match request? {
                    Some(request) => self.accept(request)?,
                    None => is_open = false,
                },
                set = wait_for(self.loading.as_mut().map(|(_, work)| work)) => self.loaded(set?),
                credit = wait_for(self.ready.as_mut().map(|ready| &mut ready.credit)) => self.credited(credit?),
            }
        }
        Ok(())
    }

    /// Accepts an acknowledgement, and a pose, which replaces an older one of its set.
    fn accept(&mut self, request: RenderViews) -> Result<(), Status> {
        let live = request.live.ok_or_else(|| Status::invalid_argument("live: the stream's first request was"))?;
        self.client.outbox.acknowledge(live.acknowledged_frame);
        let plan = self.plan_of(request.plan_epoch)?;
        let Some(&view) = request.views.first() else {
            return Ok(());
        };
        self.check_number(view.frame)?;
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
        let older = self.put(pose);
        self.count_replaced(older.map(|pose| pose.view));
        Ok(())
    }

    /// Puts a pose in place of one of the same set, or else in place of the newest; gives the pose that it replaces.
    fn put(&mut self, pose: Pose) -> Option<Pose> {
        if self.ready.as_ref().is_some_and(|ready| ready.pose.shows_set_of(&pose)) {
            let credit = self.credit(&pose.view);
            let ready = self.ready.as_mut()?;
            if ready.pose.view.camera.size_px != pose.view.camera.size_px {
                ready.credit = credit;
            }
            return Some(std::mem::replace(&mut ready.pose, pose));
        }
        match &mut self.loading {
            Some((loading, _)) if loading.shows_set_of(&pose) => Some(std::mem::replace(loading, pose)),
            _ => self.newest.replace(pose),
        }
    }

    fn check_number(&mut self, frame: u64) -> Result<(), Status> {
        match self.last_frame.replace(frame) {
            Some(last) if frame <= last => {
                Err(Status::invalid_argument(format!("views.frame_number: {frame} comes after {last}")))
            }
            _ => Ok(()),
        }
    }

    /// The plan of a request. Nodes take a plan before clients hear of it: until they do, the new plan serves them, where it
    /// shows the same.
    fn plan_of(&mut self, plan_epoch: u64) -> Result<Arc<Assignment>, Status> {
        let shared = &self.client.shared;
        let follows = |plan: &Arc<Assignment>| {
            plan.plan_epoch > plan_epoch && self.plan.as_ref().is_some_and(|known| known.workload == plan.workload)
        };
        let plan = match shared.plan.in_force().filter(follows) {
            Some(plan) => plan,
            None => shared.plan.require(plan_epoch)?,
        };
        let plan = shared.of_compositor(plan)?;
        self.plan = Some(plan.clone());
        Ok(plan)
    }

    fn count_replaced(&self, older: Option<RequestedView>) {
        if let Some(older) = older {
            tracing::debug!(stream = self.client.stream, frame = older.frame, "replaced by a newer pose");
            self.client.shared.metrics.drop_view("newer pose");
        }
    }

    /// Fetches the newest pose's set, if no other is being fetched.
    fn fetch_next(&mut self) {
        if self.loading.is_some() {
            return;
        }
        let Some(pose) = self.newest.take() else { return };
        let (shared, plan) = (self.client.shared.clone(), pose.plan.clone());
        let (set_index, cell) = (pose.request.set_index, pose.cell);
        let work = Box::pin(async move { shared.source(&plan, set_index, cell).await });
        self.loading = Some((pose, work));
    }

    fn loaded(&mut self, set: Loaded) {
        let Some((pose, _)) = self.loading.take() else { return };
        // The pose may have arrived after the fetch began.
        let set = Loaded { wait_s: set.wait_s.min(pose.arrived.elapsed().as_secs_f64()), ..set };
        let older = self.ready.replace(Ready { credit: self.credit(&pose.view), pose, set });
        self.count_replaced(older.map(|ready| ready.pose.view));
        self.replace_waiting();
    }

    /// Replaces a view of this stream that still waits for the device, and takes its credit.
    fn replace_waiting(&mut self) {
        let waiting = self.client.shared.arrivals.withdraw(self.client.stream).pop_front();
        let Some((waiting, ready)) = waiting.zip(self.ready.as_ref()) else { return };
        self.count_replaced(Some(waiting.view));
        if ready.pose.view.camera.size_px == waiting.key.size_px {
            self.credited(waiting.credit);
        }
    }

    fn credited(&mut self, credit: Credit) {
        let Some(Ready { pose, set, .. }) = self.ready.take() else { return };
        let requested = (&pose.request, pose.view, pose.arrived);
        self.client.queue(vec![Waiting::new(requested, &set, self.reply.clone(), credit)]);
    }

    fn credit(&self, view: &RequestedView) -> Pending<Credit> {
        let (credits, shared) = (self.credits.clone(), self.client.shared.clone());
        let camera = view.camera;
        Box::pin(async move {
            let stream = credits.acquire_owned().await.map_err(closed)?;
            Ok(Credit { stream, _node: shared.quota.live_view(&camera).await? })
        })
    }
}

/// Waits for the work; without any, waits for ever.
async fn wait_for<T>(work: Option<&mut Pending<T>>) -> Result<T, Status> {
    match work {
        Some(work) => work.await,
        None => std::future::pending().await,
    }
}
