//! A session: a plan, and views asked of its compositors.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cluster::{ChangeSession, SessionEvent, SessionPlan, SessionRequest};
use codec::FrameCodec;
use depth_image::{PinholeCamera, ViewPlanes};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use tokio_stream::StreamExt as _;
use tonic::{Code, Status};
use wire::rpc::{CoordinatorClient, Messages};

use crate::ClientError;
use crate::expected::Expected;
use crate::frames::Frames;
use crate::live::{Live, State, follow, learn};
use crate::live_view::LiveView;

/// Plans that compositors have named and nobody has looked at.
const PLANS_LEARNED: usize = 4;

/// One view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewRequest {
    /// The client's own number, once a call.
    pub frame: u64,
    /// Into the session's timeline.
    pub set_index: u32,
    /// From where.
    pub camera: PinholeCamera,
}

/// An open session. Dropping it closes it.
#[derive(Debug)]
pub struct Session {
    codec: FrameCodec,
    planes: ViewPlanes,
    state: watch::Receiver<State>,
    /// Dropped with the session.
    _following: JoinSet<()>,
    coordinator: CoordinatorClient,
    request: Arc<Mutex<SessionRequest>>,
}

impl Session {
    pub(crate) async fn open(
        coordinator: &CoordinatorClient,
        request: SessionRequest,
        progress: impl FnMut(&SessionEvent),
    ) -> Result<Self, ClientError> {
        let planes = request.planes;
        let codec: FrameCodec = request
            .codec
            .parse()
            .map_err(|error| ClientError::Invalid { field: "codec", reason: format!("{error}") })?;
        let mut events = coordinator.open_session(request.clone()).await.map_err(ClientError::coordinator)?;
        let (session, plan) = plan_of(&mut events, progress).await?;
        let (learned, learning) = mpsc::channel(PLANS_LEARNED);
        let live = Arc::new(Live::reach(plan, &learned).await?);
        let (says, state) = watch::channel(State { session, live, ended: None });
        let request = Arc::new(Mutex::new(request));
        let mut following = JoinSet::new();
        following.spawn(learn(learning, says.clone()));
        following.spawn(follow(coordinator.clone(), request.clone(), events, says));
        Ok(Self { codec, planes, state, _following: following, coordinator: coordinator.clone(), request })
    }

    /// Asks for another number of views a set, or another rate, from now on; plans follow.
    ///
    /// # Errors
    /// The coordinator's; a session that has ended.
    pub async fn change(&self, views_per_set: u32, frames_per_s: Option<f64>) -> Result<(), ClientError> {
        self.say(|request| (request.views_per_set, request.frames_per_s) = (views_per_set, frames_per_s)).await
    }

    /// Looks from elsewhere from now on: plans follow, with view cells around these viewpoints. Only of a session that was
    /// opened with viewpoints.
    ///
    /// # Errors
    /// The coordinator's; a session that has ended.
    pub async fn look_from(&self, viewpoints: Vec<PinholeCamera>) -> Result<(), ClientError> {
        self.say(|request| request.viewpoints.clone_from(&viewpoints)).await
    }

    async fn say(&self, change: impl Fn(&mut SessionRequest)) -> Result<(), ClientError> {
        let mut asked = self.request().clone();
        change(&mut asked);
        let SessionRequest { views_per_set, frames_per_s, viewpoints, .. } = asked;
        let session = self.state.borrow().session;
        let viewpoints = (!viewpoints.is_empty()).then_some(viewpoints);
        let message = ChangeSession { session, views_per_set, frames_per_s, viewpoints };
        let answer = self.coordinator.change_session(message).await;
        let refuses = |status: &Status| [Code::InvalidArgument, Code::ResourceExhausted].contains(&status.code());
        if !answer.as_ref().is_err_and(refuses) {
            // What is asked for when the coordinator comes back, too; a session is opened for one view at least.
            let mut request = self.request();
            change(&mut request);
            request.views_per_set = request.views_per_set.max(1);
        }
        answer.map_err(ClientError::coordinator)
    }

    fn request(&self) -> MutexGuard<'_, SessionRequest> {
        self.request.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The plan in force, its costs and its reason. It changes as nodes come and go.
    #[must_use]
    pub fn plan(&self) -> SessionPlan {
        self.state.borrow().live.plan.clone()
    }

    /// Why the session has ended, if it has.
    #[must_use]
    pub fn ended(&self) -> Option<String> {
        self.state.borrow().ended.clone()
    }

    /// Asks for views by the session's own method. Frames come in the order they are ready; compositors
    /// work at the same time, each at first on its share of every set's views, then on what is left of others'.
    ///
    /// # Errors
    /// For frame numbers given twice, sets beyond the timeline, bad cameras, and a session that has ended.
    pub fn render_views(&self, requests: Vec<ViewRequest>) -> Result<Frames, ClientError> {
        self.ask(None, requests)
    }

    /// As [`Session::render_views`], by another method.
    ///
    /// # Errors
    /// As there.
    pub fn render_views_by(&self, method: &str, requests: Vec<ViewRequest>) -> Result<Frames, ClientError> {
        self.ask(Some(method), requests)
    }

    /// By the method of whatever plan is in force, unless one is given.
    fn ask(&self, method: Option<&str>, requests: Vec<ViewRequest>) -> Result<Frames, ClientError> {
        let live = self.state.borrow().live.clone();
        if let Some(reason) = self.ended() {
            return Err(ClientError::Ended { reason });
        }
        requests.iter().try_for_each(|request| check(request, &live))?;
        let expected = Expected::new(requests.iter().copied(), self.planes)?;
        let template = cluster::RenderViews {
            plan_epoch: live.plan.assignment.plan_epoch,
            set_index: 0,
            method: method.unwrap_or_default().to_owned(),
            codec: self.codec,
            planes: self.planes,
            views: Vec::new(),
            live: None,
        };
        Ok(Frames::start(self.state.clone(), template, requests, expected))
    }

    /// Frames of a camera that moves, by the session's own method: one long stream to one compositor, of which the newest
    /// pose counts.
    #[must_use]
    pub fn live(&self) -> LiveView {
        LiveView::start(self.state.clone(), self.codec, self.planes)
    }
}

pub(crate) fn check(request: &ViewRequest, live: &Live) -> Result<(), ClientError> {
    let camera_error = |error: depth_image::CameraError| ClientError::Invalid {
        field: "camera",
        reason: format!("frame {}: {error}", request.frame),
    };
    request.camera.validate().map_err(camera_error)?;
    let beyond =
        || ClientError::Invalid { field: "set_index", reason: format!("{} is beyond the timeline", request.set_index) };
    live.plan.assignment.sample_set_id(request.set_index).map(drop).ok_or_else(beyond)
}

async fn plan_of(
    events: &mut Messages<SessionEvent>,
    mut progress: impl FnMut(&SessionEvent),
) -> Result<(u64, SessionPlan), ClientError> {
    let mut number = 0;
    while let Some(event) = events.next().await {
        let event = event.map_err(ClientError::coordinator)?;
        progress(&event);
        match event {
            SessionEvent::Opened { session } => number = session,
            SessionEvent::Progress { .. } => (),
            SessionEvent::Plan(plan) => return Ok((number, *plan)),
            SessionEvent::Ended { reason } => return Err(ClientError::Ended { reason }),
        }
    }
    Err(ClientError::Coordinator { reason: "the session's stream ended before its plan".to_owned() })
}
