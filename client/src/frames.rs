//! Frames as they come from several compositors at once.

use std::collections::HashSet;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::available_parallelism;
use std::time::Duration;

use depth_image::View;
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinSet;
use tokio_stream::StreamExt as _;
use tonic::Code;
use wire::limits::MAX_VIEWS_PER_REQUEST;
use wire::rpc::Messages;
use wire::{DecodeLimits, FrameAssembly, FrameHeader, FramePart, RenderViews, RequestedView, WholeFrame, decode_view};

use crate::ClientError;
use crate::expected::Expected;
use crate::live::{Peer, State};
use crate::session::ViewRequest;

/// Decoded frames that the caller has not taken yet.
const FRAMES_AHEAD: usize = 32;
/// How long a plan whose compositor failed may take to be replaced: a host that is lost without a word is missed after
/// 15 s.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long a compositor may be silent while frames are due: samplers on slow devices take minutes.
const SILENCE: Duration = Duration::from_secs(600);

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

type Received = Result<(u64, FrameHeader, View), ClientError>;

/// The frames of one call, in the order they are ready.
#[derive(Debug)]
pub struct Frames {
    received: mpsc::Receiver<Received>,
    expected: Expected,
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
        let outstanding = requests.iter().map(|request| request.frame).collect();
        let line = Line {
            send,
            outstanding: Arc::new(Mutex::new(outstanding)),
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
            Some(Ok((frame, header, view))) => {
                self.expected.accept(frame, &header).map(|request| Some(Frame { request, view, header }))
            }
            Some(Err(error)) => Err(error),
            None => self.expected.finish().map(|()| None),
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

/// Frames on their way to the caller.
#[derive(Clone)]
struct Line {
    send: mpsc::Sender<Received>,
    /// Frames that have not come.
    outstanding: Arc<Mutex<HashSet<u64>>>,
    decoders: Arc<Semaphore>,
}

impl Line {
    fn still_due(&self, requests: &[ViewRequest]) -> Vec<ViewRequest> {
        let outstanding = self.outstanding.lock().unwrap_or_else(PoisonError::into_inner);
        requests.iter().filter(|request| outstanding.contains(&request.frame)).copied().collect()
    }

    /// Holds the decoder until there is room: a caller that is slow holds up the decoding. An error means that the
    /// caller has left.
    async fn pass(&self, frame: Received) {
        if let Ok((number, ..)) = &frame {
            self.outstanding.lock().unwrap_or_else(PoisonError::into_inner).remove(number);
        }
        let _ = self.send.send(frame).await;
    }
}

/// Why a call ended before its frames had come.
#[derive(Debug)]
enum Failure {
    /// The plan may be on its way out: its successor is asked for what is missing.
    OfPlan(ClientError),
    /// Another plan would fail as well.
    OfRequest(ClientError),
}

impl Failure {
    fn of(peer: &Peer, status: &tonic::Status) -> Self {
        let error = peer.error(status.message());
        match status.code() {
            Code::InvalidArgument
            | Code::OutOfRange
            | Code::NotFound
            | Code::Unimplemented
            | Code::ResourceExhausted => Self::OfRequest(error),
            _ => Self::OfPlan(error),
        }
    }
}

/// Asks for all frames, and after a fault for those that are missing, of whatever plan is in force by then.
async fn deliver(mut state: watch::Receiver<State>, template: RenderViews, requests: Vec<ViewRequest>, line: Line) {
    loop {
        let live = state.borrow_and_update().live.clone();
        let due = line.still_due(&requests);
        if due.is_empty() {
            return;
        }
        let plan_epoch = live.plan.assignment.plan_epoch;
        let template = RenderViews { plan_epoch, ..template.clone() };
        let error = match call_all(&live.peers, &template, &due, &line).await {
            // What has not come then is missing.
            Ok(()) => return,
            Err(Failure::OfRequest(error)) => error,
            Err(Failure::OfPlan(error)) => match successor(&mut state, plan_epoch, error).await {
                None => continue,
                Some(error) => error,
            },
        };
        return line.pass(Err(error)).await;
    }
}

/// Waits for a later plan; else says why there is none.
async fn successor(state: &mut watch::Receiver<State>, plan_epoch: u64, error: ClientError) -> Option<ClientError> {
    let later = |state: &State| state.ended.is_some() || state.live.plan.assignment.plan_epoch > plan_epoch;
    match tokio::time::timeout(PATIENCE, state.wait_for(later)).await {
        Ok(Ok(state)) => {
            let reason = state.ended.as_ref()?;
            Some(ClientError::Ended { reason: format!("{reason} ({error})") })
        }
        _ => Some(error),
    }
}

/// All calls of a plan, until they end or one fails.
async fn call_all(
    peers: &[Peer],
    template: &RenderViews,
    requests: &[ViewRequest],
    line: &Line,
) -> Result<(), Failure> {
    let mut calls = JoinSet::new();
    for (peer, requests) in peers.iter().zip(spread(template, requests, peers.len())) {
        if !requests.is_empty() {
            calls.spawn(receive_all(peer.clone(), requests, line.clone()));
        }
    }
    while let Some(ended) = calls.join_next().await {
        // A call that panics is this library's fault, and its frames are then missing.
        ended.unwrap_or(Ok(()))?;
    }
    Ok(())
}

/// The requests of each compositor: of every run of one set an even, contiguous share.
fn spread(template: &RenderViews, requests: &[ViewRequest], peers: usize) -> Vec<Vec<RenderViews>> {
    let mut spread = vec![Vec::new(); peers];
    for run in requests.chunk_by(|a, b| a.set_index == b.set_index) {
        for (peer, of_peer) in spread.iter_mut().enumerate() {
            let share = &run[peer * run.len() / peers..(peer + 1) * run.len() / peers];
            for views in share.chunks(MAX_VIEWS_PER_REQUEST) {
                let requested =
                    views.iter().map(|view| RequestedView { frame: view.frame, camera: view.camera }).collect();
                of_peer.push(RenderViews { set_index: views[0].set_index, views: requested, ..template.clone() });
            }
        }
    }
    spread
}

async fn receive_all(peer: Peer, requests: Vec<RenderViews>, line: Line) -> Result<(), Failure> {
    let plan_epoch = requests.first().map(|request| request.plan_epoch);
    let mut parts =
        peer.client.render_views(tokio_stream::iter(requests)).await.map_err(|status| Failure::of(&peer, &status))?;
    let mut assembly = FrameAssembly::default();
    let mut decoding = JoinSet::new();
    while let Some(frame) = next_frame(&mut parts, &mut assembly, &peer).await? {
        if Some(frame.header.sample_set_id.plan_epoch) != plan_epoch {
            return Err(Failure::OfPlan(peer.error(format!("sent a frame of set {}", frame.header.sample_set_id))));
        }
        let Ok(decoder) = line.decoders.clone().acquire_owned().await else {
            break;
        };
        let (peer, line) = (peer.clone(), line.clone());
        decoding.spawn(async move {
            let frame = decode(frame, &peer).await;
            line.pass(frame).await;
            drop(decoder);
        });
        while decoding.try_join_next().is_some() {}
    }
    while decoding.join_next().await.is_some() {}
    Ok(())
}

/// The next whole frame; `None` at the stream's end.
async fn next_frame(
    parts: &mut Messages<FramePart>,
    assembly: &mut FrameAssembly,
    peer: &Peer,
) -> Result<Option<WholeFrame>, Failure> {
    let corrupt = |error: wire::WireError| Failure::OfPlan(peer.error(error));
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
        Err(_) => Err(Failure::OfPlan(peer.error(format!("no frame came for {} s", SILENCE.as_secs())))),
    }
}

async fn decode(frame: WholeFrame, peer: &Peer) -> Received {
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
