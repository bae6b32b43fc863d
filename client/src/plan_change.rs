//! What another plan means for frames that were asked for under this one.

use std::time::Duration;

use tokio::sync::watch;

use crate::ClientError;
use crate::live::{Peer, State};

/// How long a compositor that the next plan has no more may take to send what it was asked for.
const LAST_WORK: Duration = Duration::from_secs(1);

/// Waits for a later plan for a while; says why no plan is to be tried any more.
pub(crate) async fn successor(
    state: &mut watch::Receiver<State>,
    plan_epoch: u64,
    pause: Duration,
    error: ClientError,
) -> Option<ClientError> {
    let later = |state: &State| state.ended.is_some() || state.live.plan_epoch() > plan_epoch;
    match tokio::time::timeout(pause, state.wait_for(later)).await {
        Ok(Ok(state)) => {
            let reason = state.ended.as_ref()?;
            Some(ClientError::Ended { reason: format!("{reason} ({error})") })
        }
        // The session was dropped.
        Ok(Err(_)) => Some(error),
        Err(_) => None,
    }
}

/// Resolves when a later plan has no place for one of `peers`: it may be gone without a word.
pub(crate) async fn lost_peer(mut state: watch::Receiver<State>, plan_epoch: u64, peers: &[Peer]) -> ClientError {
    let lost = |state: &State| {
        let plan = &state.live.plan.assignment;
        let lost = peers.iter().find(|peer| !plan.composites(&peer.share.node_name));
        lost.filter(|_| plan.plan_epoch > plan_epoch).cloned()
    };
    let found = state.wait_for(|state| lost(state).is_some()).await.ok().and_then(|state| lost(&state));
    let Some(peer) = found else { return std::future::pending().await };
    tokio::time::sleep(LAST_WORK).await;
    peer.error("is not of the plan any more")
}
