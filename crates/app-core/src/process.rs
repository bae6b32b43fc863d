//! What every command needs of the process: a runtime, a signal, its memory.

use std::net::SocketAddr;

use anyhow::Context as _;
use node::Telemetry;
use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

use crate::exit::BadInput;

/// A runtime for services and clients.
///
/// # Errors
/// When the system refuses threads.
pub fn runtime() -> anyhow::Result<Runtime> {
    tokio::runtime::Builder::new_multi_thread().enable_all().build().context("no runtime")
}

/// Resolves at ctrl-c or SIGTERM.
///
/// # Errors
/// When signals cannot be listened to.
pub async fn stop_signal() -> anyhow::Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::select! {
        ended = tokio::signal::ctrl_c() => ended?,
        _ = terminate.recv() => (),
    }
    Ok(())
}

/// A port to serve on.
///
/// # Errors
/// When it is taken or not ours; addresses that are not loopback need `insecure_bind`.
pub async fn listen(address: SocketAddr, insecure_bind: bool) -> anyhow::Result<TcpListener> {
    if !address.ip().is_loopback() && !insecure_bind {
        let reason = format!("{address} is not loopback: give --insecure-bind to serve there without TLS");
        return Err(BadInput(reason).into());
    }
    TcpListener::bind(address).await.with_context(|| format!("cannot listen on {address}"))
}

/// Serves a process's metrics until `shutdown`, where an address is given.
///
/// # Errors
/// As [`listen`].
pub async fn serve_metrics(
    address: Option<SocketAddr>,
    insecure_bind: bool,
    telemetry: Telemetry,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    if let Some(address) = address {
        let listener = listen(address, insecure_bind).await?;
        println!("metrics at http://{}/metrics", listener.local_addr()?);
        tokio::spawn(telemetry.serve(listener, shutdown));
    }
    Ok(())
}
