//! The client of the standard health service.

use tonic::Status;
use tonic_health::pb::{HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient};

use super::connect;

/// Whether the process at `http://host:port` serves a role, or, with an empty name, all of its roles.
///
/// # Errors
/// Where no process answers, or it does not know the role.
pub async fn is_serving(address: &str, role: &str) -> Result<bool, Status> {
    let request = HealthCheckRequest { service: role.to_owned() };
    let answer = HealthClient::new(connect(address).await?).check(request).await?;
    Ok(answer.into_inner().status() == ServingStatus::Serving)
}
