//! Addresses on the command line: of the coordinator, to listen on, and for metrics.

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs as _, UdpSocket};

use anyhow::Context as _;
use clap::Args;
use client::Client;
use node::Telemetry;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;

use crate::exit::BadInput;
use crate::print_line;

/// The coordinator of a client, a node or a gateway.
#[derive(Debug, Clone, Args)]
pub struct CoordinatorArgs {
    /// The address of the coordinator
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:7420", env = "MYRIORAMA_COORDINATOR", value_parser = coordinator_url)]
    pub coordinator: String,
}

impl CoordinatorArgs {
    /// Connects as a client.
    ///
    /// # Errors
    /// No coordinator answers.
    pub async fn connect(&self) -> anyhow::Result<Client> {
        Client::connect(&self.coordinator).await.with_context(|| format!("no coordinator at {}", self.coordinator))
    }
}

/// Permission to serve others without TLS.
#[derive(Debug, Clone, Copy, Args)]
pub struct InsecureArgs {
    /// Serves without TLS on an address that others can reach
    #[arg(long)]
    pub insecure_bind: bool,
}

/// The metrics of a process.
#[derive(Debug, Clone, Copy, Args)]
pub struct MetricsArgs {
    /// The address for Prometheus, at /metrics [default: no metrics]
    #[arg(long, value_name = "HOST:PORT", value_parser = listen_address)]
    metrics: Option<SocketAddr>,
}

impl MetricsArgs {
    /// Serves the metrics until `shutdown`, where an address is given.
    ///
    /// # Errors
    /// As [`listen`].
    pub async fn serve(
        self,
        insecure: InsecureArgs,
        telemetry: Telemetry,
        shutdown: CancellationToken,
    ) -> anyhow::Result<()> {
        if let Some(address) = self.metrics {
            let listener = listen(address, insecure.insecure_bind).await?;
            print_line!("metrics at http://{}/metrics", listener.local_addr()?);
            tokio::spawn(telemetry.serve(listener, shutdown));
        }
        Ok(())
    }
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

/// An address that is bound to all interfaces, with that of the interface towards another machine.
#[must_use]
pub fn address_towards(bound: SocketAddr, other: &str) -> Option<SocketAddr> {
    let socket = UdpSocket::bind((bound.ip(), 0)).ok()?;
    // No packet is sent: the system only chooses the interface.
    socket.connect(other).ok()?;
    Some(SocketAddr::new(socket.local_addr().ok()?.ip(), bound.port()))
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
