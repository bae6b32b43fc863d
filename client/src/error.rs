//! What can go wrong for a client.

use tonic::{Code, Status};

/// Why views did not come.
#[derive(Debug, Clone, thiserror::Error)]
pub enum ClientError {
    /// The coordinator cannot be reached, or refuses.
    #[error("coordinator: {reason}")]
    Coordinator {
        /// What it says.
        reason: String,
    },
    /// There is no room: a quota, or all nodes' time. Others are not affected, and may be done later.
    #[error("no room: {reason}")]
    Exhausted {
        /// Which quota, and whose.
        reason: String,
    },
    /// Nodes did not join in time.
    #[error("{joined} of {wanted} nodes have joined")]
    FewNodes {
        /// Members now.
        joined: usize,
        /// Members needed.
        wanted: usize,
    },
    /// The plan no longer holds: a node left, or another session took its place.
    #[error("the session has ended: {reason}")]
    Ended {
        /// Why.
        reason: String,
    },
    /// A compositor cannot be reached, or refuses.
    #[error("compositor {node_name} at {address}: {reason}")]
    Compositor {
        /// Which.
        node_name: String,
        /// Where.
        address: String,
        /// What it says.
        reason: String,
    },
    /// A request that cannot be.
    #[error("{field}: {reason}")]
    Invalid {
        /// Which.
        field: &'static str,
        /// Why.
        reason: String,
    },
    /// Streams ended and frames are not there.
    #[error("{count} frames are missing: {first:?}{}", if *.count > .first.len() { " and more" } else { "" })]
    Missing {
        /// How many.
        count: usize,
        /// Some of them.
        first: Vec<u64>,
    },
    /// A frame that was not asked for, came twice, or shows another sample set.
    #[error("frame {frame}: {reason}")]
    Unexpected {
        /// Which.
        frame: u64,
        /// What is wrong with it.
        reason: String,
    },
}

impl ClientError {
    pub(crate) fn coordinator(status: Status) -> Self {
        let reason = status.message().to_owned();
        match status.code() {
            Code::ResourceExhausted => Self::Exhausted { reason: format!("coordinator: {reason}") },
            _ => Self::Coordinator { reason },
        }
    }
}
