//! A session: a plan, and views asked of its compositors.

use std::sync::Arc;

use depth_image::{PinholeCamera, ViewPlanes};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_stream::StreamExt as _;
use wire::rpc::{CoordinatorClient, Messages};
use wire::{FrameCodec, SessionEvent, SessionPlan, SessionRequest};

use crate::ClientError;
use crate::expected::Expected;
use crate::frames::Frames;
use crate::live::{Live, State, follow};

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
    following: JoinHandle<()>,
}

impl Drop for Session {
    fn drop(&mut self) {
        self.following.abort();
    }
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
        let live = Arc::new(Live::reach(plan_of(&mut events, progress).await?).await?);
        let (says, state) = watch::channel(State { live, ended: None });
        let following = tokio::spawn(follow(coordinator.clone(), request, events, says));
        Ok(Self { codec, planes, state, following })
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
    /// work at the same time, each on an even share of every set's views.
    ///
    /// # Errors
    /// For frame numbers given twice, sets beyond the timeline, bad cameras, and a session that has ended.
    pub fn render_views(&self, requests: Vec<ViewRequest>) -> Result<Frames, ClientError> {
        let method = self.state.borrow().live.plan.assignment.workload.method.clone();
        self.render_views_by(&method, requests)
    }

    /// As [`Session::render_views`], by another method.
    ///
    /// # Errors
    /// As there.
    pub fn render_views_by(&self, method: &str, requests: Vec<ViewRequest>) -> Result<Frames, ClientError> {
        let live = self.state.borrow().live.clone();
        if let Some(reason) = self.ended() {
            return Err(ClientError::Ended { reason });
        }
        requests.iter().try_for_each(|request| check(request, &live))?;
        let expected = Expected::new(requests.iter().copied(), self.planes)?;
        let template = wire::RenderViews {
            plan_epoch: live.plan.assignment.plan_epoch,
            set_index: 0,
            method: method.to_owned(),
            codec: self.codec,
            planes: self.planes,
            views: Vec::new(),
        };
        Ok(Frames::start(self.state.clone(), template, requests, expected))
    }
}

fn check(request: &ViewRequest, live: &Live) -> Result<(), ClientError> {
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
) -> Result<SessionPlan, ClientError> {
    while let Some(event) = events.next().await {
        let event = event.map_err(ClientError::coordinator)?;
        progress(&event);
        match event {
            SessionEvent::Progress { .. } => (),
            SessionEvent::Plan(plan) => return Ok(*plan),
            SessionEvent::Ended { reason } => return Err(ClientError::Ended { reason }),
        }
    }
    Err(ClientError::Coordinator { reason: "the session's stream ended before its plan".to_owned() })
}
