//! The choice of a compositor for a live stream.

use std::collections::HashSet;
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::active_plan::ActivePlan;
use crate::error::ClientError;
use crate::peer::Peer;

/// The first id of a process is random, so that clients of different processes begin at different compositors. Ids rise by
/// one, so that clients of one process go to all compositors evenly.
static NEXT: LazyLock<AtomicU64> = LazyLock::new(|| AtomicU64::new(RandomState::new().build_hasher().finish()));

/// A client of live streams. The id names it in logs and chooses its compositor: streams of one client share view cells there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClientId(pub(crate) u64);

impl ClientId {
    /// The id of a new client.
    #[must_use]
    #[expect(clippy::new_without_default, reason = "every id is another")]
    pub fn new() -> Self {
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// The order in which a client tries compositors of these weights.
fn order(client_id: u64, weights: &[u32]) -> impl Iterator<Item = usize> + use<> {
    let count = weights.len();
    let first = first(client_id, weights);
    (0..count).map(move |i| (first + i) % count)
}

/// Equal compositors take turns. Others are chosen in proportion to their weights, by the golden section, which spreads
/// any number of clients evenly.
fn first(client_id: u64, weights: &[u32]) -> usize {
    let all: u64 = weights.iter().map(|&weight| u64::from(weight)).sum();
    if all == 0 || weights.iter().all(|weight| *weight == weights[0]) {
        return (client_id % weights.len().max(1) as u64) as usize;
    }
    let turn = client_id.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut left = (u128::from(turn) * u128::from(all)) >> 64;
    for (at, &weight) in weights.iter().enumerate() {
        match left.checked_sub(weight.into()) {
            Some(rest) => left = rest,
            None => return at,
        }
    }
    0
}

/// Compositors of a plan that have failed this client, and why.
#[derive(Debug, Default)]
pub(crate) struct Tried {
    pub(crate) plan_epoch: u64,
    names: HashSet<String>,
    pub(crate) last: Option<ClientError>,
    /// Whether a compositor failed for another reason than a lack of room.
    pub(crate) has_failed_with_room: bool,
}

impl Tried {
    pub(crate) fn add(&mut self, peer: &Peer, error: ClientError) {
        self.has_failed_with_room |= !matches!(error, ClientError::Exhausted { .. });
        self.names.insert(peer.share.node_name.clone());
        self.last = Some(error);
    }

    /// The compositor that a client tries next; `None` where it has tried all.
    pub(crate) fn next<'a>(&self, client_id: u64, active: &'a ActivePlan) -> Option<&'a Peer> {
        let weights: Vec<u32> = active.peers.iter().map(|peer| peer.share.view_weight).collect();
        order(client_id, &weights).map(|at| &active.peers[at]).find(|peer| !self.names.contains(&peer.share.node_name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clients_of_a_process_spread_evenly_over_equal_compositors() {
        let mut clients = [0; 3];
        let ClientId(first) = ClientId::new();
        (0..12).for_each(|i| clients[order(first + i, &[7; 3]).next().unwrap()] += 1);
        assert_eq!(clients, [4; 3]);
        assert_ne!(ClientId::new(), ClientId::new());
    }

    #[test]
    fn compositors_get_clients_in_proportion_to_their_weights() {
        for start in [0, 12_345, u64::MAX - 30] {
            let mut clients = [0i32; 3];
            (0..60).for_each(|i| clients[order(start.wrapping_add(i), &[10, 20, 0]).next().unwrap()] += 1);
            assert!((clients[0] - 20).abs() <= 1 && clients[2] == 0, "{clients:?}");
        }
    }

    #[test]
    fn every_compositor_is_tried_once_for_any_weights() {
        for weights in [[0; 5], [1, 2, 0, 4, 5]] {
            let mut tried: Vec<usize> = order(u64::MAX, &weights).collect();
            tried.sort_unstable();
            assert_eq!(tried, [0, 1, 2, 3, 4]);
        }
        assert_eq!(order(7, &[]).count(), 0);
    }
}
