//! Connections of HTTP/1, each within limits.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::middleware::{Next, from_fn_with_state};
use axum::response::Response;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use tokio::time::Instant;
use tokio_io_timeout::TimeoutStream;
use tokio_rustls::TlsAcceptor;
use tokio_util::sync::CancellationToken;

use crate::config::GatewayConfig;
use crate::gateway::Gateway;
use crate::http::router;

/// The time that a request's headers may take, and the idle time of a connection between requests.
const HEADERS_WITHIN: Duration = Duration::from_secs(10);
/// The time that a client may take to read an answer, after which its connection is cut.
const READ_WITHIN: Duration = Duration::from_secs(60);
/// The time that a connection may take none of what is written to it.
const WRITES_WITHIN: Duration = Duration::from_secs(20);
/// Open connections: further ones wait in the system's queue.
const MAX_CONNECTIONS: usize = 1024;
/// Connections that wait for the gateway.
const WAITING: usize = 16;
/// The delay after a failure to accept: where the system has no more files, others must close theirs first.
const AFTER_ERROR: Duration = Duration::from_millis(100);
/// The time that connections may take to end.
const DRAIN: Duration = Duration::from_secs(5);

/// Connections of browsers, from a port of their own or from one that they share with gRPC.
pub type Connections = mpsc::Receiver<TcpStream>;

/// Accepts the connections of a port, until nobody takes them.
#[must_use]
pub fn accept(listener: TcpListener) -> Connections {
    let (send, connections) = mpsc::channel(WAITING);
    tokio::spawn(async move {
        loop {
            let accepted = tokio::select! {
                accepted = listener.accept() => accepted,
                () = send.closed() => return,
            };
            match accepted {
                Ok((stream, _)) => drop(send.send(stream).await),
                Err(error) => {
                    tracing::warn!(%error, "no connection can be accepted");
                    tokio::time::sleep(AFTER_ERROR).await;
                }
            }
        }
    });
    connections
}

/// Serves browsers until `shutdown`.
pub async fn serve(mut connections: Connections, config: GatewayConfig, shutdown: CancellationToken) {
    let tls = config.tls.clone().map(TlsAcceptor::from);
    let gateway = Arc::new(Gateway::new(config, shutdown.clone()));
    let router = router(gateway.clone());
    let mut open = JoinSet::new();
    let until = shutdown.clone();
    open.spawn(async move {
        until.run_until_cancelled(gateway.scenes.prepare()).await;
    });
    loop {
        while open.try_join_next().is_some() {}
        let stream = tokio::select! {
            () = shutdown.cancelled() => break,
            Some(_) = open.join_next(), if open.len() >= MAX_CONNECTIONS => continue,
            stream = connections.recv(), if open.len() < MAX_CONNECTIONS => match stream {
                Some(stream) => stream,
                None => break,
            },
        };
        let _ = stream.set_nodelay(true);
        let mut stream = Box::pin(TimeoutStream::new(stream));
        stream.as_mut().set_write_timeout_pinned(Some(WRITES_WITHIN));
        let router = router.clone();
        let shutdown = shutdown.clone();
        match tls.clone() {
            None => drop(open.spawn(answer(stream, router, shutdown))),
            Some(tls) => drop(open.spawn(async move {
                // A fault of one connection is that client's own.
                if let Ok(Ok(stream)) = tokio::time::timeout(HEADERS_WITHIN, tls.accept(stream)).await {
                    answer(stream, router, shutdown).await;
                }
            })),
        }
    }
    let ended = async { while open.join_next().await.is_some() {} };
    let _ = tokio::time::timeout(DRAIN, ended).await;
}

/// Answers the requests of a connection.
async fn answer(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    router: Router,
    shutdown: CancellationToken,
) {
    let due = watch::Sender::default();
    let mut overdue = due.subscribe();
    let router = router.layer(from_fn_with_state(due, noted));
    let mut http = hyper::server::conn::http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEADERS_WITHIN);
    let connection = http.serve_connection(TokioIo::new(stream), TowerToHyperService::new(router)).with_upgrades();
    tokio::pin!(connection);
    tokio::select! {
        _ = &mut connection => return,
        () = is_overdue(&mut overdue) => return,
        () = shutdown.cancelled() => connection.as_mut().graceful_shutdown(),
    }
    // A fault of one connection is that client's own.
    let _ = tokio::time::timeout(DRAIN, connection).await;
}

/// Notes by when an answer is due to be read.
async fn noted(State(due): State<watch::Sender<Option<Instant>>>, request: Request, next: Next) -> Response {
    due.send_replace(None);
    let response = next.run(request).await;
    // A WebSocket stays open.
    if response.status() != StatusCode::SWITCHING_PROTOCOLS {
        due.send_replace(Some(Instant::now() + READ_WITHIN));
    }
    response
}

/// Waits until an answer should have been read.
async fn is_overdue(due: &mut watch::Receiver<Option<Instant>>) {
    loop {
        let at = *due.borrow_and_update();
        match at {
            None if due.changed().await.is_ok() => (),
            // The connection has ended.
            None => std::future::pending().await,
            Some(at) if tokio::time::timeout_at(at, due.changed()).await.is_err() => return,
            Some(_) => (),
        }
    }
}

#[cfg(test)]
mod tests {
    use axum::routing::get;
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

    use super::*;

    /// Reads an answer of 1 MiB at this rate. Returns the bytes that came and the seconds until the connection ended.
    async fn read_slowly(bytes_a_second: usize) -> (usize, u64) {
        let router = Router::new().route("/", get(async || vec![0_u8; 1 << 20]));
        let (mut client, server) = tokio::io::duplex(1 << 16);
        let serving = tokio::spawn(answer(server, router, CancellationToken::new()));
        client.write_all(b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").await.unwrap();
        let start = Instant::now();
        let mut chunk = vec![0; bytes_a_second];
        let mut total = 0;
        loop {
            match client.read(&mut chunk).await.unwrap_or(0) {
                0 => break,
                read => total += read,
            }
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
        let seconds = start.elapsed().as_secs();
        serving.await.unwrap();
        (total, seconds)
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_is_read_byte_by_byte_is_cut() {
        let (bytes, seconds) = read_slowly(16).await;
        // What was written before is read to its end.
        assert!(bytes < 1 << 17 && seconds >= 60, "{bytes} bytes in {seconds} s");
        let (bytes, seconds) = read_slowly(1 << 16).await;
        assert!(bytes > 1 << 20 && seconds < 60, "{bytes} bytes in {seconds} s");
    }
}
