//! The effect of a plan change on frames that were requested under the plan before.

use std::time::Duration;

use tokio::sync::watch;

use crate::active_plan::SessionState;
use crate::error::ClientError;
use crate::peer::Peer;

/// The time that a compositor without a place in the next plan has to send the frames it was asked for.
const LAST_WORK: Duration = Duration::from_secs(1);

/// Waits for a later plan for `delay`; gives an error where no plan is to be tried any more.
pub(crate) async fn wait_for_successor(
    state: &mut watch::Receiver<SessionState>,
    plan_epoch: u64,
    delay: Duration,
    error: ClientError,
) -> Result<(), ClientError> {
    let is_later = |state: &SessionState| state.ended.is_some() || state.active.plan_epoch() > plan_epoch;
    match tokio::time::timeout(delay, state.wait_for(is_later)).await {
        Ok(Ok(state)) => match &state.ended {
            Some(reason) => Err(ClientError::Ended { reason: format!("{reason} ({error})") }),
            None => Ok(()),
        },
        // The session was dropped.
        Ok(Err(_)) => Err(error),
        Err(_) => Ok(()),
    }
}

/// Resolves when a later plan has no place for one of `peers`: it may be lost without a word.
pub(crate) async fn wait_for_lost_peer(
    mut state: watch::Receiver<SessionState>,
    plan_epoch: u64,
    peers: &[Peer],
) -> ClientError {
    let lost = |state: &SessionState| {
        let plan = &state.active.plan.assignment;
        let lost = peers.iter().find(|peer| !plan.composites(&peer.share.node_name));
        lost.filter(|_| plan.plan_epoch > plan_epoch).cloned()
    };
    let found = state.wait_for(|state| lost(state).is_some()).await.ok().and_then(|state| lost(&state));
    let Some(peer) = found else { return std::future::pending().await };
    tokio::time::sleep(LAST_WORK).await;
    peer.error("is not of the plan any more")
}
