//! Follows a session's plan as it changes: nodes come and go, and the coordinator may be away for a while.

use std::sync::Arc;

use cluster::{Assignment, SessionEvent, SessionPlan, SessionRequest};
use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};
use tokio_stream::StreamExt as _;
use wire::rpc::{Backoff, CoordinatorClient, Messages};

use crate::active_plan::SessionState;

/// Takes over plans that compositors name, until it is aborted.
pub(crate) async fn follow_compositors(
    mut named_plans: mpsc::Receiver<Assignment>,
    state: watch::Sender<SessionState>,
) {
    while let Some(assignment) = named_plans.recv().await {
        state.send_if_modified(|state| match state.active.succeeded_by(&assignment) {
            Some(active) => {
                tracing::info!(plan_epoch = assignment.plan_epoch, "a compositor names the plan in force");
                state.active = Arc::new(active);
                true
            }
            None => false,
        });
    }
}

/// Takes over what the coordinator says, until the session ends. Frames go on while the coordinator is away; the session
/// is then opened once more.
pub(crate) async fn follow_coordinator(
    coordinator: CoordinatorClient,
    request: Arc<Mutex<SessionRequest>>,
    mut events: Messages<SessionEvent>,
    state: watch::Sender<SessionState>,
) {
    let mut backoff = Backoff::reconnect();
    // Epochs of a coordinator that was restarted may begin anew.
    let mut is_new_session = false;
    loop {
        while let Some(Ok(event)) = events.next().await {
            backoff.reset();
            if take_over(event, &state, &mut is_new_session) {
                return;
            }
        }
        events = reopen(&coordinator, &request, &mut backoff).await;
        is_new_session = true;
    }
}

async fn reopen(
    coordinator: &CoordinatorClient,
    request: &Mutex<SessionRequest>,
    backoff: &mut Backoff,
) -> Messages<SessionEvent> {
    loop {
        tokio::time::sleep(backoff.next_delay()).await;
        let request = request.lock().clone();
        match coordinator.open_session(request).await {
            Ok(events) => return events,
            Err(status) => tracing::debug!(reason = status.message(), "the coordinator is away"),
        }
    }
}

/// Whether the event ends the session.
fn take_over(event: SessionEvent, state: &watch::Sender<SessionState>, is_new_session: &mut bool) -> bool {
    match event {
        SessionEvent::Opened { session } => state.send_modify(|state| state.session = session),
        SessionEvent::Progress { .. } => (),
        SessionEvent::Plan(plan) => put_in_force(*plan, state, std::mem::take(is_new_session)),
        SessionEvent::Ended { reason } => {
            state.send_modify(|state| state.ended = Some(reason));
            return true;
        }
    }
    false
}

/// Puts a plan in force, unless it is older than the one in force. The coordinator sends a plan when its nodes have taken
/// it, so that one that was replaced meanwhile may arrive last.
fn put_in_force(plan: SessionPlan, state: &watch::Sender<SessionState>, is_new_session: bool) {
    state.send_if_modified(|state| {
        let is_current = is_new_session || plan.assignment.plan_epoch >= state.active.plan_epoch();
        if is_current {
            state.active = Arc::new(state.active.replaced_by(plan));
        }
        is_current
    });
}
