//! One stream after the other to the compositors of the plan in force.

use std::time::{Duration, Instant};

use cluster::{LiveRequest, RenderViews, RequestedView};
use codec::{DecodeLimits, FrameAssembly, FrameCodec, FramePart, WholeFrame, decode_view};
use depth_image::ViewPlanes;
use tokio::sync::{mpsc, watch};
use tokio::time::{Interval, MissedTickBehavior, interval, timeout};
use tokio_stream::wrappers::ReceiverStream;
use wire::rpc::{CALL_TIMEOUT, Messages};

use crate::expected::agrees;
use crate::frames::{Failure, Frame, next_frame};
use crate::live::{Peer, State};
use crate::live_view::{LiveFrame, LiveTimes};
use crate::places::{Tried, new_client_id};
use crate::poses::{Pose, Poses, Sent};
use crate::trouble::PATIENCE;
use crate::{ClientError, ViewRequest};

/// A compositor hears of its client at least so often: one that is silent is cut off.
const HEARTBEAT: Duration = Duration::from_secs(20);
/// Before compositors that failed are tried again, where no other plan comes.
const RETRY: Duration = Duration::from_millis(200);

pub(crate) type Received = Result<LiveFrame, ClientError>;

/// What the viewer last said.
#[derive(Debug, Clone, Default)]
pub(crate) struct Newest {
    pub(crate) pose: Option<Pose>,
    /// The last frame that was taken.
    pub(crate) taken: u64,
}

/// A frame that is here, with the pose that it answers.
pub(crate) type Came = (WholeFrame, Sent, Instant, Peer);

pub(crate) struct LiveStream {
    state: watch::Receiver<State>,
    newest: watch::Receiver<Newest>,
    client_id: u64,
    codec: FrameCodec,
    planes: ViewPlanes,
    frames: mpsc::Sender<Result<Came, ClientError>>,
    poses: Poses,
    /// Of the last frame: epochs rise.
    plan_epoch: u64,
    /// Since when nothing has come though it was tried.
    failing_since: Option<Instant>,
}

/// Why a stream is left.
enum Left {
    /// Nobody looks any more.
    ByViewer,
    /// Another compositor's turn.
    ForPlan,
}

/// A call to a compositor.
struct Call {
    peer: Peer,
    requests: mpsc::Sender<RenderViews>,
    parts: Messages<FramePart>,
    assembly: FrameAssembly,
    heartbeat: Interval,
    /// There is something to say.
    is_due: bool,
}

impl LiveStream {
    pub(crate) fn new(
        state: watch::Receiver<State>,
        newest: watch::Receiver<Newest>,
        (codec, planes): (FrameCodec, ViewPlanes),
        frames: mpsc::Sender<Result<Came, ClientError>>,
    ) -> Self {
        let (client_id, poses) = (new_client_id(), Poses::default());
        Self { state, newest, client_id, codec, planes, frames, poses, plan_epoch: 0, failing_since: None }
    }

    pub(crate) async fn run(mut self) {
        if let Err(error) = self.follow().await {
            // Only an error here means that the viewer has left.
            let _ = self.frames.send(Err(error)).await;
        }
    }

    /// From compositor to compositor, and from plan to plan.
    async fn follow(&mut self) -> Result<(), ClientError> {
        let mut tried = Tried::none(0);
        loop {
            let State { live, ended, .. } = self.state.borrow_and_update().clone();
            if let Some(reason) = ended {
                return Err(ClientError::Ended { reason });
            }
            let plan_epoch = live.plan.assignment.plan_epoch;
            if tried.plan_epoch != plan_epoch {
                tried = Tried::none(plan_epoch);
            }
            let Some(peer) = tried.next(self.client_id, &live) else {
                tried = self.wait_for_others(tried).await?;
                continue;
            };
            let start = Instant::now();
            match self.stream_from(peer).await {
                Ok(Left::ByViewer) => return Ok(()),
                Ok(Left::ForPlan) => (),
                Err(Failure::OfRequest(error)) => return Err(error),
                Err(Failure::OfPlan(error) | Failure::Exhausted(error)) => {
                    tracing::debug!(client = self.client_id, node = peer.share.node_name, %error, "a live stream ends");
                    // One that lasted was not part of a row of failures, though perhaps nothing was asked of it.
                    self.failing_since = self.failing_since.filter(|_| start.elapsed() < CALL_TIMEOUT);
                    tried.add(peer, error);
                }
            }
        }
    }

    /// Until there is another plan, or the same may be tried again.
    async fn wait_for_others(&mut self, tried: Tried) -> Result<Tried, ClientError> {
        let is_over = self.failing_since.get_or_insert_with(Instant::now).elapsed() > PATIENCE;
        if tried.is_exhausted() || is_over {
            let nobody = || ClientError::Ended { reason: "the plan has no compositor".to_owned() };
            return Err(tried.last.unwrap_or_else(nobody));
        }
        match timeout(RETRY, self.state.changed()).await {
            Ok(Err(_)) => Err(closed()),
            _ => Ok(Tried::none(0)),
        }
    }

