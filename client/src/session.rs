//! The way to a coordinator; a session: a plan, and views asked of its compositors.

use std::sync::Arc;
use std::time::Duration;

use cluster::{ChangeSession, ClusterStatus, Promise, SessionEvent, SessionPlan, SessionRequest};
use codec::FrameCodec;
use depth_image::{PinholeCamera, ToneMapping, ViewPlanes};
use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use tokio::time::Instant;
use tokio_stream::StreamExt as _;
use tonic::{Code, Status};
use wire::rpc::{CoordinatorClient, connect};

use crate::active_plan::{ActivePlan, SessionState, first_in, follow_compositors, follow_coordinator};
use crate::delivery::deliver;
use crate::error::ClientError;
use crate::frames::Frames;
use crate::live_view::{EncodedLiveView, LiveView};
use crate::placement::ClientId;
use crate::view_request::{ViewRequest, ViewSettings};
use crate::window::Window;

/// Plans that compositors have named and the session has not taken over yet.
const NAMED_PLANS: usize = 4;

/// A connection to a coordinator.
#[derive(Debug, Clone)]
pub struct Client {
    coordinator: CoordinatorClient,
}

impl Client {
    /// Connects to `http://host:port`.
    ///
    /// # Errors
    /// Where nobody answers.
    pub async fn connect(coordinator: &str) -> Result<Self, ClientError> {
        let channel = connect(coordinator).await.map_err(ClientError::coordinator)?;
        Ok(Self { coordinator: CoordinatorClient::new(channel) })
    }

    /// The cluster's members.
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn status(&self) -> Result<ClusterStatus, ClientError> {
        self.coordinator.get_status(()).await.map_err(ClientError::coordinator)
    }

