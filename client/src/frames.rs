//! Frames as they come from several compositors at once.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::available_parallelism;
use std::time::{Duration, Instant};

use cluster::{Assignment, RenderViews};
use codec::{DecodeLimits, FrameAssembly, FrameAssemblyError, FrameHeader, FramePart, WholeFrame, decode_view};
use depth_image::View;
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinSet;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Code;
use wire::rpc::Messages;

use crate::ClientError;
use crate::expected::Expected;
use crate::live::{Peer, State};
use crate::plan_change::{lost_peer, successor};
use crate::request_pump::{RequestPump, start_pumps};
use crate::session::ViewRequest;
use crate::trouble::Trouble;

/// Decoded frames that the caller has not taken yet.
const FRAMES_AHEAD: usize = 32;
/// How long a compositor may be silent while frames are due: samplers on slow devices take minutes.
const SILENCE: Duration = Duration::from_secs(600);

/// A view that waited so long for its sample set says how long that took, not how fast its compositor is.
const SET_WAIT_S: f64 = 0.05;

/// A view that came.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// What was asked.
    pub request: ViewRequest,
    /// The picture.
    pub view: View,
    /// Its sample set, encoding and stage times.
    pub header: FrameHeader,
}

type Received = Result<Frame, ClientError>;

/// The frames of one call, in the order they are ready.
#[derive(Debug)]
pub struct Frames {
    received: mpsc::Receiver<Received>,
    expected: Arc<Mutex<Expected>>,
    failed: bool,
    /// Dropped with the frames: the calls then end too.
    _delivery: JoinSet<()>,
}

impl Frames {
    pub(crate) fn start(
        state: watch::Receiver<State>,
        template: RenderViews,
        requests: Vec<ViewRequest>,
        expected: Expected,
    ) -> Self {
        let (send, received) = mpsc::channel(FRAMES_AHEAD);
        let expected = Arc::new(Mutex::new(expected));
        let line = Line {
            send,
            expected: expected.clone(),
            decoders: Arc::new(Semaphore::new(available_parallelism().map_or(1, usize::from))),
        };
        let mut delivery = JoinSet::new();
        delivery.spawn(deliver(state, template, requests, line));
        Self { received, expected, failed: false, _delivery: delivery }
    }

    /// The next frame; `None` when all have come.
    ///
    /// # Errors
    /// The first failure of any compositor, a frame that was not asked for, or, at the end, the frames that
    /// are missing. Nothing comes after an error.
    pub async fn next(&mut self) -> Option<Result<Frame, ClientError>> {
        if self.failed {
            return None;
        }
        let next = match self.received.recv().await {
            Some(received) => received.map(Some),
            None => locked(&self.expected).finish().map(|()| None),
        };
        self.failed = next.is_err();
        next.transpose()
    }

    /// All frames.
    ///
    /// # Errors
    /// As [`Frames::next`].
    pub async fn all(mut self) -> Result<Vec<Frame>, ClientError> {
        let mut frames = Vec::new();
        while let Some(frame) = self.next().await {
            frames.push(frame?);
        }
        Ok(frames)
    }
}

fn locked(expected: &Mutex<Expected>) -> MutexGuard<'_, Expected> {
    expected.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Frames on their way to the caller.
#[derive(Clone)]
struct Line {
    send: mpsc::Sender<Received>,
    expected: Arc<Mutex<Expected>>,
    decoders: Arc<Semaphore>,
}

impl Line {
    /// What is wrong with a frame of such a plan.
    fn wrong_with(&self, frame: &WholeFrame, plan_epoch: u64) -> Option<String> {
        let (number, set) = (frame.frame, frame.header.sample_set_id);
        if set.plan_epoch != plan_epoch {
            return Some(format!("sent a frame of set {set}"));
        }
        let wrong = locked(&self.expected).wrong_with(number, &frame.header);
        wrong.map(|wrong| format!("sent frame {number}, which {wrong}"))
    }

