//! Whether a process serves, as the standard health service says.

use tonic::Status;
use tonic_health::pb::{HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient};

use super::connect;

/// Asks the process at `http://host:port` of a role, or, with an empty name, of all of it.
///
/// # Errors
/// Where nobody answers, or the role is not known there.
pub async fn is_serving(address: &str, role: &str) -> Result<bool, Status> {
    let request = HealthCheckRequest { service: role.to_owned() };
    let answer = HealthClient::new(connect(address).await?).check(request).await?;
    Ok(answer.into_inner().status() == ServingStatus::Serving)
}
