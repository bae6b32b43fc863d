//! Connections to peers.

use std::time::Duration;

use tonic::Status;
use tonic::transport::{Channel, Endpoint};
use tonic_health::pb::{HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient};

/// The interval of probes of an idle connection; with [`KEEPALIVE_TIMEOUT`], a silent loss is noticed after 10 s.
pub const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(5);
/// The longest wait for the answer to a probe.
pub const KEEPALIVE_TIMEOUT: Duration = Duration::from_secs(5);
/// The longest time to connect.
pub const CALL_TIMEOUT: Duration = Duration::from_secs(5);

/// A connection to `http://host:port`.
///
/// # Errors
/// `INVALID_ARGUMENT` for an invalid address, `UNAVAILABLE` where no process answers.
pub async fn connect(address: &str) -> Result<Channel, Status> {
    let connected = endpoint(address)?.connect().await;
    connected.map_err(|error| Status::unavailable(format!("{address}: {error}")))
}

/// As [`connect`], on first use.
///
/// # Errors
/// `INVALID_ARGUMENT` for an invalid address.
pub fn connect_later(address: &str) -> Result<Channel, Status> {
    Ok(endpoint(address)?.connect_lazy())
}

/// Whether the process at `http://host:port` serves a role, or, with an empty name, all of its roles.
///
/// # Errors
/// Where no process answers, or it does not know the role.
pub async fn is_serving(address: &str, role: &str) -> Result<bool, Status> {
    let request = HealthCheckRequest { service: role.to_owned() };
    let answer = HealthClient::new(connect(address).await?).check(request).await?;
    Ok(answer.into_inner().status() == ServingStatus::Serving)
}

fn endpoint(address: &str) -> Result<Endpoint, Status> {
    let endpoint = Endpoint::from_shared(address.to_owned())
        .map_err(|error| Status::invalid_argument(format!("address {address}: {error}")))?;
    Ok(endpoint
        .connect_timeout(CALL_TIMEOUT)
        .tcp_nodelay(true)
        .http2_keep_alive_interval(KEEPALIVE_INTERVAL)
        .keep_alive_timeout(KEEPALIVE_TIMEOUT)
        .keep_alive_while_idle(true)
        // The default window of 64 KiB would stop a sender of images eight times a message.
        .initial_stream_window_size(4 << 20)
        .initial_connection_window_size(16 << 20))
}
