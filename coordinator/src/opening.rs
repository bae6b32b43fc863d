//! From a request to a session whose costs are known.

use std::collections::{BTreeMap, BTreeSet};
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use cluster::{Costs, MeasureCosts, NodeStatus, SessionEvent, SessionRequest, SessionStage};
use tokio::sync::mpsc;
use tonic::{Code, Status};
use wire::rpc::NodeClient;

use crate::schedule::{Event, Opening};
use crate::service::Inner;
use crate::workload::workload_of;

/// Views of one measured call: as in a batch of real work, for few views cost more apiece, but not so many that a
/// slow device takes minutes.
const MEASURED_BATCH: u32 = 32;
/// How often costs are measured again where a node was lost, and how long it may take to leave.
const MEASURED_AGAIN: usize = 10;
const UNTIL_IT_HAS_LEFT: Duration = Duration::from_millis(200);
/// Measured costs that are kept.
const KEPT_COSTS: usize = 16;

pub(crate) type Events = mpsc::Sender<Result<SessionEvent, Status>>;

/// Measures what a session costs, and hands it to the schedule; its plans come through `events`, as do refusals.
pub(crate) async fn open(inner: Arc<Inner>, session: u64, request: SessionRequest, events: Events) {
    let opened = tokio::select! {
        opened = measured_opening(&inner, session, request, &events) => opened,
        () = events.closed() => return,
    };
    match opened {
        Ok(opening) => {
            say(&events, SessionStage::Planning, "choosing who samples and who reconstructs".to_owned()).await;
            inner.step(Event::Opened(Box::new(opening)));
            // A client that left before the schedule had heard of its session.
            if events.is_closed() {
                inner.step(Event::Closed { session });
            }
        }
        Err(status) => inner.refuse(session, status),
    }
}

async fn measured_opening(
    inner: &Arc<Inner>,
    session: u64,
    request: SessionRequest,
    events: &Events,
) -> Result<Opening, Status> {
    let workload = workload_of(&request, &inner.offer)?;
    let measure = MeasureCosts {
        // Costs are those of one image, and of one view, which is made from the images of one cell.
        workload: workload.of_cell(0).unwrap_or_else(|| workload.clone()),
        typical_views: vec![request.typical_view],
        batch_count: request.views_per_set.min(MEASURED_BATCH),
        planes: request.planes,
    };
    let costs = measured_undisturbed(inner, measure, events).await?;
    Ok(Opening {
        session,
        workload,
        views_per_set: request.views_per_set as usize,
        frames_per_s: request.frames_per_s.unwrap_or(0.0),
        policy: request.policy,
        forced_samplers: request.forced_sampler_count.map(|count| count as usize),
        forced_tiles: request.forced_tile_count.map(|count| count as usize),
        fallbacks: request.fallbacks,
        costs,
        viewpoints: request.viewpoints,
    })
}

/// One at a time: costs are measured with nothing else being measured. A measurement that was begun ends, and its costs
/// are kept, though its client may leave meanwhile.
async fn measured_undisturbed(inner: &Arc<Inner>, measure: MeasureCosts, events: &Events) -> Result<Costs, Status> {
    if let Some(known) = known(inner, &measure) {
        return Ok(known);
    }
    let (inner, events) = (inner.clone(), events.clone());
    let measuring = tokio::spawn(async move {
        let _one = inner.measuring.lock().await;
        match events.is_closed() {
            true => Err(Status::cancelled("the client has left")),
            false => measured_in_spite(&inner, &measure, &events).await,
        }
    });
    measuring.await.map_err(|error| Status::internal(format!("measuring failed: {error}")))?
}

/// The slowest device's costs, where all devices' are kept.
fn known(inner: &Inner, measure: &MeasureCosts) -> Option<Costs> {
    let devices: BTreeSet<String> = inner.status().nodes.into_iter().map(|node| node.device_name).collect();
    let kept: Option<Vec<Costs>> = devices.iter().map(|device| inner.kept_costs(device, measure)).collect();
    kept?.into_iter().reduce(Costs::max)
}

/// A node may be lost while it measures: others of its kind are asked once it has left.
async fn measured_in_spite(inner: &Arc<Inner>, measure: &MeasureCosts, events: &Events) -> Result<Costs, Status> {
    for _ in 0..MEASURED_AGAIN {
        match measured(inner, measure, events).await {
            Err(status) if [Code::Unavailable, Code::Unknown].contains(&status.code()) => {
                say(events, SessionStage::Measuring, format!("measuring again: {}", status.message())).await;
                tokio::time::sleep(UNTIL_IT_HAS_LEFT).await;
            }
            done => return done,
        }
    }
    measured(inner, measure, events).await
}

async fn say(events: &Events, stage: SessionStage, detail: String) {
    // A client that left is noticed by its guard.
    let _ = events.send(Ok(SessionEvent::Progress { stage, detail })).await;
}

/// The slowest device's costs: one node of each device measures, one after the other.
async fn measured(inner: &Arc<Inner>, measure: &MeasureCosts, events: &Events) -> Result<Costs, Status> {
    let nodes = inner.status().nodes;
    let devices: BTreeMap<String, NodeStatus> =
        nodes.into_iter().rev().map(|node| (node.device_name.clone(), node)).collect();
    let mut costs: Option<Costs> = None;
    for (device, node) in devices {
        let of_device = match inner.kept_costs(&device, measure) {
            Some(known) => known,
            None => {
                say(events, SessionStage::Measuring, format!("{} measures its costs on {device}", node.node_name))
                    .await;
                let fresh = measure_on(inner, &node, measure.clone()).await?;
                inner.keep_costs(device, measure.clone(), fresh, KEPT_COSTS);
                fresh
            }
        };
        costs = Some(costs.map_or(of_device, |slowest| slowest.max(of_device)));
    }
    costs.ok_or_else(|| Status::failed_precondition("no node has joined the cluster"))
}

async fn measure_on(inner: &Inner, node: &NodeStatus, measure: MeasureCosts) -> Result<Costs, Status> {
    let call = async { NodeClient::new(inner.connections.to(&node.address).await?).measure_costs(measure).await };
    within(inner.config.measure_deadline, "measuring", call).await.map_err(|status| named(&node.node_name, &status))
}

pub(crate) async fn within<T>(
    deadline: Duration,
    what: &str,
    call: impl Future<Output = Result<T, Status>>,
) -> Result<T, Status> {
    let late = |_| Status::deadline_exceeded(format!("{what} took longer than {} s", deadline.as_secs()));
    tokio::time::timeout(deadline, call).await.map_err(late)?
}

pub(crate) fn named(node: &str, status: &Status) -> Status {
    Status::new(status.code(), format!("node {node}: {}", status.message()))
}
