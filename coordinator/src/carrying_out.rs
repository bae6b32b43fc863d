//! Does what the schedule says: plans to nodes, then, when all are ready, to the sessions that they serve.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use cluster::{Assignment, Ready, SessionEvent, SessionPlan, SessionStage};
use tokio::sync::Notify;
use tokio::task::JoinSet;
use tonic::{Code, Status};
use wire::rpc::NodeClient;

use crate::opening::{named, within};
use crate::schedule::{ChoiceError, Command, Event};
use crate::service::Inner;

/// A call that breaks sooner than this is tried again, after a pause.
const SOON: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(100);

/// What is still to be done, in its order. None may be lost, and none is added but by an event that was let in.
#[derive(Default)]
pub(crate) struct Commands {
    waiting: Mutex<VecDeque<Command>>,
    added: Notify,
}

impl Commands {
    pub(crate) fn add(&self, commands: Vec<Command>) {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner).extend(commands);
        self.added.notify_one();
    }

    async fn next(&self) -> Command {
        loop {
            let next = self.waiting.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
            match next {
                Some(command) => return command,
                None => self.added.notified().await,
            }
        }
    }
}

/// Runs until it is aborted. Plans do not wait for one another: nodes refuse what a later one has replaced.
pub(crate) async fn carry_out(inner: Arc<Inner>) {
    loop {
        match inner.commands.next().await {
            Command::Apply { sessions, plan, addresses } => {
                tokio::spawn(apply(inner.clone(), sessions, *plan, addresses));
            }
            Command::Refuse { session, error } => {
                inner.refuse(session, refusal(&error));
            }
            Command::End { session, reason } => inner.end(session, &reason),
        }
    }
}

pub(crate) fn refusal(error: &ChoiceError) -> Status {
    match error {
        ChoiceError::Overload { .. } => Status::resource_exhausted(error.to_string()),
        ChoiceError::ForcedTiles { .. } | ChoiceError::Cells { .. } | ChoiceError::NoCells { .. } => {
            Status::invalid_argument(error.to_string())
        }
        ChoiceError::NoNodes | ChoiceError::ForcedSamplers { .. } => Status::failed_precondition(error.to_string()),
    }
}

async fn apply(inner: Arc<Inner>, sessions: Vec<u64>, mut plan: SessionPlan, addresses: Vec<String>) {
    let plan_epoch = plan.assignment.plan_epoch;
    tracing::info!(plan_epoch, reason = plan.reason, "planned");
    for &session in &sessions {
        let detail = format!("{} nodes take plan {plan_epoch}", addresses.len());
        inner.say(session, SessionEvent::Progress { stage: SessionStage::Preparing, detail });
    }
    let Told { scene_load_s, ready, cannot, failed } = tell_all(&inner, &plan.assignment, addresses).await;
    match cannot.first() {
        // What no node can do is the sessions' fault, not the nodes'.
        Some((_, status)) if ready == 0 => {
            sessions.into_iter().for_each(|session| inner.refuse(session, status.clone()));
            return;
        }
        // What others can is the node's.
        _ => cannot.into_iter().for_each(|(name, status)| {
            inner.leave_out(plan_epoch, name, status.message().to_owned());
        }),
    }
    if let Some(status) = &failed {
        // The schedule knows: another plan follows.
        tracing::warn!(plan_epoch, reason = status.message(), "not in force everywhere");
    }
    // Nodes that have taken it refuse what is asked under the plan before.
    if ready > 0 {
        plan.scene_load_s = scene_load_s;
        for session in sessions {
            inner.say(session, SessionEvent::Plan(Box::new(plan.clone())));
        }
    }
}

/// What nodes said to a plan.
#[derive(Default)]
struct Told {
    /// The time of the node that took longest to load the scene.
    scene_load_s: f64,
    /// Nodes that have taken it.
    ready: usize,
    /// Nodes that it asks for what they cannot do.
    cannot: Vec<(String, Status)>,
    /// Why one of the others has not taken it.
    failed: Option<Status>,
}

/// The schedule hears of each.
async fn tell_all(inner: &Arc<Inner>, assignment: &Assignment, addresses: Vec<String>) -> Told {
    let mut calls = JoinSet::new();
    for address in addresses {
        calls.spawn(tell(inner.clone(), assignment.clone(), address));
    }
    let mut told = Told::default();
    while let Some(answer) = calls.join_next().await {
        // A task that panics is no node's fault.
        let Ok((node_name, answer)) = answer else { continue };
        match answer {
            Ok(ready) => {
                told.ready += 1;
                told.scene_load_s = told.scene_load_s.max(ready.scene_load_s);
            }
            Err(status) if status.code() == Code::InvalidArgument => told.cannot.push((node_name, status)),
            Err(status) => told.failed = Some(status),
        }
    }
    told
}

async fn tell(inner: Arc<Inner>, assignment: Assignment, address: String) -> (String, Result<Ready, Status>) {
    let plan_epoch = assignment.plan_epoch;
    let node_name = node_at(&assignment, &address);
    let ready = within(inner.config.ready_deadline, "getting ready", ask(&inner, &assignment, &address)).await;
    match &ready {
        Ok(_) => inner.step(Event::Ready { plan_epoch, node_name: node_name.clone() }),
        // A later plan came first, or the plan asks for what cannot be.
        Err(status) if [Code::FailedPrecondition, Code::InvalidArgument].contains(&status.code()) => (),
        Err(status) => {
            inner.leave_out(plan_epoch, node_name.clone(), status.message().to_owned());
        }
    }
    (node_name, ready.map_err(|status| named(&address, &status)))
}

/// Asks once more where a connection broke: the node may not have heard.
async fn ask(inner: &Inner, assignment: &Assignment, address: &str) -> Result<Ready, Status> {
    let apply =
        async || NodeClient::new(inner.connections.to(address).await?).apply_assignment(assignment.clone()).await;
    let start = Instant::now();
    match apply().await {
        Err(status) if is_of_connection(&status) && start.elapsed() < SOON => {
            tokio::time::sleep(PAUSE).await;
            apply().await
        }
        done => done,
    }
}

fn is_of_connection(status: &Status) -> bool {
    [Code::Unavailable, Code::Unknown, Code::Internal, Code::Cancelled, Code::DataLoss].contains(&status.code())
}

fn node_at(assignment: &Assignment, address: &str) -> String {
    let samplers = assignment.samplers.iter().map(|share| (&share.address, &share.node_name));
    let compositors = assignment.compositors.iter().map(|share| (&share.address, &share.node_name));
    let found = samplers.chain(compositors).find(|(at, _)| *at == address);
    found.map_or_else(|| address.to_owned(), |(_, node_name)| node_name.clone())
}
