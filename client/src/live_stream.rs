//! The stream of a live view, from one compositor of the plan in force to the next.

use std::time::{Duration, Instant};

use cluster::{CompositorShare, LiveRequest, RenderViews, RequestedView};
use codec::WholeFrame;
use tokio::sync::{mpsc, watch};
use tokio::time::{Interval, MissedTickBehavior, interval, timeout};
use tokio_stream::wrappers::ReceiverStream;
use wire::rpc::CALL_TIMEOUT;

use crate::active_plan::SessionState;
use crate::delivery::GIVE_UP_AFTER;
use crate::error::ClientError;
use crate::peer::{Failure, FrameStream, Peer, decode};
use crate::placement::{ClientId, Tried};
use crate::poses::{Newest, Poses, SentPose};
use crate::view_request::{EncodedFrame, Frame, LiveFrame, ViewRequest};
use crate::window::check_frame;

/// The longest silence of a client: its compositor cuts off one that is silent for longer.
const HEARTBEAT: Duration = Duration::from_secs(20);
/// The delay before compositors that failed are tried again, where no other plan is in force by then.
const RETRY: Duration = Duration::from_millis(200);

/// A frame before it is decoded, and the compositor that has sent it; or the error that ends its view.
pub(crate) type Received = Result<(EncodedFrame, Peer), ClientError>;

pub(crate) struct LiveStream {
    state: watch::Receiver<SessionState>,
    newest: watch::Receiver<Newest>,
    client_id: u64,
    frames: mpsc::Sender<Received>,
    poses: Poses,
    /// The plan of the last frame: epochs rise.
    plan_epoch: u64,
    /// The time at which the last call was answered.
    opened_at: Option<Instant>,
    /// The first of the failures since the last frame.
    failing_since: Option<Instant>,
}

/// Why a stream is left.
enum Left {
    /// The viewer has left.
    ByViewer,
    /// The plan places this client elsewhere.
    ForPlan,
}

/// A call to a compositor.
struct Call {
    peer: Peer,
    requests: mpsc::Sender<RenderViews>,
    frames: FrameStream,
    heartbeat: Interval,
    /// Whether a request is due.
    is_due: bool,
}

impl LiveStream {
    /// Streams until the session ends or the viewer leaves.
    pub(crate) async fn run(
        client: ClientId,
        state: watch::Receiver<SessionState>,
        newest: watch::Receiver<Newest>,
        frames: mpsc::Sender<Received>,
    ) {
        let client_id = client.0;
        let poses = Poses::default();
        let mut stream =
            Self { state, newest, client_id, frames, poses, plan_epoch: 0, opened_at: None, failing_since: None };
        if let Err(error) = stream.follow().await {
            // A failure to send means that the viewer has left.
            let _ = stream.frames.send(Err(error)).await;
        }
    }

    /// Streams from one compositor after the other, and from one plan after the other.
    async fn follow(&mut self) -> Result<(), ClientError> {
        let mut tried = Tried::default();
        loop {
            let active = self.state.borrow_and_update().active.clone();
            let plan_epoch = active.plan_epoch();
            if tried.plan_epoch != plan_epoch {
                tried = Tried::default();
                tried.plan_epoch = plan_epoch;
            }
            let Some(peer) = tried.next(self.client_id, &active) else {
                tried = self.wait_for_others(tried).await?;
                continue;
            };
            self.opened_at = None;
            match self.stream_from(peer).await {
                Ok(Left::ByViewer) => return Ok(()),
                Ok(Left::ForPlan) => (),
                Err(Failure::OfRequest(error)) => return Err(error),
                Err(Failure::OfPlan(error) | Failure::Exhausted(error)) => {
                    tracing::debug!(client = self.client_id, node = peer.share.node_name, %error, "a live stream ends");
                    // A stream that lasted ends a series of failures, even if no frame was requested on it.
                    let has_lasted = self.opened_at.is_some_and(|opened| opened.elapsed() >= CALL_TIMEOUT);
                    self.failing_since = self.failing_since.filter(|_| !has_lasted);
                    tried.add(peer, error);
                }
            }
        }
    }

    /// Waits until there is another plan, or the same may be tried again.
    async fn wait_for_others(&mut self, tried: Tried) -> Result<Tried, ClientError> {
        let is_over = self.failing_since.get_or_insert_with(Instant::now).elapsed() > GIVE_UP_AFTER;
        let has_no_room = tried.last.is_some() && !tried.has_failed_with_room;
        if has_no_room || is_over {
            return Err(tried.last.unwrap_or_else(|| ClientError::ended("the plan has no compositor")));
        }
        match timeout(RETRY, self.state.changed()).await {
            Ok(Err(_)) => Err(closed()),
            _ => Ok(Tried::default()),
        }
    }

