//! Requests frames from all compositors of a plan at once, and after a fault the missing ones from the next plan's.

use std::time::Instant;

use cluster::{Assignment, RenderViews};
use codec::FrameCodec;
use depth_image::ViewPlanes;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;

use crate::active_plan::{ActivePlan, SessionState};
use crate::frame_sink::FrameSink;
use crate::frame_stream::{FrameStream, decode};
use crate::peer::{Failure, Peer};
use crate::plan_change::{wait_for_lost_peer, wait_for_successor};
use crate::request_pump::{RequestPump, start_pumps};
use crate::retry::Retries;
use crate::view_request::ViewRequest;

/// A view that waited longer for its sample set does not show its compositor's speed.
const SET_WAIT_S: f64 = 0.05;

/// The settings that all views of a request share.
#[derive(Debug, Clone)]
pub(crate) struct Template {
    /// `None`: the method of the plan in force.
    pub(crate) method: Option<String>,
    pub(crate) codec: FrameCodec,
    pub(crate) planes: ViewPlanes,
}

impl Template {
    /// A message without views, of set 0.
    pub(crate) fn message(&self, plan: &Assignment) -> RenderViews {
        RenderViews {
            plan_epoch: plan.plan_epoch,
            set_index: 0,
            method: self.method.clone().unwrap_or_else(|| plan.workload.method.clone()),
            codec: self.codec,
            planes: self.planes,
            views: Vec::new(),
            live: None,
        }
    }
}

/// Requests all frames, and after a fault the missing ones, under the plan in force by then.
pub(crate) async fn deliver(
    mut state: watch::Receiver<SessionState>,
    template: Template,
    requests: Vec<ViewRequest>,
    sink: FrameSink,
) {
    let mut retries = Retries::new(requests.len());
    loop {
        let active = state.borrow_and_update().active.clone();
        let missing = sink.missing(&requests);
        if missing.is_empty() {
            return;
        }
        let error = match call_all(&state, &active, &template, missing, &sink).await {
            // Frames that are still missing will not come.
            Ok(()) => return,
            Err(Failure::OfRequest(error) | Failure::Exhausted(error)) => error,
            // Calls of a caller that takes nothing end by themselves, and no compositor is to blame.
            Err(Failure::OfPlan(_)) if sink.is_full() => match sink.wait_for_room().await {
                true => continue,
                false => return,
            },
            Err(Failure::OfPlan(error)) => match retries.next_delay(sink.missing(&requests).len()) {
                None => error,
                Some(delay) => match wait_for_successor(&mut state, active.plan_epoch(), delay, error).await {
                    Ok(()) => continue,
                    Err(error) => error,
                },
            },
        };
        return sink.fail(error).await;
    }
}

/// All calls under a plan, until they end, one fails, or a later plan loses one of the compositors.
async fn call_all(
    state: &watch::Receiver<SessionState>,
    active: &ActivePlan,
    template: &Template,
    missing: Vec<ViewRequest>,
    sink: &FrameSink,
) -> Result<(), Failure> {
    let plan = &active.plan.assignment;
    let (peers, requests) = (active.trusted(), cell_by_cell(plan, missing));
    let weights: Vec<u32> = peers.iter().map(|peer| peer.share.view_weight).collect();
    let pumps = start_pumps(&template.message(plan), requests, &weights, Some(active.plan.view_s()));
    let mut calls = JoinSet::new();
    for (peer, pump) in peers.iter().zip(pumps) {
        if let Some((pump, messages)) = pump {
            calls.spawn(receive_all(peer.clone(), pump, messages, sink.clone()));
        }
    }
    tokio::select! {
        ended = all(&mut calls) => ended,
        lost = wait_for_lost_peer(state.clone(), plan.plan_epoch, &peers) => Err(Failure::OfPlan(lost)),
    }
}

/// Groups the views of every set by view cell: a compositor then needs the images of few cells.
fn cell_by_cell(plan: &Assignment, mut requests: Vec<ViewRequest>) -> Vec<ViewRequest> {
    if plan.workload.cell_count() > 1 {
        let sets = requests.chunk_by_mut(|a, b| a.set_index == b.set_index);
        sets.for_each(|views| views.sort_by_cached_key(|view| plan.cell_of(&view.camera)));
    }
    requests
}

/// Waits until all tasks have ended or one has failed.
async fn all(tasks: &mut JoinSet<Result<(), Failure>>) -> Result<(), Failure> {
    while let Some(ended) = tasks.join_next().await {
        // A task that panics is this library's fault, and its frames are then missing.
        ended.unwrap_or(Ok(()))?;
    }
    Ok(())
}

async fn receive_all(
    peer: Peer,
    mut pump: RequestPump,
    messages: ReceiverStream<RenderViews>,
    sink: FrameSink,
) -> Result<(), Failure> {
    let parts = peer.client.render_views(messages).await.map_err(|status| Failure::of_status(&peer, &status))?;
    let mut frames = FrameStream::new(parts);
    let mut decoding = JoinSet::new();
    while let Some(frame) = frames.next(&peer).await? {
        if let Some(fault) = sink.fault_of(&frame, pump.plan_epoch()) {
            return Err(Failure::of_peer(&peer, peer.error(fault)));
        }
        pump.received(Instant::now(), frame.header.stage_times.set_wait_s > SET_WAIT_S);
        let Some(decoder) = sink.decoder().await else { break };
        let (peer, sink) = (peer.clone(), sink.clone());
        decoding.spawn(async move {
            let number = frame.frame;
            let (header, view) = decode(frame, &peer).await.map_err(|error| Failure::of_peer(&peer, error))?;
            sink.pass_on(number, header, view).await;
            drop(decoder);
            Ok(())
        });
        while let Some(decoded) = decoding.try_join_next() {
            decoded.unwrap_or(Ok(()))?;
        }
    }
    all(&mut decoding).await
}
