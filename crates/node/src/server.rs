//! One server with the settings that all services have, and a drain with a deadline.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use tonic::transport::Server;
use tonic_health::ServingStatus;
use tonic_health::pb::health_server::{Health, HealthServer};
use wire::rpc::{KEEPALIVE_INTERVAL, KEEPALIVE_TIMEOUT};

use crate::engine::EngineError;
use crate::port::Port;

/// The time that connections may take to end after their streams have ended.
pub const DRAIN: Duration = Duration::from_secs(10);
/// Most streams, and calls that are being answered, of one connection.
pub const MAX_STREAMS: u32 = 256;

/// Why a server did not serve.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming variants and fields")]
pub enum ServeError {
    /// Others could reach it and nothing protects it.
    #[error("{address} is not loopback: give --insecure-bind to serve there without TLS")]
    NotLoopback { address: SocketAddr },
    #[error("listening: {0}")]
    Listen(#[from] io::Error),
    /// The process can make nothing (any more); a supervisor may start it again.
    #[error("no device could be opened: {0}")]
    Device(#[from] EngineError),
    #[error("serving: {0}")]
    Transport(#[from] tonic::transport::Error),
}

/// Serves until `shutdown`, then waits for connections to end, at most [`DRAIN`].
///
/// # Errors
/// Where the address is not allowed or the transport fails.
pub async fn serve(
    port: impl Into<Port>,
    routes: Routes,
    insecure_bind: bool,
    shutdown: CancellationToken,
) -> Result<(), ServeError> {
    let port = port.into();
    let address = port.listener.local_addr()?;
    if !address.ip().is_loopback() && !insecure_bind {
        return Err(ServeError::NotLoopback { address });
    }
    let serving = Server::builder()
        .load_shed(true)
        .concurrency_limit_per_connection(MAX_STREAMS as usize)
        .max_concurrent_streams(MAX_STREAMS)
        .http2_keepalive_interval(Some(KEEPALIVE_INTERVAL))
        .http2_keepalive_timeout(Some(KEEPALIVE_TIMEOUT))
        .initial_stream_window_size(4 << 20)
        .initial_connection_window_size(16 << 20)
        .add_routes(routes)
        .serve_with_incoming_shutdown(port.accept(), shutdown.clone().cancelled_owned());
    let overdue = async {
        shutdown.cancelled().await;
        tokio::time::sleep(DRAIN).await;
    };
    tokio::select! {
        result = serving => Ok(result?),
        () = overdue => {
            tracing::warn!(%address, "connections were cut at the end of the drain");
            Ok(())
        }
    }
}

/// The health service, with each role serving.
pub async fn health(roles: &[&str]) -> HealthServer<impl Health> {
    let (reporter, server) = tonic_health::server::health_reporter();
    for role in roles {
        reporter.set_service_status(*role, ServingStatus::Serving).await;
    }
    server
}
