//! gRPC statuses of refusals and of failed calls.

use std::future::Future;
use std::time::Duration;

use tonic::{Code, Status};

use crate::schedule::ChoiceError;

/// The status of a demand that cannot be planned.
impl From<ChoiceError> for Status {
    fn from(error: ChoiceError) -> Self {
        use ChoiceError as E;
        let code = match error {
            E::Overload { .. } | E::Workloads { .. } => Code::ResourceExhausted,
            E::Rejected { .. } | E::ForcedTiles { .. } | E::Cells { .. } | E::NoCells { .. } => Code::InvalidArgument,
            E::NoNodes | E::ForcedSamplers { .. } | E::Override { .. } => Code::FailedPrecondition,
        };
        Self::new(code, error.to_string())
    }
}

/// A call with a deadline.
pub(crate) async fn within<T>(
    deadline: Duration,
    what: &str,
    call: impl Future<Output = Result<T, Status>>,
) -> Result<T, Status> {
    tokio::time::timeout(deadline, call)
        .await
        .unwrap_or_else(|_| Err(Status::deadline_exceeded(format!("{what} took longer than {} s", deadline.as_secs()))))
}

/// A status that names the node it is of.
pub(crate) fn of_node(node: &str, status: &Status) -> Status {
    Status::new(status.code(), format!("node {node}: {}", status.message()))
}