    /// Waits until `wanted` nodes have joined.
    ///
    /// # Errors
    /// The coordinator's; [`ClientError::FewNodes`] where they do not join in time.
    pub async fn wait_for_nodes(&self, wanted: usize, deadline: Duration) -> Result<ClusterStatus, ClientError> {
        let end = Instant::now() + deadline;
        loop {
            let status = self.status().await?;
            if status.nodes.len() >= wanted {
                return Ok(status);
            }
            if Instant::now() >= end {
                return Err(ClientError::FewNodes { joined: status.nodes.len(), wanted });
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }

    /// Opens a session; `progress` is called with what the coordinator does meanwhile.
    ///
    /// # Errors
    /// The coordinator's, with its reason.
    pub async fn open_session(
        &self,
        request: SessionRequest,
        mut progress: impl FnMut(&SessionEvent),
    ) -> Result<Session, ClientError> {
        let coordinator = self.coordinator.clone();
        let codec = request.codec.parse::<FrameCodec>();
        let codec = codec.map_err(|error| ClientError::Invalid { field: "codec", reason: error.to_string() })?;
        let mut events = coordinator.open_session(request.clone()).await.map_err(ClientError::coordinator)?;
        let mut session = 0;
        let mut promise = None;
        let plan = loop {
            let Some(event) = events.next().await else {
                return Err(ClientError::Coordinator {
                    reason: "the session's stream ended before its plan".to_owned(),
                });
            };
            let event = event.map_err(ClientError::coordinator)?;
            progress(&event);
            match event {
                SessionEvent::Opened { session: number } => session = number,
                SessionEvent::Progress { .. } => (),
                SessionEvent::Promise(promised) => promise = Some(promised),
                SessionEvent::Plan(plan) => break *plan,
            }
        };
        let (named_plans, to_follow) = mpsc::channel(NAMED_PLANS);
        let mut planes = request.planes;
        if request.auto_exposure {
            planes.tone.exposure = plan.auto_exposure;
        }
        let settings = ViewSettings { method: request.method.clone(), codec, planes };
        let active = Arc::new(ActivePlan::connect(plan, settings, named_plans).await?);
        let (changes, state) = watch::channel(SessionState { session, promise, active });
        let request = Arc::new(Mutex::new(request));
        let mut following = JoinSet::new();
        following.spawn(follow_compositors(to_follow, changes.clone()));
        following.spawn(follow_coordinator(coordinator.clone(), request.clone(), events, changes));
        Ok(Session { state, _following: following, coordinator, request })
    }
}

/// An open session. Dropping it closes it.
#[derive(Debug)]
pub struct Session {
    state: watch::Receiver<SessionState>,
    /// Dropped with the session.
    _following: JoinSet<()>,
    coordinator: CoordinatorClient,
    request: Arc<Mutex<SessionRequest>>,
}

impl Session {
    /// Asks for another number of views a set, or another frame rate, from now on; plans follow.
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn change(&self, views_per_set: u32, frames_per_s: Option<f64>) -> Result<(), ClientError> {
        self.change_request(|request| (request.views_per_set, request.frames_per_s) = (views_per_set, frames_per_s))
            .await
    }

    /// Moves the session's viewpoints; plans follow, with view cells around them. The session must have been opened with
    /// viewpoints.
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn set_viewpoints(&self, viewpoints: Vec<PinholeCamera>) -> Result<(), ClientError> {
        self.change_request(|request| request.viewpoints.clone_from(&viewpoints)).await
    }

    async fn change_request(&self, change: impl Fn(&mut SessionRequest)) -> Result<(), ClientError> {
        let mut changed = self.request.lock().clone();
        change(&mut changed);
        let SessionRequest { views_per_set, frames_per_s, viewpoints, .. } = changed;
        let session = self.state.borrow().session;
        let viewpoints = (!viewpoints.is_empty()).then_some(viewpoints);
        let message = ChangeSession { session, views_per_set, frames_per_s, viewpoints };
        let answer = self.coordinator.change_session(message).await;
        let code = answer.as_ref().map_or_else(Status::code, |()| Code::Ok);
        if ![Code::InvalidArgument, Code::ResourceExhausted].contains(&code) {
            // The session is opened again with it when the coordinator comes back; a session has one view at least.
            let mut request = self.request.lock();
            change(&mut request);
            request.views_per_set = request.views_per_set.max(1);
        }
        answer.map_err(ClientError::coordinator)
    }

    /// How its views are shown, with the plan's exposure where the request leaves it to the plan. It stays the same as plans
    /// change.
    #[must_use]
    pub fn tone(&self) -> ToneMapping {
        self.state.borrow().active.settings.planes.tone
    }

    /// The plan in force, its costs and its reason. It changes as nodes come and go.
    #[must_use]
    pub fn plan(&self) -> SessionPlan {
        self.state.borrow().active.plan.clone()
    }

    /// The promise to the session; `None` without a budget.
    #[must_use]
    pub fn promise(&self) -> Option<Promise> {
        self.state.borrow().promise.clone()
    }

    /// Waits for another promise than this one.
    pub async fn another_promise(&self, promise: Option<&Promise>) -> Promise {
        first_in(self.state.clone(), |state| state.promise.clone().filter(|other| Some(other) != promise)).await
    }

    /// Waits for a plan of another number.
    pub async fn another_plan(&self, plan_epoch: u64) -> SessionPlan {
        let other = first_in(self.state.clone(), |state| {
            (state.active.plan_epoch() != plan_epoch).then(|| state.active.plan.clone())
        });
        other.await
    }

    /// Requests views by the method of the plan in force. Frames are received in the order they are ready. All
    /// compositors work at the same time, each at first on its own share of every set's views.
    ///
    /// Requests are drawn as frames are received, a few thousand ahead, so that there may be any number. Their iterator must
    /// not block. The numbers of frames must rise, and views of one set belong together.
    ///
    /// # Errors
    /// For frame numbers that do not rise, sets beyond the timeline and bad cameras among the first few thousand requests,
    /// and for a session that has ended. Later requests that cannot be met are errors of [`Frames::next`], after the frames
    /// before them.
    pub fn render_views<R>(&self, requests: R) -> Result<Frames, ClientError>
    where
        R: IntoIterator<Item = ViewRequest, IntoIter: Send + 'static>,
    {
        let planes = self.state.borrow().active.settings.planes;
        self.render_views_with(planes, None, requests)
    }

    /// As [`Session::render_views`], with these planes in place of the session's, and with another reconstruction method where one
    /// is named: its samples must be those of the session's.
    ///
    /// # Errors
    /// As [`Session::render_views`].
    pub fn render_views_with<R>(
        &self,
        planes: ViewPlanes,
        method: Option<String>,
        requests: R,
    ) -> Result<Frames, ClientError>
    where
        R: IntoIterator<Item = ViewRequest, IntoIter: Send + 'static>,
    {
        let sets = self.state.borrow().active.plan.assignment.workload.timeline.set_count;
        let mut window = Window::open(requests.into_iter(), sets, planes)?;
        window.method = method;
        Ok(Frames::start(window, |sink| deliver(self.state.clone(), sink)))
    }

    /// Frames of a camera that moves, by the method of the plan in force. They are sent on one long stream from one
    /// compositor, on which the newest pose counts.
    #[must_use]
    pub fn live(&self) -> LiveView {
        LiveView::start(self.state.clone())
    }

    /// The same, of which frames are not decoded, for one of a client's streams.
    #[must_use]
    pub fn live_encoded(&self, client: ClientId) -> EncodedLiveView {
        EncodedLiveView::start(client, self.state.clone())
    }
}
