//! One server with the settings that all services have, and a drain with a deadline. Connections are accepted once they have
//! sent the preface of HTTP/2.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use tonic::transport::Server;
use tonic_health::ServingStatus;
use tonic_health::pb::health_server::{Health, HealthServer};
use wire::rpc::{KEEPALIVE_INTERVAL, KEEPALIVE_TIMEOUT, reflection_server};

use crate::engine::EngineError;

/// The time that connections may take to end after their streams have ended.
pub const DRAIN: Duration = Duration::from_secs(10);
/// Most streams, and calls that are being answered, of one connection.
pub const MAX_STREAMS: u32 = 64;
/// The first bytes of a connection of HTTP/2.
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
/// The time that the preface may take. Keepalive covers connections only from then on.
const PREFACE_TIMEOUT: Duration = Duration::from_secs(5);
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Connections that may be without a preface at the same time: further ones wait in the system's queue.
const MAX_SILENT: usize = 1024;
/// The delay after a failure to accept: where the system has no more files, others must close theirs first.
const AFTER_ERROR: Duration = Duration::from_millis(100);

/// Why a server did not serve.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming variants and fields")]
pub enum ServeError {
    /// Others could reach it and nothing protects it.
    #[error("{address} is not loopback: give --insecure-bind to serve there without TLS")]
    NotLoopback { address: SocketAddr },
    #[error("listening: {0}")]
    Listen(#[from] io::Error),
    #[error("reflection: {0}")]
    Reflection(String),
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
    listener: TcpListener,
    routes: Routes,
    insecure_bind: bool,
    shutdown: CancellationToken,
) -> Result<(), ServeError> {
    let address = listener.local_addr()?;
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
        .serve_with_incoming_shutdown(accept_http2(listener), shutdown.clone().cancelled_owned());
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

/// The routes, with reflection where it is wanted.
///
/// # Errors
/// Where the descriptors cannot be read.
pub fn with_reflection(routes: Routes, wanted: bool) -> Result<Routes, ServeError> {
    let described = || reflection_server().map_err(|error| ServeError::Reflection(error.to_string()));
    if wanted { Ok(routes.add_service(described()?)) } else { Ok(routes) }
}

/// The health service, with each role serving.
pub async fn health(roles: &[&str]) -> HealthServer<impl Health> {
    let (reporter, server) = tonic_health::server::health_reporter();
    for role in roles {
        reporter.set_service_status(*role, ServingStatus::Serving).await;
    }
    server
}

/// Connections of HTTP/2; others are cut. Accepts until the stream is dropped.
fn accept_http2(listener: TcpListener) -> ReceiverStream<io::Result<TcpStream>> {
    let (send, accepted) = mpsc::channel(16);
    tokio::spawn(async move {
        tokio::select! {
            () = accept(listener, send.clone()) => (),
            () = send.closed() => (),
        }
    });
    ReceiverStream::new(accepted)
}

async fn accept(listener: TcpListener, send: mpsc::Sender<io::Result<TcpStream>>) {
    let mut silent = JoinSet::new();
    loop {
        if silent.len() >= MAX_SILENT {
            silent.join_next().await;
        }
        while silent.try_join_next().is_some() {}
        match listener.accept().await {
            Ok((stream, _)) => drop(silent.spawn(admit(stream, send.clone()))),
            Err(error) => {
                tracing::warn!(%error, "no connection can be accepted");
                tokio::time::sleep(AFTER_ERROR).await;
            }
        }
    }
}

async fn admit(stream: TcpStream, send: mpsc::Sender<io::Result<TcpStream>>) {
    if let Ok(Ok(true)) = tokio::time::timeout(PREFACE_TIMEOUT, has_preface(&stream)).await {
        let _ = stream.set_nodelay(true);
        let _ = send.send(Ok(stream)).await;
    }
}

/// Whether a connection begins with the preface, whose bytes stay unread.
async fn has_preface(stream: &TcpStream) -> io::Result<bool> {
    let mut received = [0; PREFACE.len()];
    loop {
        let count = stream.peek(&mut received).await?;
        if count == 0 || !PREFACE.starts_with(&received[..count]) {
            return Ok(false);
        }
        if count == PREFACE.len() {
            return Ok(true);
        }
        // Another peek at once would find the same bytes.
        tokio::time::sleep(POLL_INTERVAL).await;
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio_stream::StreamExt as _;

    use super::*;

    #[tokio::test]
    async fn connections_without_the_preface_of_http2_are_cut() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let mut accepted = accept_http2(listener);
        for wrong in [&b"GET / HTTP/1.1\r\n\r\n"[..], b"PRI * HTTP/1.0", b"\0"] {
            let mut stream = TcpStream::connect(address).await.unwrap();
            stream.write_all(wrong).await.unwrap();
            // It is reset or ended at once.
            let ended = tokio::time::timeout(Duration::from_secs(1), stream.read(&mut [0; 8])).await.unwrap();
            assert!(ended.map_or(true, |count| count == 0));
        }
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(&PREFACE[..9]).await.unwrap();
        tokio::time::sleep(2 * POLL_INTERVAL).await;
        stream.write_all(&PREFACE[9..]).await.unwrap();
        let mut served = accepted.next().await.unwrap().unwrap();
        let mut said = [0; PREFACE.len()];
        served.read_exact(&mut said).await.unwrap();
        assert_eq!(said, PREFACE);
    }
}