    /// Streams from one compositor, until the call fails or another compositor is to be asked.
    async fn stream_from(&mut self, peer: &Peer) -> Result<Left, Failure> {
        let mut call = Call::open(peer.clone()).await?;
        self.opened_at = Some(Instant::now());
        self.poses.begin_stream();
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
                    // The other direction gives the reason.
                    Err(_) => call.is_due = false,
                },
                frame = call.frames.next(&call.peer, None) => match frame? {
                    Some((frame, _)) => self.accept(frame, &call.peer)?,
                    None => return Err(Failure::OfPlan(call.peer.error("ended the stream"))),
                },
            }
        }
    }

    /// Whether the plan in force, which may be a new one, leaves this client where it is.
    fn is_still_with(&self, peer: &Peer) -> bool {
        let state = self.state.borrow();
        let CompositorShare { node_name, address, .. } = &peer.share;
        let wanted = Tried::default().next(self.client_id, &state.active);
        wanted.is_some_and(|wanted| wanted.share.node_name == *node_name && wanted.share.address == *address)
    }

    /// A request for the newest pose, if it was not sent, which acknowledges the frames that were taken.
    fn request(&mut self) -> RenderViews {
        let Newest { pose, taken } = self.newest.borrow_and_update().clone();
        self.poses.taken(taken);
        let mut live = LiveRequest { acknowledged_frame: taken, client_id: self.client_id, waits_for_set: false };
        let mut request = self.state.borrow().active.request();
        if let Some(pose) = pose.filter(|pose| self.poses.wants(pose)) {
            let ViewRequest { frame, set_index, camera } = pose.request;
            (request.set_index, request.views) = (set_index, vec![RequestedView { frame, camera }]);
            if let Some(quality) = &pose.quality {
                request.codec = quality.codec;
                request.planes.antialias = quality.antialias;
                live.waits_for_set = quality.waits_for_set;
                if let Some(method) = &quality.method {
                    request.method.clone_from(method);
                }
            }
            self.poses.sent(pose);
        }
        request.live = Some(live);
        request
    }

    fn accept(&mut self, frame: WholeFrame, peer: &Peer) -> Result<(), Failure> {
        let number = frame.frame;
        let unexpected =
            |reason: &str| Failure::of_peer(peer, ClientError::Unexpected { frame: number, reason: reason.to_owned() });
        let answers = self.poses.answer(number).ok_or_else(|| unexpected("was not requested, or is late"))?;
        let mut planes = self.state.borrow().active.settings.planes;
        let quality = answers.pose.quality.as_ref();
        planes.antialias = quality.map_or(planes.antialias, |quality| quality.antialias);
        check_frame(&answers.pose.request, planes, &frame.header).map_err(|reason| unexpected(&reason))?;
        if quality.is_some_and(|quality| quality.codec != frame.header.codec) {
            return Err(unexpected("has another codec than requested"));
        }
        let plan_epoch = frame.header.sample_set_id.plan_epoch;
        if plan_epoch < self.plan_epoch {
            return Err(unexpected("is of an older plan than the frame before"));
        }
        (self.plan_epoch, self.failing_since) = (plan_epoch, None);
        tracing::debug!(client = self.client_id, frame = number, set = %frame.header.sample_set_id, "received");
        let SentPose { pose, sent } = answers;
        let WholeFrame { header, data, .. } = frame;
        let node_name = peer.share.node_name.clone();
        let received = Instant::now();
        let encoded =
            EncodedFrame { request: pose.request, header, data, node_name, posed: pose.posed, sent, received };
        let passed_on = self.frames.try_send(Ok((encoded, peer.clone())));
        passed_on.map_err(|_| Failure::OfPlan(peer.error("sends more frames than are taken")))
    }
}

impl Call {
    async fn open(peer: Peer) -> Result<Self, Failure> {
        let (requests, outgoing) = mpsc::channel(1);
        let answer = timeout(CALL_TIMEOUT, peer.client.render_views(ReceiverStream::new(outgoing))).await;
        let Ok(answer) = answer else {
            return Err(Failure::OfPlan(peer.error(format!("no answer for {} s", CALL_TIMEOUT.as_secs()))));
        };
        let parts = answer.map_err(|status| Failure::of_status(&peer, &status))?;
        let mut heartbeat = interval(HEARTBEAT);
        heartbeat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Ok(Self { peer, requests, frames: FrameStream::new(parts), heartbeat, is_due: true })
    }
}

fn closed() -> ClientError {
    ClientError::ended("the session was closed")
}

/// Decodes one frame after the other, so that they keep their order.
pub(crate) async fn decode_all(
    mut encoded: mpsc::Receiver<Received>,
    decoded: mpsc::Sender<Result<LiveFrame, ClientError>>,
) {
    while let Some(received) = encoded.recv().await {
        let frame = match received {
            Ok((encoded, peer)) => decode_live(encoded, &peer).await,
            Err(error) => Err(error),
        };
        let is_over = frame.is_err();
        if decoded.send(frame).await.is_err() || is_over {
            return;
        }
    }
}

async fn decode_live(encoded: EncodedFrame, peer: &Peer) -> Result<LiveFrame, ClientError> {
    let EncodedFrame { request, header, data, posed, sent, received, .. } = encoded;
    let (header, view) = decode(WholeFrame { frame: request.frame, header, data }, peer).await?;
    Ok(LiveFrame { frame: Frame { request, view, header }, posed, sent, received, decoded: Instant::now() })
}
