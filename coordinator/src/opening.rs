//! From a request to a plan that all nodes are ready for.

use std::collections::BTreeMap;
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tonic::Status;
use wire::rpc::NodeClient;
use wire::{
    Assignment, Costs, MeasureCosts, NodeStatus, Ready, SessionEvent, SessionPlan, SessionRequest, SessionStage,
};

use crate::schedule::{Command, Event, Opening};
use crate::service::Inner;
use crate::workload::workload_of;

/// Views of one measured call: as in a batch of real work, for few views cost more apiece, but not so many that a
/// slow device takes minutes.
const MEASURED_BATCH: u32 = 32;
/// Measured costs that are kept.
const KEPT_COSTS: usize = 16;

pub(crate) type Events = mpsc::Sender<Result<SessionEvent, Status>>;

/// Opens a session; what it says comes through `events`.
pub(crate) async fn open(inner: Arc<Inner>, session: u64, request: SessionRequest, events: Events) {
    // One at a time: costs are measured with nothing else running.
    let opened = {
        let _one = inner.opening.lock().await;
        tokio::select! {
            opened = plan(&inner, session, request, &events) => opened,
            () = events.closed() => Err(Status::cancelled("the client went away")),
        }
    };
    let event = opened.map(|plan| SessionEvent::Plan(Box::new(plan))).inspect_err(|status| {
        tracing::warn!(session, reason = status.message(), "session refused");
        inner.step(Event::Closed { session });
        inner.forget(session);
    });
    // An error means a client that left: its guard closes the session.
    let _ = events.send(event).await;
}

async fn plan(
    inner: &Arc<Inner>,
    session: u64,
    request: SessionRequest,
    events: &Events,
) -> Result<SessionPlan, Status> {
    let workload = workload_of(&request, &inner.offer)?;
    let measure = MeasureCosts {
        workload,
        typical_view: request.typical_view,
        batch_count: request.views_per_set.min(MEASURED_BATCH),
        planes: request.planes,
    };
    let costs = measured(inner, &measure, events).await?;
    say(events, SessionStage::Planning, "choosing between pipeline and direct".to_owned()).await;
    let opening = Opening {
        session,
        workload: measure.workload,
        views_per_set: request.views_per_set as usize,
        policy: request.policy,
        forced_samplers: request.forced_sampler_count.map(|count| count as usize),
        costs,
    };
    let (mut plan, addresses) = planned(inner, opening)?;
    say(events, SessionStage::Preparing, format!("{} nodes take plan {}", addresses.len(), plan.assignment.plan_epoch))
        .await;
    plan.scene_load_s = apply(inner, &plan.assignment, addresses).await?;
    tracing::info!(session, plan_epoch = plan.assignment.plan_epoch, reason = plan.reason, "planned");
    Ok(plan)
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

fn planned(inner: &Arc<Inner>, opening: Opening) -> Result<(SessionPlan, Vec<String>), Status> {
    let mut planned = Err(Status::internal("the schedule said nothing"));
    for command in inner.step(Event::Opened(Box::new(opening))) {
        match command {
            Command::Apply { plan, addresses, .. } => planned = Ok((*plan, addresses)),
            Command::Refuse { error, .. } => planned = Err(Status::failed_precondition(error.to_string())),
            Command::End { .. } => (),
        }
    }
    planned
}

/// Tells every node; the time of the one that took longest to load the scene.
async fn apply(inner: &Arc<Inner>, assignment: &Assignment, addresses: Vec<String>) -> Result<f64, Status> {
    let mut calls = JoinSet::new();
    for address in addresses {
        let (inner, assignment) = (inner.clone(), assignment.clone());
        calls.spawn(async move {
            let call =
                async { NodeClient::new(inner.connections.to(&address).await?).apply_assignment(assignment).await };
            within(inner.config.ready_deadline, "getting ready", call).await.map_err(|status| named(&address, &status))
        });
    }
    let mut slowest_s = 0f64;
    while let Some(ready) = calls.join_next().await {
        let Ready { scene_load_s, .. } = ready.map_err(|error| Status::internal(error.to_string()))??;
        slowest_s = slowest_s.max(scene_load_s);
    }
    Ok(slowest_s)
}

async fn within<T>(deadline: Duration, what: &str, call: impl Future<Output = Result<T, Status>>) -> Result<T, Status> {
    let late = |_| Status::deadline_exceeded(format!("{what} took longer than {} s", deadline.as_secs()));
    tokio::time::timeout(deadline, call).await.map_err(late)?
}

fn named(node: &str, status: &Status) -> Status {
    Status::new(status.code(), format!("node {node}: {}", status.message()))
}
