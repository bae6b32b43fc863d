//! Requests frames from all compositors of a plan at once, and after a fault the missing ones from the next plan's.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::RenderViews;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;
use wire::rpc::Backoff;

use crate::active_plan::{ActivePlan, SessionState, first_in};
use crate::batch::Batch;
use crate::error::ClientError;
use crate::frames::FrameSink;
use crate::peer::{Failure, FrameStream, Peer, decode};

/// A view that waited longer for its sample set does not show its compositor's speed.
const SET_WAIT_S: f64 = 0.05;
/// The time that a compositor without a place in the next plan has to send the frames it was asked for.
const LAST_WORK: Duration = Duration::from_secs(1);
/// The time without any frame after which a request fails: a host that is lost without a word is missed after 15 s.
pub(crate) const GIVE_UP_AFTER: Duration = Duration::from_secs(20);
/// The time that a later plan is waited for before compositors of the same plan are asked again.
const FIRST_DELAY: Duration = Duration::from_millis(50);
const LONGEST_DELAY: Duration = Duration::from_secs(1);

/// Requests all frames, and after a fault the missing ones, under the plan in force by then.
pub(crate) async fn deliver(mut state: watch::Receiver<SessionState>, sink: FrameSink) {
    let mut retries = Retries::new(0);
    loop {
        let active = state.borrow_and_update().active.clone();
        if sink.window.lock().is_complete() {
            return;
        }
        let failed = match call_all(&state, &active, &sink).await {
            Err(failure) => failure,
            // A changed byte on the way may end a stream as if it were complete.
            Ok(()) => match sink.missing() {
                Some(missing) => Failure::OfPlan(missing),
                None => return,
            },
        };
        let error = match failed {
            Failure::OfRequest(error) | Failure::Exhausted(error) => error,
            // Calls of a caller that takes nothing end by themselves, and no compositor is to blame.
            Failure::OfPlan(_) if sink.is_full() => match sink.wait_for_room().await {
                true => continue,
                false => return,
            },
            Failure::OfPlan(error) => {
                let received = sink.window.lock().received;
                match retries.next_delay(Instant::now(), received) {
                    None => error,
                    Some(delay) => {
                        let later = state.wait_for(|state| state.active.plan_epoch() > active.plan_epoch());
                        match tokio::time::timeout(delay, later).await {
                            // The session was dropped.
                            Ok(Err(_)) => error,
                            Ok(Ok(_)) | Err(_) => continue,
                        }
                    }
                }
            }
        };
        return sink.fail(error).await;
    }
}

/// All calls under a plan, until they end, one fails, or a later plan loses one of the compositors.
async fn call_all(
    state: &watch::Receiver<SessionState>,
    active: &Arc<ActivePlan>,
    sink: &FrameSink,
) -> Result<(), Failure> {
    let mut peers = active.trusted();
    let mut request = active.request();
    {
        let mut window = sink.window.lock();
        // To make one view of a set, a compositor loads all of it.
        peers.truncate(window.most_views_of_a_set());
        request.planes = window.planes;
        if let Some(method) = &window.method {
            request.method.clone_from(method);
        }
    }
    let weights: Vec<u32> = peers.iter().map(|peer| peer.share.view_weight).collect();
    let plan = active.clone();
    let started = Batch::start(request, sink.window.clone(), &weights, active.plan.view_s(), move |camera| {
        plan.plan.assignment.cell_of(camera)
    });
    let mut calls = JoinSet::new();
    for (compositor, messages) in started.messages.into_iter().enumerate() {
        if let Some(messages) = messages {
            let batch = started.batch.clone();
            let received = move |waited_for_set| batch.lock().received(compositor, Instant::now(), waited_for_set);
            let plan_epoch = active.plan_epoch();
            calls.spawn(receive_all(peers[compositor].clone(), messages, plan_epoch, sink.clone(), received));
        }
    }
    tokio::select! {
        ended = all(&mut calls) => ended,
        lost = wait_for_lost_peer(state.clone(), active.plan_epoch(), &peers) => Err(Failure::OfPlan(lost)),
    }
}

