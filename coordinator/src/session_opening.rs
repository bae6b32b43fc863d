//! Session opening: the costs of a requested session are measured.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use cluster::{MeasureCosts, Measured, NodeStatus, SessionEvent, SessionRequest, SessionStage, Workload};
use tonic::{Code, Status};
use wire::rpc::{Backoff, NodeClient};

use crate::grpc_status::{of_node, within};
use crate::schedule::{Event, Opening, PolicyOverride};
use crate::sessions::EventSender;
use crate::shared::Shared;
use crate::workload::workload_of;

/// Views of one measured call: as in a batch of real work, since fewer views cost more each. A slow device must not
/// take minutes.
const MEASURED_BATCH: u32 = 32;
/// How long one node may measure.
const MEASURED_WITHIN: Duration = Duration::from_secs(600);
/// Predicted costs are measured when nodes have had little to do for so long.
const IDLE_FOR: Duration = Duration::from_secs(5);
/// Nodes that are busy for so long are not waited for: other work goes first anyway.
const BUSY_FOR: Duration = Duration::from_secs(120);
/// Attempts to measure costs where nodes are lost meanwhile.
const ATTEMPTS: usize = 11;

/// Measures the costs of a session, and hands it to the schedule; its plans come through `events`, as do refusals.
pub(crate) async fn open(shared: Arc<Shared>, session: u64, request: SessionRequest, events: EventSender) {
    let opened = tokio::select! {
        opened = measured_opening(&shared, session, request, &events) => opened,
        () = events.closed() => return,
    };
    match opened {
        Ok(opening) => {
            send_progress(&events, SessionStage::Planning, "choosing samplers and compositors".to_owned());
            shared.step(Event::Opened(Box::new(opening)));
            // A client that left before the schedule had heard of its session.
            if events.is_closed() {
                shared.step(Event::Closed { session });
            }
        }
        Err(status) => shared.sessions.refuse(session, status),
    }
}

async fn measured_opening(
    shared: &Arc<Shared>,
    session: u64,
    request: SessionRequest,
    events: &EventSender,
) -> Result<Opening, Status> {
    let workload = workload_of(&request, shared.offers.find(request.scene.as_deref())?)?;
    let measurement = MeasureCosts {
        // Costs are those of one image, and of one view, which is made from the images of one cell.
        workload: workload.of_cell(0).unwrap_or_else(|| workload.clone()),
        method: request.method.clone(),
        codec: request.codec.clone(),
        typical_views: vec![request.typical_view],
        batch_count: request.views_per_set.min(MEASURED_BATCH),
        planes: request.planes,
        in_background: false,
    };
    let Measured { costs, planes } = measured_undisturbed(shared, measurement, events).await?;
    Ok(Opening {
        session,
        workload: Workload { planes, ..workload },
        method: request.method,
        views_per_set: request.views_per_set as usize,
        frames_per_s: request.frames_per_s,
        policy_override: PolicyOverride {
            policy: request.policy,
            forced_samplers: request.forced_sampler_count.map(|count| count as usize),
            forced_tiles: request.forced_tile_count.map(|count| count as usize),
        },
        fallbacks: request.fallbacks,
        costs,
        viewpoints: request.viewpoints,
    })
}

/// Costs of a known size, or predicted from one: those are then measured in the background, for the next session. Other costs
/// are measured one session at a time. A measurement that was begun ends, and its costs are kept, though its client may
/// leave meanwhile.
async fn measured_undisturbed(
    shared: &Arc<Shared>,
    measurement: MeasureCosts,
    events: &EventSender,
) -> Result<Measured, Status> {
    if let Some(known) = known(shared, |device| shared.costs.get(device, &measurement)) {
        return Ok(known);
    }
    if let Some(predicted) = known(shared, |device| shared.costs.predict(device, &measurement)) {
        tokio::spawn(measured_in_background(shared.clone(), measurement));
        return Ok(predicted);
    }
    let (shared, events) = (shared.clone(), events.clone());
    let measuring = tokio::spawn(async move {
        let _one = shared.measuring.lock().await;
        match events.is_closed() {
            true => Err(Status::cancelled("the client has left")),
            false => measured_on_present_nodes(&shared, &measurement, &events).await,
        }
    });
    measuring.await.map_err(|error| Status::internal(format!("measuring failed: {error}")))?
}

