//! Basics of every command: a runtime, a signal, ports.

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs as _};

use anyhow::Context as _;
use node::Telemetry;
use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

use crate::exit::BadInput;
use crate::print_line;

/// A runtime for services and clients.
///
/// # Errors
/// The system refuses threads.
pub fn runtime() -> anyhow::Result<Runtime> {
    tokio::runtime::Builder::new_multi_thread().enable_all().build().context("no runtime")
}

/// Waits for ctrl-c or SIGTERM.
///
/// # Errors
/// Signals cannot be received.
pub async fn stop_signal() -> anyhow::Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::select! {
        ended = tokio::signal::ctrl_c() => ended?,
        _ = terminate.recv() => (),
    }
    Ok(())
}

/// Ctrl-c or SIGTERM, once and again.
#[derive(Debug, Clone, Default)]
pub struct StopSignals {
    /// The first asks the command to end in order.
    pub first: CancellationToken,
    /// The second ends the command at once.
    pub second: CancellationToken,
}

impl StopSignals {
    /// Signals of the system from now on.
    ///
    /// # Errors
    /// Signals cannot be received.
    pub fn listen() -> anyhow::Result<Self> {
        let [mut interrupt, mut terminate] = [signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?];
        let signals = Self::default();
        let heard = signals.clone();
        tokio::spawn(async move {
            for token in [heard.first, heard.second] {
                tokio::select! {
                    _ = interrupt.recv() => token.cancel(),
                    _ = terminate.recv() => token.cancel(),
                }
            }
        });
        Ok(signals)
    }
}

/// Cancels `shutdown` at ctrl-c or SIGTERM. Without signals, the caller can still kill the process.
pub fn cancel_at_signal(shutdown: CancellationToken) {
    tokio::spawn(async move {
        if stop_signal().await.is_ok() {
            shutdown.cancel();
        }
    });
}

/// An address to listen on, as `HOST:PORT` with a name or a number.
///
/// # Errors
/// The text has no port, or the name is unknown.
pub fn listen_address(text: &str) -> Result<SocketAddr, String> {
    let mut found = text.to_socket_addrs().map_err(|error| format!("{error}, must be HOST:PORT"))?;
    found.next().ok_or_else(|| format!("{text} has no address"))
}

/// The address of a coordinator; `http://` may be left out.
///
/// # Errors
/// Another scheme.
pub fn coordinator_url(text: &str) -> Result<String, String> {
    match text.split_once("://") {
        None => Ok(format!("http://{text}")),
        Some(("http", _)) => Ok(text.to_owned()),
        Some(("https", _)) => Err("coordinators have no TLS yet: use http://, in a network that is trusted".to_owned()),
        Some((scheme, _)) => Err(format!("the scheme is {scheme}, must be http")),
    }
}

/// Opens a port to serve on.
///
/// # Errors
/// The port is taken or reserved, or the address is not loopback and `insecure_bind` is not given.
pub async fn listen(address: SocketAddr, insecure_bind: bool) -> anyhow::Result<TcpListener> {
    if !address.ip().is_loopback() && !insecure_bind {
        let reason = format!("{address} is not loopback: give --insecure-bind to serve there without TLS");
        return Err(BadInput(reason).into());
    }
    TcpListener::bind(address).await.with_context(|| format!("cannot listen on {address}"))
}

/// The address at which this process reaches a listener, which may be bound to all addresses.
///
/// # Errors
/// The listener has no address.
pub fn loopback_of(listener: &TcpListener) -> anyhow::Result<SocketAddr> {
    let mut address = listener.local_addr()?;
    if address.ip().is_unspecified() {
        address.set_ip(if address.is_ipv4() { Ipv4Addr::LOCALHOST.into() } else { Ipv6Addr::LOCALHOST.into() });
    }
    Ok(address)
}

/// Serves the process's metrics until `shutdown`, where an address is given.
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
        print_line!("metrics at http://{}/metrics", listener.local_addr()?);
        tokio::spawn(telemetry.serve(listener, shutdown));
    }
    Ok(())
}