/// Waits until all tasks have ended or one has failed.
async fn all(tasks: &mut JoinSet<Result<(), Failure>>) -> Result<(), Failure> {
    while let Some(ended) = tasks.join_next().await {
        // A task that panics is this library's fault, and its frames are then missing.
        ended.unwrap_or(Ok(()))?;
    }
    Ok(())
}

/// Receives the frames that a compositor is asked for; `received` is called for each, and whether it waited for its set.
async fn receive_all(
    peer: Peer,
    messages: ReceiverStream<RenderViews>,
    plan_epoch: u64,
    sink: FrameSink,
    received: impl Fn(bool),
) -> Result<(), Failure> {
    let parts = peer.client.render_views(messages).await.map_err(|status| Failure::of_status(&peer, &status))?;
    let mut frames = FrameStream::new(parts);
    let mut decoding = JoinSet::new();
    while let Some((frame, room)) = frames.next(&peer, Some((&sink, plan_epoch))).await? {
        received(frame.header.stage_times.set_wait_s > SET_WAIT_S);
        let Ok(decoder) = sink.decoders.clone().acquire_owned().await else { break };
        let peer = peer.clone();
        let sink = sink.clone();
        decoding.spawn(async move {
            let number = frame.frame;
            let (header, view) = decode(frame, &peer).await.map_err(|error| Failure::of_peer(&peer, error))?;
            sink.pass_on(number, header, view, room);
            drop(decoder);
            Ok(())
        });
        while let Some(decoded) = decoding.try_join_next() {
            decoded.unwrap_or(Ok(()))?;
        }
    }
    all(&mut decoding).await
}

/// Resolves when a later plan has no place for one of `peers`: it may be lost without a word.
pub(crate) async fn wait_for_lost_peer(
    state: watch::Receiver<SessionState>,
    plan_epoch: u64,
    peers: &[Peer],
) -> ClientError {
    let lost = first_in(state, |state| {
        let plan = &state.active.plan.assignment;
        let lost = peers.iter().find(|peer| !plan.composites(&peer.share.node_name));
        lost.filter(|_| plan.plan_epoch > plan_epoch)
    });
    let lost = lost.await;
    tokio::time::sleep(LAST_WORK).await;
    lost.error("is not of the plan any more")
}

/// The retries of one request for frames.
#[derive(Debug)]
pub(crate) struct Retries {
    /// Frames that had been received at the last fault.
    received: u64,
    /// The first fault since a frame was received.
    failing_since: Option<Instant>,
    backoff: Backoff,
}

impl Retries {
    pub(crate) fn new(received: u64) -> Self {
        Self { received, failing_since: None, backoff: Backoff::new(FIRST_DELAY, 2, LONGEST_DELAY) }
    }

    /// The delay before the next attempt; `None` where no frame has been received for too long.
    pub(crate) fn next_delay(&mut self, now: Instant, received: u64) -> Option<Duration> {
        if received > self.received {
            *self = Self::new(received);
        }
        let since = *self.failing_since.get_or_insert(now);
        let delay = self.backoff.next_delay();
        (now.saturating_duration_since(since) < GIVE_UP_AFTER).then_some(delay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retries_end_where_no_frame_is_received() {
        let mut retries = Retries::new(0);
        let start = Instant::now();
        let at = |s: u64| start + Duration::from_secs(s);
        assert_eq!(retries.next_delay(at(1), 0), Some(FIRST_DELAY));
        assert_eq!(retries.next_delay(at(2), 0), Some(2 * FIRST_DELAY));
        assert_eq!(retries.next_delay(at(18), 1), Some(FIRST_DELAY), "one frame was received");
        assert_eq!(retries.next_delay(at(37), 1), Some(2 * FIRST_DELAY));
        assert_eq!(retries.next_delay(at(39), 1), None);
        let delays: Vec<_> = (0..9).map(|_| retries.next_delay(start, 1)).collect();
        assert_eq!(delays[8], Some(LONGEST_DELAY));
    }
}
