//! Executes the schedule's commands: applies plans to nodes, then announces them to sessions, and probes nodes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{ApplyPlan, Assignment, NodeStatus, Ready, SessionEvent, SessionPlan, SessionStage};
use tokio::task::JoinSet;
use tonic::{Code, Status};
use wire::rpc::NodeClient;

use crate::grpc_status::{of_node, within};
use crate::probe::probe;
use crate::schedule::{Command, Event, Scheduler};
use crate::shared::Shared;
use crate::view_probes::probe_views;

/// How long a node may take to load a scene and get ready.
const READY_WITHIN: Duration = Duration::from_secs(300);
/// A call that breaks sooner than this is tried again, after a pause.
const SOON: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(100);
/// The codes of calls whose connection broke.
const BROKEN_CONNECTION: [Code; 5] =
    [Code::Unavailable, Code::Unknown, Code::Internal, Code::Cancelled, Code::DataLoss];

/// Runs until it is aborted. Plans do not wait for one another: nodes refuse a plan that a later one has replaced.
pub(crate) async fn execute(shared: Arc<Shared>) {
    loop {
        match shared.commands.next().await {
            Command::Apply { sessions, plan, nodes } => spawn(apply(shared.clone(), sessions, *plan, nodes)),
            Command::Probe(asked) => spawn(probe(shared.clone(), *asked)),
            Command::Quarantine { node_name, workload_number, reason } => {
                tracing::warn!(node = node_name, workload_number, reason, "quarantined");
            }
            Command::Readmit { node_name, workload_number } => {
                tracing::info!(node = node_name, workload_number, "readmitted");
            }
            Command::ProbeViews(probe) => spawn(probe_views(shared.clone(), *probe)),
            Command::Promise { sessions, promise } => {
                tracing::info!(%promise, "promise");
                for session in sessions {
                    shared.send(session, SessionEvent::Promise((*promise).clone()));
                }
            }
            Command::Refuse { session, error } => shared.sessions.refuse(session, error.into()),
        }
    }
}

/// Tasks report to the schedule: nobody waits for them.
fn spawn(task: impl Future<Output = ()> + Send + 'static) {
    tokio::spawn(task);
}

async fn apply(shared: Arc<Shared>, sessions: Vec<u64>, mut plan: SessionPlan, nodes: Vec<NodeStatus>) {
    let plan_epoch = plan.assignment.plan_epoch;
    // The last of them has ended the workload, or later ones have this plan applied.
    if !sessions.iter().any(|&session| shared.sessions.contains(session)) {
        return;
    }
    tracing::info!(plan_epoch, reason = plan.reason, "planned");
    for &session in &sessions {
        let detail = format!("{} nodes take plan {plan_epoch}", nodes.len());
        shared.send(session, SessionEvent::Progress { stage: SessionStage::Preparing, detail });
    }
    // Nodes that have taken the plan refuse requests under the plan before.
    if let Some(scene_load_s) = apply_to_all(&shared, &plan.assignment, nodes).await {
        plan.scene_load_s = scene_load_s;
        for session in sessions {
            shared.send(session, SessionEvent::Plan(Box::new(plan.clone())));
        }
    }
    shared.step(Event::Applied { plan_epoch });
}

/// Gives the seconds of the node that took longest to load the scene; `None` where no node has taken the plan.
async fn apply_to_all(shared: &Arc<Shared>, assignment: &Assignment, nodes: Vec<NodeStatus>) -> Option<f64> {
    let mut calls = JoinSet::new();
    for node in nodes {
        calls.spawn(apply_to(shared.clone(), assignment.clone(), node));
    }
    let mut longest_s: Option<f64> = None;
    while let Some(answer) = calls.join_next().await {
        // A task that panics is no node's fault.
        if let Ok(Some(ready)) = answer {
            longest_s = Some(longest_s.unwrap_or(0.0).max(ready.scene_load_s));
        }
    }
    longest_s
}

async fn apply_to(shared: Arc<Shared>, assignment: Assignment, node: NodeStatus) -> Option<Ready> {
    let plan_epoch = assignment.plan_epoch;
    let NodeStatus { node_name, address, .. } = node;
    let call = call(&shared, &assignment, &address);
    match within(READY_WITHIN, "getting ready", call).await {
        Ok(ready) => {
            shared.step(Event::Ready { plan_epoch, node_name });
            return Some(ready);
        }
        // A later plan came first.
        Err(status) if status.code() == Code::FailedPrecondition => {
            tracing::debug!(node = node_name, plan_epoch, reason = status.message(), "plan not taken");
        }
        Err(status) if status.code() == Code::InvalidArgument => {
            let reason = of_node(&address, &status).message().to_owned();
            shared.step(Event::Rejected { plan_epoch, node_name, reason });
        }
        Err(status) => {
            let reason = status.message().to_owned();
            shared.step(Event::Unready { plan_epoch, node_name, reason });
        }
    }
    None
}

/// Calls once more where a connection broke: the node may not have received the call.
async fn call(shared: &Shared, assignment: &Assignment, address: &str) -> Result<Ready, Status> {
    let apply = async || {
        let node = NodeClient::new(shared.connections.to(address).await?);
        let open_workloads = shared.with_scheduler(Scheduler::open_workloads);
        node.apply_assignment(ApplyPlan { assignment: assignment.clone(), open_workloads }).await
    };
    let start = Instant::now();
    match apply().await {
        Err(status) if BROKEN_CONNECTION.contains(&status.code()) && start.elapsed() < SOON => {
            tokio::time::sleep(PAUSE).await;
            apply().await
        }
        done => done,
    }
}
