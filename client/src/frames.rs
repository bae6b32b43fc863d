//! Frames as they come from several compositors at once.

use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Duration;

use depth_image::View;
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinSet;
use tokio_stream::StreamExt as _;
use wire::limits::MAX_VIEWS_PER_REQUEST;
use wire::rpc::Messages;
use wire::{DecodeLimits, FrameAssembly, FrameHeader, FramePart, RenderViews, RequestedView, WholeFrame, decode_view};

use crate::ClientError;
use crate::expected::Expected;
use crate::session::{Peer, ViewRequest};

/// Decoded frames that the caller has not taken yet.
const FRAMES_AHEAD: usize = 32;
/// How long a compositor that failed may be ahead of the coordinator's word why.
const WORD: Duration = Duration::from_millis(200);
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
    ended: watch::Receiver<Option<String>>,
    failed: bool,
    /// Dropped with the frames: the calls then end too.
    _calls: JoinSet<()>,
}

impl Frames {
    pub(crate) fn start(
        peers: &[Peer],
        template: &RenderViews,
        requests: Vec<ViewRequest>,
        expected: Expected,
        ended: watch::Receiver<Option<String>>,
    ) -> Self {
        let (send, received) = mpsc::channel(FRAMES_AHEAD);
        let decoders = Arc::new(Semaphore::new(available_parallelism().map_or(1, usize::from)));
        let mut calls = JoinSet::new();
        for (peer, requests) in peers.iter().zip(spread(template, &requests, peers.len())) {
            if !requests.is_empty() {
                calls.spawn(receive(peer.clone(), requests, decoders.clone(), send.clone()));
            }
        }
        Self { received, expected, ended, failed: false, _calls: calls }
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
            Some(Err(error)) => Err(self.reason(error).await),
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

    /// A node that leaves breaks streams, and the coordinator says which: its word is the better one.
    async fn reason(&mut self, error: ClientError) -> ClientError {
        match tokio::time::timeout(WORD, self.ended.wait_for(Option::is_some)).await {
            Ok(Ok(reason)) => {
                ClientError::Ended { reason: format!("{} ({error})", reason.as_deref().unwrap_or_default()) }
            }
            _ => error,
        }
    }
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

async fn receive(peer: Peer, requests: Vec<RenderViews>, decoders: Arc<Semaphore>, send: mpsc::Sender<Received>) {
    if let Err(error) = receive_all(&peer, requests, decoders, &send).await {
        // An error means that the caller has left.
        let _ = send.send(Err(error)).await;
    }
}

async fn receive_all(
    peer: &Peer,
    requests: Vec<RenderViews>,
    decoders: Arc<Semaphore>,
    send: &mpsc::Sender<Received>,
) -> Result<(), ClientError> {
    let status = |status: tonic::Status| peer.error(status.message());
    let mut parts = peer.client.render_views(tokio_stream::iter(requests)).await.map_err(status)?;
    let mut assembly = FrameAssembly::default();
    let mut decoding = JoinSet::new();
    while let Some(frame) = next_frame(&mut parts, &mut assembly, peer).await? {
        let Ok(decoder) = decoders.clone().acquire_owned().await else {
            break;
        };
        let (peer, send) = (peer.clone(), send.clone());
        decoding.spawn(async move {
            // The permit is held until there is room: a caller that is slow holds up the decoding.
            let _ = send.send(decode(frame, &peer).await).await;
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
) -> Result<Option<WholeFrame>, ClientError> {
    while let Some(part) = next_part(parts, peer).await? {
        if let Some(frame) = assembly.push(part).map_err(|error| peer.error(error))? {
            return Ok(Some(frame));
        }
    }
    assembly.finish().map_err(|error| peer.error(error))?;
    Ok(None)
}

async fn next_part(parts: &mut Messages<FramePart>, peer: &Peer) -> Result<Option<FramePart>, ClientError> {
    match tokio::time::timeout(SILENCE, parts.next()).await {
        Ok(part) => part.transpose().map_err(|status| peer.error(status.message())),
        Err(_) => Err(peer.error(format!("no frame came for {} s", SILENCE.as_secs()))),
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
