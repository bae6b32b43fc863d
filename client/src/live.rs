//! A session's plan, followed as it changes: nodes come and go, and the coordinator may be away for a while.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio_stream::StreamExt as _;
use wire::rpc::{CompositorClient, CoordinatorClient, Messages, connect};
use wire::{CompositorShare, SessionEvent, SessionPlan, SessionRequest};

use crate::ClientError;

/// Between two attempts to reach a coordinator that went away.
const FIRST_RETRY: Duration = Duration::from_millis(100);
const LAST_RETRY: Duration = Duration::from_secs(2);

/// A compositor and the channel to it.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) share: CompositorShare,
    pub(crate) client: CompositorClient,
}

impl Peer {
    pub(crate) fn error(&self, reason: impl ToString) -> ClientError {
        compositor_error(&self.share, reason)
    }
}

/// A plan in force, and its compositors, but for those that cannot be reached.
#[derive(Debug)]
pub(crate) struct Live {
    pub(crate) plan: SessionPlan,
    pub(crate) peers: Vec<Peer>,
}

impl Live {
    /// # Errors
    /// Where no compositor can be reached.
    pub(crate) async fn reach(plan: SessionPlan) -> Result<Self, ClientError> {
        let (mut peers, mut failed) = (Vec::with_capacity(plan.assignment.compositors.len()), None);
        for share in &plan.assignment.compositors {
            match connect(&share.address).await {
                Ok(channel) => peers.push(Peer { share: share.clone(), client: CompositorClient::new(channel) }),
                Err(status) => failed = Some(compositor_error(share, status.message())),
            }
        }
        match failed.filter(|_| peers.is_empty()) {
            Some(error) => Err(error),
            None => Ok(Self { plan, peers }),
        }
    }
}

fn compositor_error(share: &CompositorShare, reason: impl ToString) -> ClientError {
    ClientError::Compositor {
        node_name: share.node_name.clone(),
        address: share.address.clone(),
        reason: reason.to_string(),
    }
}

/// What the coordinator last said.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) live: Arc<Live>,
    /// Why the session has ended, if it has.
    pub(crate) ended: Option<String>,
}

/// Follows until the session ends, or nobody looks any more. Frames go on while the coordinator is away; the session
/// is then opened once more.
pub(crate) async fn follow(
    coordinator: CoordinatorClient,
    request: SessionRequest,
    mut events: Messages<SessionEvent>,
    says: watch::Sender<State>,
) {
    let mut retry = FIRST_RETRY;
    loop {
        while let Some(Ok(event)) = events.next().await {
            retry = FIRST_RETRY;
            match event {
                SessionEvent::Progress { .. } => (),
                SessionEvent::Plan(plan) => replace(*plan, &says).await,
                SessionEvent::Ended { reason } => {
                    says.send_modify(|state| state.ended = Some(reason));
                    return;
                }
            }
        }
        events = loop {
            tokio::time::sleep(retry).await;
            retry = (retry * 2).min(LAST_RETRY);
            match coordinator.open_session(request.clone()).await {
                Ok(events) => break events,
                Err(status) => tracing::debug!(reason = status.message(), "the coordinator is away"),
            }
        };
    }
}

async fn replace(plan: SessionPlan, says: &watch::Sender<State>) {
    let plan_epoch = plan.assignment.plan_epoch;
    match Live::reach(plan).await {
        Ok(live) => says.send_modify(|state| state.live = Arc::new(live)),
        // Another plan follows: its compositors have gone.
        Err(error) => tracing::warn!(plan_epoch, %error, "no compositor of the plan can be reached"),
    }
}
