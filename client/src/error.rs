//! Errors of a client.

use cluster::CompositorShare;
use tonic::{Code, Status};

/// Why views were not received.
#[derive(Debug, Clone, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum ClientError {
    /// The coordinator cannot be reached, or refuses.
    #[error("coordinator: {reason}")]
    Coordinator { reason: String },
    /// A quota, or all nodes' time, is used up. Other clients are not affected, and may be done later.
    #[error("no room: {reason}")]
    Exhausted { reason: String },
    /// Nodes did not join in time.
    #[error("{joined} of {wanted} nodes have joined")]
    FewNodes { joined: usize, wanted: usize },
    /// The session, or one of its views, is over.
    #[error("the session has ended: {reason}")]
    Ended { reason: String },
    /// A compositor cannot be reached, or refuses.
    #[error("compositor {node_name} at {address}: {reason}")]
    Compositor { node_name: String, address: String, reason: String },
    /// A request that cannot be met.
    #[error("{field}: {reason}")]
    Invalid { field: &'static str, reason: String },
    /// Streams ended and frames are missing; `first` names some of them.
    #[error("{count} frames are missing: {first:?}{}", if *.count > .first.len() { " and more" } else { "" })]
    Missing { count: usize, first: Vec<u64> },
    /// A frame that was not requested, was received twice, or shows another sample set.
    #[error("frame {frame}: {reason}")]
    Unexpected { frame: u64, reason: String },
}

impl ClientError {
    pub(crate) fn coordinator(status: Status) -> Self {
        let reason = status.message().to_owned();
        match status.code() {
            Code::ResourceExhausted => Self::Exhausted { reason: format!("coordinator: {reason}") },
            _ => Self::Coordinator { reason },
        }
    }

    pub(crate) fn ended(reason: &str) -> Self {
        Self::Ended { reason: reason.to_owned() }
    }

    pub(crate) fn compositor(share: &CompositorShare, reason: impl ToString) -> Self {
        let CompositorShare { node_name, address, .. } = share.clone();
        Self::Compositor { node_name, address, reason: reason.to_string() }
    }
}
