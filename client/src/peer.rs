//! A compositor that a client talks to, and the failures of a call to it.

use cluster::{Assignment, CompositorShare};
use tokio::sync::mpsc;
use tonic::transport::Channel;
use tonic::{Code, Status};
use wire::plan_in_force;
use wire::rpc::CompositorClient;

use crate::circuit_breaker::CircuitBreaker;
use crate::error::ClientError;

/// A compositor and the channel to it.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) share: CompositorShare,
    pub(crate) client: CompositorClient,
    pub(crate) breaker: CircuitBreaker,
    /// Plans that compositors name.
    named_plans: mpsc::Sender<Assignment>,
}

impl Peer {
    pub(crate) fn new(share: &CompositorShare, channel: Channel, named_plans: mpsc::Sender<Assignment>) -> Self {
        let client = CompositorClient::new(channel);
        Self { share: share.clone(), client, breaker: CircuitBreaker::default(), named_plans }
    }

    /// A compositor that refuses a plan names the one in force: the coordinator may be out of reach.
    fn pass_on_plan(&self, refusal: &Status) {
        if let Some(assignment) = plan_in_force(refusal) {
            // Where there is no room, other compositors have named it.
            let _ = self.named_plans.try_send(assignment);
        }
    }

    pub(crate) fn error(&self, reason: impl ToString) -> ClientError {
        ClientError::compositor(&self.share, reason)
    }
}

/// Why a call ended before all its frames were received.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The plan may be about to be replaced: its successor is asked for the missing frames.
    OfPlan(ClientError),
    /// Another plan would fail as well.
    OfRequest(ClientError),
    /// This compositor has no room.
    Exhausted(ClientError),
}

impl Failure {
    /// The peer is at fault: other compositors are asked first from now on.
    pub(crate) fn of_peer(peer: &Peer, error: ClientError) -> Self {
        peer.breaker.trip();
        Self::OfPlan(error)
    }

    /// The failure that a status of the peer means.
    pub(crate) fn of_status(peer: &Peer, status: &Status) -> Self {
        let error = peer.error(status.message());
        match status.code() {
            Code::InvalidArgument | Code::NotFound | Code::Unimplemented => Self::OfRequest(error),
            Code::ResourceExhausted => Self::Exhausted(ClientError::Exhausted { reason: error.to_string() }),
            // The compositor waited for this client, whose caller was busy.
            Code::DeadlineExceeded => Self::OfPlan(error),
            // The compositor knows better which plan is in force.
            Code::FailedPrecondition => {
                peer.pass_on_plan(status);
                Self::OfPlan(error)
            }
            _ => Self::of_peer(peer, error),
        }
    }
}