    fn still_due(&self, requests: &[ViewRequest]) -> Vec<ViewRequest> {
        let expected = locked(&self.expected);
        requests.iter().filter(|request| expected.is_due(request.frame)).copied().collect()
    }

    /// A frame that has come; one that came twice counts once. Holds the decoder until there is room: a caller that is
    /// slow holds up the decoding.
    async fn pass(&self, frame: u64, header: FrameHeader, view: View) {
        // An error means that the caller has left. Room first: between what follows nothing can end the call.
        let Ok(room) = self.send.reserve().await else { return };
        let Some(request) = locked(&self.expected).take(frame) else { return };
        room.send(Ok(Frame { request, view, header }));
    }

    /// Whether the caller has not taken what came.
    fn is_full(&self) -> bool {
        self.send.capacity() == 0
    }

    /// Until the caller takes frames again; false if it has left.
    async fn room(&self) -> bool {
        self.send.reserve().await.is_ok()
    }

    async fn fail(&self, error: ClientError) {
        let _ = self.send.send(Err(error)).await;
    }
}

/// Why a call ended before its frames had come.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The plan may be on its way out: its successor is asked for what is missing.
    OfPlan(ClientError),
    /// Another plan would fail as well.
    OfRequest(ClientError),
    /// This compositor has no room.
    Exhausted(ClientError),
}

impl Failure {
    /// Others are asked first from now on.
    pub(crate) fn of_peer(peer: &Peer, error: ClientError) -> Self {
        peer.suspicion.raise();
        Self::OfPlan(error)
    }

    pub(crate) fn of(peer: &Peer, status: &tonic::Status) -> Self {
        let error = peer.error(status.message());
        match status.code() {
            Code::InvalidArgument | Code::NotFound | Code::Unimplemented => Self::OfRequest(error),
            Code::ResourceExhausted => Self::Exhausted(ClientError::Exhausted { reason: error.to_string() }),
            // It waited for this client, whose caller was busy.
            Code::DeadlineExceeded => Self::OfPlan(error),
            // Of which plan is in force it knows better; anything else may be its own fault.
            Code::FailedPrecondition => {
                peer.learn(status);
                Self::OfPlan(error)
            }
            _ => Self::of_peer(peer, error),
        }
    }
}

/// Asks for all frames, and after a fault for those that are missing, of whatever plan is in force by then.
async fn deliver(mut state: watch::Receiver<State>, template: RenderViews, requests: Vec<ViewRequest>, line: Line) {
    let mut trouble = Trouble::new(requests.len());
    loop {
        let live = state.borrow_and_update().live.clone();
        let due = line.still_due(&requests);
        if due.is_empty() {
            return;
        }
        let plan_epoch = live.plan_epoch();
        let mut template = RenderViews { plan_epoch, ..template.clone() };
        if template.method.is_empty() {
            template.method.clone_from(&live.plan.assignment.workload.method);
        }
        let due = cell_by_cell(&live.plan.assignment, due);
        let peers = live.trusted();
        let ended = tokio::select! {
            ended = call_all(&peers, (&template, live.plan.view_s()), due, &line) => ended,
            lost = lost_peer(state.clone(), plan_epoch, &peers) => Err(Failure::OfPlan(lost)),
        };
        let error = match ended {
            // What has not come then is missing.
            Ok(()) => return,
            Err(Failure::OfRequest(error) | Failure::Exhausted(error)) => error,
            // Calls of a caller who takes nothing end of themselves, and nobody is to blame.
            Err(Failure::OfPlan(_)) if line.is_full() => match line.room().await {
                true => continue,
                false => return,
            },
            Err(Failure::OfPlan(error)) => match trouble.pause(line.still_due(&requests).len()) {
                None => error,
                Some(pause) => match successor(&mut state, plan_epoch, pause, error).await {
                    None => continue,
                    Some(error) => error,
                },
            },
        };
        return line.fail(error).await;
    }
}