    /// One call, until it fails or another compositor is to be asked.
    async fn stream_from(&mut self, peer: &Peer) -> Result<Left, Failure> {
        let mut call = Call::open(peer.clone()).await?;
        self.poses.on_another_stream();
        loop {
            tokio::select! {
                changed = self.newest.changed() => match changed {
                    Ok(()) => call.is_due = true,
                    Err(_) => return Ok(Left::ByViewer),
                },
                changed = self.state.changed() => match changed {
                    Ok(()) if self.is_still_with(&call.peer) => (),
                    Ok(()) => return Ok(Left::ForPlan),
                    Err(_) => return Err(Failure::OfRequest(closed())),
                },
                _ = call.heartbeat.tick() => call.is_due = true,
                place = call.requests.clone().reserve_owned(), if call.is_due => match place {
                    Ok(place) => {
                        place.send(self.request());
                        call.is_due = false;
                    }
                    // The other direction says why.
                    Err(_) => call.is_due = false,
                },
                frame = next_frame(&mut call.parts, &mut call.assembly, &call.peer) => match frame? {
                    Some(frame) => self.accept(frame, &call.peer)?,
                    None => return Err(Failure::OfPlan(call.peer.error("ended the stream"))),
                },
            }
        }
    }

    /// Whether the plan in force, which may be another, leaves this client where it is.
    fn is_still_with(&self, peer: &Peer) -> bool {
        let state = self.state.borrow();
        let place = |peer: &Peer| (peer.share.node_name.clone(), peer.share.address.clone());
        let wanted = Tried::none(0).next(self.client_id, &state.live).map(place);
        state.ended.is_none() && wanted == Some(place(peer))
    }

    /// The newest pose, if it was not sent, and what has been taken.
    fn request(&mut self) -> RenderViews {
        let Newest { pose, taken } = self.newest.borrow_and_update().clone();
        self.poses.taken(taken);
        let mut request = self.acknowledgement(taken);
        if let Some(pose) = pose.filter(|pose| self.poses.wants(pose)) {
            let ViewRequest { frame, set_index, camera } = pose.request;
            (request.set_index, request.views) = (set_index, vec![RequestedView { frame, camera }]);
            self.poses.sent(pose);
        }
        request
    }

    /// By the method of whatever plan is in force.
    fn acknowledgement(&self, acknowledged_frame: u64) -> RenderViews {
        let live = self.state.borrow().live.clone();
        let assignment = &live.plan.assignment;
        RenderViews {
            plan_epoch: assignment.plan_epoch,
            set_index: 0,
            method: assignment.workload.method.clone(),
            codec: self.codec,
            planes: self.planes,
            views: Vec::new(),
            live: Some(LiveRequest { acknowledged_frame, client_id: self.client_id }),
        }
    }

    fn accept(&mut self, whole: WholeFrame, peer: &Peer) -> Result<(), Failure> {
        let unexpected = |reason: &str| {
            let error = ClientError::Unexpected { frame: whole.frame, reason: reason.to_owned() };
            Failure::of_peer(peer, error)
        };
        let sent = self.poses.answer(whole.frame).ok_or_else(|| unexpected("was not asked for, or comes late"))?;
        agrees(&sent.pose.request, self.planes, &whole.header).map_err(|reason| unexpected(&reason))?;
        let plan_epoch = whole.header.sample_set_id.plan_epoch;
        if plan_epoch < self.plan_epoch {
            return Err(unexpected("is of an older plan than the frame before"));
        }
        (self.plan_epoch, self.failing_since) = (plan_epoch, None);
        tracing::debug!(client = self.client_id, frame = whole.frame, set = %whole.header.sample_set_id, "came");
        let too_many = |_| Failure::OfPlan(peer.error("sends more frames than are taken"));
        self.frames.try_send(Ok((whole, sent, Instant::now(), peer.clone()))).map_err(too_many)
    }
}

impl Call {
    async fn open(peer: Peer) -> Result<Self, Failure> {
        let (requests, outgoing) = mpsc::channel(1);
        let answer = timeout(CALL_TIMEOUT, peer.client.render_views(ReceiverStream::new(outgoing))).await;
        let late = |_| Failure::OfPlan(peer.error(format!("no answer for {} s", CALL_TIMEOUT.as_secs())));
        let parts = answer.map_err(late)?.map_err(|status| Failure::of(&peer, &status))?;
        let mut heartbeat = interval(HEARTBEAT);
        heartbeat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Ok(Self { peer, requests, parts, assembly: FrameAssembly::default(), heartbeat, is_due: true })
    }
}

fn closed() -> ClientError {
    ClientError::Ended { reason: "the session was closed".to_owned() }
}

/// One after the other, so that they stay in their order.
pub(crate) async fn decode_all(
    mut encoded: mpsc::Receiver<Result<Came, ClientError>>,
    decoded: mpsc::Sender<Received>,
) {
    while let Some(came) = encoded.recv().await {
        let frame = match came {
            Ok(came) => decode(came).await,
            Err(error) => Err(error),
        };
        let is_over = frame.is_err();
        if decoded.send(frame).await.is_err() || is_over {
            return;
        }
    }
}

async fn decode((whole, Sent { pose, sent }, came, peer): Came) -> Received {
    let decoding = move || decode_view(&whole, &DecodeLimits::default()).map(|view| (whole.header, view));
    let (header, view) = match tokio::task::spawn_blocking(decoding).await {
        Ok(decoded) => decoded.map_err(|error| peer.error(error))?,
        Err(error) => return Err(peer.error(error)),
    };
    let times = LiveTimes { looked: pose.looked, sent, came, decoded: Instant::now() };
    Ok(LiveFrame { frame: Frame { request: pose.request, view, header }, times })
}