/// The slowest device's costs, where those of all devices are known.
fn known(shared: &Shared, of: impl Fn(&str) -> Option<Measured>) -> Option<Measured> {
    let devices: BTreeSet<String> = shared.status().nodes.into_iter().map(|node| node.device_name).collect();
    let known: Option<Vec<Measured>> = devices.iter().map(|device| of(device)).collect();
    known?.into_iter().reduce(slowest)
}

/// Measures what was predicted, one size at a time: the next session of this size finds it.
async fn measured_in_background(shared: Arc<Shared>, measurement: MeasureCosts) {
    let _one = shared.measuring_in_background.lock().await;
    let give_up = tokio::time::Instant::now() + BUSY_FOR;
    loop {
        tokio::time::sleep(IDLE_FOR).await;
        if shared.is_idle() || tokio::time::Instant::now() > give_up {
            break;
        }
    }
    let measurement = MeasureCosts { in_background: true, ..measurement };
    let (events, _unread) = tokio::sync::mpsc::channel(1);
    if let Err(status) = measured(&shared, &measurement, &events).await {
        tracing::debug!(reason = status.message(), "not measured in the background");
    }
}

/// A node may be lost while it measures: others of its kind are asked once it has left.
async fn measured_on_present_nodes(
    shared: &Shared,
    measurement: &MeasureCosts,
    events: &EventSender,
) -> Result<Measured, Status> {
    let mut backoff = Backoff::reconnect();
    for _ in 1..ATTEMPTS {
        match measured(shared, measurement, events).await {
            Err(status) if [Code::Unavailable, Code::Unknown].contains(&status.code()) => {
                let detail = format!("measuring again: {}", status.message());
                send_progress(events, SessionStage::Measuring, detail);
                tokio::time::sleep(backoff.next_delay()).await;
            }
            done => return done,
        }
    }
    measured(shared, measurement, events).await
}

fn send_progress(events: &EventSender, stage: SessionStage, detail: String) {
    // The guard of a client's stream notices that the client has left. One that does not read misses a line.
    let _ = events.try_send(Ok(SessionEvent::Progress { stage, detail }));
}

/// The slowest device's costs: one node of each device measures, one after the other.
async fn measured(shared: &Shared, measurement: &MeasureCosts, events: &EventSender) -> Result<Measured, Status> {
    let nodes = shared.status().nodes;
    let devices: BTreeMap<String, NodeStatus> =
        nodes.into_iter().rev().map(|node| (node.device_name.clone(), node)).collect();
    let mut all = Vec::new();
    for (device, node) in devices {
        all.push(match shared.costs.get(&device, measurement) {
            Some(known) => known,
            None => {
                let detail = format!("{} measures its costs on {device}", node.node_name);
                send_progress(events, SessionStage::Measuring, detail);
                let call = async {
                    NodeClient::new(shared.connections.to(&node.address).await?)
                        .measure_costs(measurement.clone())
                        .await
                };
                let fresh = within(MEASURED_WITHIN, "measuring", call).await;
                let fresh = fresh.map_err(|status| of_node(&node.node_name, &status))?;
                shared.costs.insert(device, measurement, fresh);
                fresh
            }
        });
    }
    all.into_iter().reduce(slowest).ok_or_else(|| Status::failed_precondition("no node has joined the cluster"))
}

/// Which planes a method needs is the same on every node.
fn slowest(one: Measured, other: Measured) -> Measured {
    Measured { costs: one.costs.max(other.costs), ..one }
}
