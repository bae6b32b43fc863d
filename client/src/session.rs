//! A session: a plan, and views asked of its compositors.

use depth_image::{PinholeCamera, ViewPlanes};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_stream::StreamExt as _;
use wire::rpc::{CompositorClient, CoordinatorClient, Messages, connect};
use wire::{CompositorShare, FrameCodec, SessionEvent, SessionPlan, SessionRequest};

use crate::ClientError;
use crate::expected::Expected;
use crate::frames::Frames;

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

/// A compositor and the channel to it.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) share: CompositorShare,
    pub(crate) client: CompositorClient,
}

impl Peer {
    pub(crate) fn error(&self, reason: impl ToString) -> ClientError {
        ClientError::Compositor {
            node_name: self.share.node_name.clone(),
            address: self.share.address.clone(),
            reason: reason.to_string(),
        }
    }
}

/// An open session. Dropping it closes it.
#[derive(Debug)]
pub struct Session {
    plan: SessionPlan,
    codec: FrameCodec,
    planes: ViewPlanes,
    peers: Vec<Peer>,
    ended: watch::Receiver<Option<String>>,
    watching: JoinHandle<()>,
}

impl Drop for Session {
    fn drop(&mut self) {
        self.watching.abort();
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
        let mut events = coordinator.open_session(request).await.map_err(ClientError::coordinator)?;
        let plan = plan_of(&mut events, progress).await?;
        let mut peers = Vec::with_capacity(plan.assignment.compositors.len());
        for share in &plan.assignment.compositors {
            peers.push(peer(share).await?);
        }
        let (says, ended) = watch::channel(None);
        let watching = tokio::spawn(watch_end(events, says));
        Ok(Self { plan, codec, planes, peers, ended, watching })
    }

    /// The plan, its costs and its reason.
    #[must_use]
    pub fn plan(&self) -> &SessionPlan {
        &self.plan
    }

    /// Why the session has ended, if it has.
    #[must_use]
    pub fn ended(&self) -> Option<String> {
        self.ended.borrow().clone()
    }

    /// Asks for views by the session's own method. Frames come in the order they are ready; compositors
    /// work at the same time, each on an even share of every set's views.
    ///
    /// # Errors
    /// For frame numbers given twice, sets beyond the timeline, bad cameras, and a session that has ended.
    pub fn render_views(&self, requests: Vec<ViewRequest>) -> Result<Frames, ClientError> {
        self.render_views_by(&self.plan.assignment.workload.method, requests)
    }

    /// As [`Session::render_views`], by another method.
    ///
    /// # Errors
    /// As there.
    pub fn render_views_by(&self, method: &str, requests: Vec<ViewRequest>) -> Result<Frames, ClientError> {
        if let Some(reason) = self.ended() {
            return Err(ClientError::Ended { reason });
        }
        let due = requests.iter().map(|request| self.due(request)).collect::<Result<Vec<_>, _>>()?;
        let expected = Expected::new(due, self.planes)?;
        let template = wire::RenderViews {
            plan_epoch: self.plan.assignment.plan_epoch,
            set_index: 0,
            method: method.to_owned(),
            codec: self.codec,
            planes: self.planes,
            views: Vec::new(),
        };
        Ok(Frames::start(&self.peers, &template, requests, expected, self.ended.clone()))
    }

    fn due(&self, request: &ViewRequest) -> Result<(ViewRequest, wire::SampleSetId), ClientError> {
        let camera_error = |error: depth_image::CameraError| ClientError::Invalid {
            field: "camera",
            reason: format!("frame {}: {error}", request.frame),
        };
        request.camera.validate().map_err(camera_error)?;
        let set = self.plan.assignment.sample_set_id(request.set_index);
        let beyond = || ClientError::Invalid {
            field: "set_index",
            reason: format!("{} is beyond the timeline", request.set_index),
        };
        Ok((*request, set.ok_or_else(beyond)?))
    }
}

async fn peer(share: &CompositorShare) -> Result<Peer, ClientError> {
    let error = |status: tonic::Status| ClientError::Compositor {
        node_name: share.node_name.clone(),
        address: share.address.clone(),
        reason: status.message().to_owned(),
    };
    let channel = connect(&share.address).await.map_err(error)?;
    Ok(Peer { share: share.clone(), client: CompositorClient::new(channel) })
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

/// Only the coordinator's word ends a session: frames go on while it is away.
async fn watch_end(mut events: Messages<SessionEvent>, says: watch::Sender<Option<String>>) {
    while let Some(Ok(event)) = events.next().await {
        if let SessionEvent::Ended { reason } = event {
            let _ = says.send(Some(reason));
        }
    }
    // Kept open, so that whoever waits for word does not take silence for it.
    says.closed().await;
}