/// Of every set, views of one view cell next to each other: a compositor then needs the images of few.
fn cell_by_cell(plan: &Assignment, mut requests: Vec<ViewRequest>) -> Vec<ViewRequest> {
    if plan.workload.cell_count() > 1 {
        let sets = requests.chunk_by_mut(|a, b| a.set_index == b.set_index);
        sets.for_each(|views| views.sort_by_cached_key(|view| plan.cell_of(&view.camera)));
    }
    requests
}

/// All calls of a plan, until they end or one fails.
async fn call_all(
    peers: &[Peer],
    (template, view_s): (&RenderViews, f64),
    requests: Vec<ViewRequest>,
    line: &Line,
) -> Result<(), Failure> {
    let weights: Vec<u32> = peers.iter().map(|peer| peer.share.view_weight).collect();
    let mut calls = JoinSet::new();
    for (peer, part) in peers.iter().zip(start_pumps(template, requests, &weights, Some(view_s))) {
        if let Some((pump, messages)) = part {
            calls.spawn(receive_all(peer.clone(), pump, messages, line.clone()));
        }
    }
    while let Some(ended) = calls.join_next().await {
        // A call that panics is this library's fault, and its frames are then missing.
        ended.unwrap_or(Ok(()))?;
    }
    Ok(())
}

async fn receive_all(
    peer: Peer,
    mut pump: RequestPump,
    messages: ReceiverStream<RenderViews>,
    line: Line,
) -> Result<(), Failure> {
    let mut parts = peer.client.render_views(messages).await.map_err(|status| Failure::of(&peer, &status))?;
    let mut assembly = FrameAssembly::default();
    let mut decoding = JoinSet::new();
    while let Some(frame) = next_frame(&mut parts, &mut assembly, &peer).await? {
        if let Some(wrong) = line.wrong_with(&frame, pump.plan_epoch()) {
            return Err(Failure::of_peer(&peer, peer.error(wrong)));
        }
        pump.received(Instant::now(), frame.header.stage_times.set_wait_s > SET_WAIT_S);
        let Ok(decoder) = line.decoders.clone().acquire_owned().await else {
            break;
        };
        let (peer, line) = (peer.clone(), line.clone());
        decoding.spawn(async move {
            let (number, header, view) = decode(frame, &peer).await.map_err(|error| Failure::of_peer(&peer, error))?;
            line.pass(number, header, view).await;
            drop(decoder);
            Ok(())
        });
        while let Some(decoded) = decoding.try_join_next() {
            decoded.unwrap_or(Ok(()))?;
        }
    }
    while let Some(decoded) = decoding.join_next().await {
        decoded.unwrap_or(Ok(()))?;
    }
    Ok(())
}

/// The next whole frame; `None` at the stream's end.
pub(crate) async fn next_frame(
    parts: &mut Messages<FramePart>,
    assembly: &mut FrameAssembly,
    peer: &Peer,
) -> Result<Option<WholeFrame>, Failure> {
    let corrupt = |error: FrameAssemblyError| Failure::of_peer(peer, peer.error(error));
    while let Some(part) = next_part(parts, peer).await? {
        if let Some(frame) = assembly.push(part).map_err(corrupt)? {
            return Ok(Some(frame));
        }
    }
    assembly.finish().map_err(corrupt)?;
    Ok(None)
}

async fn next_part(parts: &mut Messages<FramePart>, peer: &Peer) -> Result<Option<FramePart>, Failure> {
    match tokio::time::timeout(SILENCE, parts.next()).await {
        Ok(part) => part.transpose().map_err(|status| Failure::of(peer, &status)),
        Err(_) => Err(Failure::of_peer(peer, peer.error(format!("no frame came for {} s", SILENCE.as_secs())))),
    }
}

async fn decode(frame: WholeFrame, peer: &Peer) -> Result<(u64, FrameHeader, View), ClientError> {
    let decoded = tokio::task::spawn_blocking(move || {
        decode_view(&frame, &DecodeLimits::default()).map(|view| (frame.frame, frame.header, view))
    })
    .await;
    match decoded {
        Ok(Ok(received)) => Ok(received),
        Ok(Err(error)) => Err(peer.error(error)),
        Err(error) => Err(peer.error(error)),
    }
}
