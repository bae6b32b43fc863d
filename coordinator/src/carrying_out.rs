//! Does what the schedule says: plans to nodes, then, when all are ready, to the sessions that they serve.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::Notify;
use tokio::task::JoinSet;
use tonic::{Code, Status};
use wire::rpc::NodeClient;
use wire::{Assignment, Ready, SessionEvent, SessionPlan, SessionStage};

use crate::opening::{named, within};
use crate::schedule::{Command, Event};
use crate::service::Inner;

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
                inner.refuse(session, Status::failed_precondition(error.to_string()));
            }
            Command::End { session, reason } => inner.end(session, &reason),
        }
    }
}

async fn apply(inner: Arc<Inner>, sessions: Vec<u64>, mut plan: SessionPlan, addresses: Vec<String>) {
    let plan_epoch = plan.assignment.plan_epoch;
    tracing::info!(plan_epoch, reason = plan.reason, "planned");
    for &session in &sessions {
        let detail = format!("{} nodes take plan {plan_epoch}", addresses.len());
        inner.say(session, SessionEvent::Progress { stage: SessionStage::Preparing, detail });
    }
    match tell_all(&inner, &plan.assignment, addresses).await {
        // What no node can do is the sessions' fault, not the nodes'.
        Err(status) if status.code() == Code::InvalidArgument => {
            sessions.into_iter().for_each(|session| inner.refuse(session, status.clone()));
        }
        Ok(scene_load_s) => {
            plan.scene_load_s = scene_load_s;
            for session in sessions {
                inner.say(session, SessionEvent::Plan(Box::new(plan.clone())));
            }
        }
        // The schedule knows: another plan follows.
        Err(status) => tracing::warn!(plan_epoch, reason = status.message(), "not in force"),
    }
}

/// The time of the node that took longest to load the scene; the schedule hears of each.
async fn tell_all(inner: &Arc<Inner>, assignment: &Assignment, addresses: Vec<String>) -> Result<f64, Status> {
    let mut calls = JoinSet::new();
    for address in addresses {
        calls.spawn(tell(inner.clone(), assignment.clone(), address));
    }
    let mut slowest_s = Ok(0f64);
    while let Some(ready) = calls.join_next().await {
        let ready = ready.unwrap_or_else(|error| Err(Status::internal(error.to_string())));
        slowest_s = slowest_s.and_then(|slowest_s| Ok(slowest_s.max(ready?.scene_load_s)));
    }
    slowest_s
}

async fn tell(inner: Arc<Inner>, assignment: Assignment, address: String) -> Result<Ready, Status> {
    let plan_epoch = assignment.plan_epoch;
    let node_name = node_at(&assignment, &address);
    let call = async { NodeClient::new(inner.connections.to(&address).await?).apply_assignment(assignment).await };
    let ready = within(inner.config.ready_deadline, "getting ready", call).await;
    match &ready {
        Ok(_) => inner.step(Event::Ready { plan_epoch, node_name }),
        // A later plan came first, or the plan asks for what cannot be.
        Err(status) if [Code::FailedPrecondition, Code::InvalidArgument].contains(&status.code()) => (),
        Err(status) => {
            inner.step(Event::Unready { plan_epoch, node_name, reason: status.message().to_owned() });
        }
    }
    ready.map_err(|status| named(&address, &status))
}

fn node_at(assignment: &Assignment, address: &str) -> String {
    let samplers = assignment.samplers.iter().map(|share| (&share.address, &share.node_name));
    let compositors = assignment.compositors.iter().map(|share| (&share.address, &share.node_name));
    let found = samplers.chain(compositors).find(|(at, _)| *at == address);
    found.map_or_else(|| address.to_owned(), |(_, node_name)| node_name.clone())
}
