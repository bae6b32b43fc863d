//! A compositor that a client talks to, and a call to it: its frames, received whole and then decoded, and its failures.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{Assignment, CompositorShare};
use codec::{DecodeLimits, FrameAssembly, FrameHeader, FramePart, WholeFrame, decode_view};
use depth_image::View;
use parking_lot::Mutex;
use tokio::sync::mpsc;
use tokio_stream::StreamExt as _;
use tonic::transport::Channel;
use tonic::{Code, Status};
use wire::plan_in_force;
use wire::rpc::{CompositorClient, Messages};

use crate::error::ClientError;
use crate::frames::{FrameRoom, FrameSink};

/// The time that a compositor is passed over after a failure, where there are others.
const OPEN_FOR: Duration = Duration::from_secs(10);
/// The time without a frame that is due, on a stream that is alive: samplers on slow devices take minutes.
const MOST_WAIT: Duration = Duration::from_secs(600);

/// The circuit breaker of one compositor; clones share it.
#[derive(Debug, Clone, Default)]
pub(crate) struct CircuitBreaker(Arc<Mutex<Option<Instant>>>);

impl CircuitBreaker {
    /// The compositor has failed.
    fn trip(&self) {
        *self.0.lock() = Some(Instant::now());
    }

    /// Whether the compositor is to be passed over.
    pub(crate) fn is_open(&self) -> bool {
        self.0.lock().is_some_and(|failed| failed.elapsed() < OPEN_FOR)
    }
}

/// A compositor and the channel to it.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) share: CompositorShare,
    pub(crate) client: CompositorClient,
    pub(crate) breaker: CircuitBreaker,
    /// Plans that compositors name.
    named_plans: mpsc::Sender<Assignment>,
}

impl Peer {
    pub(crate) fn new(share: &CompositorShare, channel: Channel, named_plans: mpsc::Sender<Assignment>) -> Self {
        let client = CompositorClient::new(channel);
        Self { share: share.clone(), client, breaker: CircuitBreaker::default(), named_plans }
    }

    pub(crate) fn error(&self, reason: impl ToString) -> ClientError {
        ClientError::compositor(&self.share, reason)
    }
}

/// Why a call ended before all its frames were received.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The plan may be about to be replaced: its successor is asked for the missing frames.
    OfPlan(ClientError),
    /// Another plan would fail as well.
    OfRequest(ClientError),
    /// This compositor has no room.
    Exhausted(ClientError),
}

impl Failure {
    /// The peer is at fault: other compositors are asked first from now on.
    pub(crate) fn of_peer(peer: &Peer, error: ClientError) -> Self {
        peer.breaker.trip();
        Self::OfPlan(error)
    }

    /// The failure of a peer that sent something wrong, or nothing in time.
    fn of_fault(peer: &Peer, fault: impl ToString) -> Self {
        Self::of_peer(peer, peer.error(fault))
    }

    /// The failure that a status of the peer means.
    pub(crate) fn of_status(peer: &Peer, status: &Status) -> Self {
        let error = peer.error(status.message());
        match status.code() {
            Code::InvalidArgument | Code::NotFound | Code::Unimplemented => Self::OfRequest(error),
            Code::ResourceExhausted => Self::Exhausted(ClientError::Exhausted { reason: error.to_string() }),
            // The compositor waited for this client, whose caller was busy.
            Code::DeadlineExceeded => Self::OfPlan(error),
            // The compositor knows better which plan is in force, and names it: the coordinator may be out of reach.
            Code::FailedPrecondition => {
                if let Some(assignment) = plan_in_force(status) {
                    // Where there is no room, other compositors have named it.
                    let _ = peer.named_plans.try_send(assignment);
                }
                Self::OfPlan(error)
            }
            _ => Self::of_peer(peer, error),
        }
    }
}

/// The frames of one call, before they are decoded.
pub(crate) struct FrameStream {
    parts: Messages<FramePart>,
    assembly: FrameAssembly,
}

impl FrameStream {
    pub(crate) fn new(parts: Messages<FramePart>) -> Self {
        Self { parts, assembly: FrameAssembly::default() }
    }

    /// The next whole frame of `peer`; `None` at the stream's end. A sink admits frames of a plan's epoch: a frame then has its
    /// room before its first bytes are kept. Without a sink it can be dropped and called again without losing a frame.
    pub(crate) async fn next(
        &mut self,
        peer: &Peer,
        admission: Option<(&FrameSink, u64)>,
    ) -> Result<Option<(WholeFrame, Option<FrameRoom>)>, Failure> {
        let mut room = None;
        while let Some(part) = self.next_part(peer).await? {
            if let (Some((sink, plan_epoch)), Some(header)) = (admission, &part.header) {
                // Whoever waits for room has none: two compositors would wait for each other.
                drop(room.take());
                let admitted = sink.admit(part.frame, header, plan_epoch).await;
                room = Some(admitted.map_err(|fault| Failure::of_fault(peer, fault))?);
            }
            if let Some(frame) = self.assembly.push(part).map_err(|error| Failure::of_fault(peer, error))? {
                return Ok(Some((frame, room)));
            }
        }
        self.assembly.finish().map_err(|error| Failure::of_fault(peer, error))?;
        Ok(None)
    }

    async fn next_part(&mut self, peer: &Peer) -> Result<Option<FramePart>, Failure> {
        match tokio::time::timeout(MOST_WAIT, self.parts.next()).await {
            Ok(part) => part.transpose().map_err(|status| Failure::of_status(peer, &status)),
            Err(_) => Err(Failure::of_fault(peer, format!("no frame was received for {} s", MOST_WAIT.as_secs()))),
        }
    }
}

/// Decodes a frame of `peer` on a blocking thread.
pub(crate) async fn decode(frame: WholeFrame, peer: &Peer) -> Result<(FrameHeader, View), ClientError> {
    let decoded = tokio::task::spawn_blocking(move || (decode_view(&frame, &DecodeLimits::VIEWS), frame.header));
    let (view, header) = decoded.await.map_err(|error| peer.error(error))?;
    Ok((header, view.map_err(|error| peer.error(error))?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_breaker_opens_on_failure_and_closes_after_a_while() {
        let breaker = CircuitBreaker::default();
        assert!(!breaker.is_open());
        breaker.clone().trip();
        assert!(breaker.is_open());
        *breaker.0.lock() = Instant::now().checked_sub(OPEN_FOR);
        assert!(!breaker.is_open());
    }
}
