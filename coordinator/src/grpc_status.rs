//! gRPC statuses of refusals and of failed calls.

use std::future::Future;
use std::time::Duration;

use tonic::Status;

use crate::schedule::ChoiceError;

/// The status of a demand that cannot be planned.
pub(crate) fn refusal(error: &ChoiceError) -> Status {
    match error {
        ChoiceError::Overload { .. } | ChoiceError::Workloads { .. } => Status::resource_exhausted(error.to_string()),
        ChoiceError::Rejected { .. }
        | ChoiceError::ForcedTiles { .. }
        | ChoiceError::Cells { .. }
        | ChoiceError::NoCells { .. } => Status::invalid_argument(error.to_string()),
        ChoiceError::NoNodes | ChoiceError::ForcedSamplers { .. } | ChoiceError::Override { .. } => {
            Status::failed_precondition(error.to_string())
        }
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
