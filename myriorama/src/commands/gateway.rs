//! `myriorama gateway`: thin clients in browsers.

use std::net::SocketAddr;
use std::path::PathBuf;

use app_core::addresses::{CoordinatorArgs, InsecureArgs, address_towards, listen, listen_address};
use app_core::exit::{BadInput, Outcome};
use app_core::print_line;
use app_core::process::StopSignals;
use app_core::quality::quality;
use app_core::sizes::SizePx;
use clap::Args;
use cluster::PolicyChoice;
use depth_image::LightCacheQuality;
use gateway::{GatewayConfig, Token, tls_config};
use glam::UVec2;

use crate::tone::ToneArgs;
use crate::viewer::{NameArgs, request_of, shared_light_methods};

/// Serves the viewer to browsers. Pictures go on while the coordinator is away. There may be any number of gateways.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama gateway --coordinator http://127.0.0.1:7420 --listen 127.0.0.1:7421")]
pub struct GatewayArgs {
    #[command(flatten)]
    coordinator: CoordinatorArgs,
    /// The address to listen on
    #[arg(long, default_value = "127.0.0.1:7421", value_name = "HOST:PORT", value_parser = listen_address)]
    listen: SocketAddr,
    /// The largest still picture
    #[arg(long, default_value_t = SizePx(UVec2::new(1920, 1080)), value_name = "WxH")]
    max_still: SizePx,
    /// The policy of the visitors' sessions: pipeline, direct, time-share, or auto (the fastest by prediction)
    #[arg(long, default_value_t, value_name = "NAME")]
    policy: PolicyChoice,
    /// The quality of shared light in stills, and at most in motion, unless a visitor chooses another: draft, fast, balanced,
    /// fine or exact [default: that of the scene, or fine]
    #[arg(long, value_name = "NAME", value_parser = quality)]
    quality: Option<LightCacheQuality>,
    #[command(flatten)]
    tone: ToneArgs,
    #[command(flatten)]
    names: NameArgs,
    /// The certificate chain of TLS, as PEM
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// The private key of the certificate, as PEM
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    #[command(flatten)]
    insecure: InsecureArgs,
}

/// Runs until a signal.
///
/// # Errors
/// The port is taken, or the address is not allowed.
pub async fn run(args: GatewayArgs) -> anyhow::Result<Outcome> {
    let files = args.tls_cert.as_deref().zip(args.tls_key.as_deref());
    let tls = files.map(|(certificates, key)| tls_config(certificates, key)).transpose();
    let tls = tls.map_err(|error| BadInput(format!("--tls-cert, --tls-key: {error}")))?;
    let listener = listen(args.listen, args.insecure.insecure_bind || tls.is_some()).await?;
    let address = listener.local_addr()?;
    // Whoever can reach the port needs the link.
    let token = if address.ip().is_loopback() { None } else { Some(Token::random()?) };
    let scheme = if tls.is_some() { "https" } else { "http" };
    let authority = reachable(address, args.names.hosts.first());
    print_line!("Open {scheme}://{authority}/{}", token.as_ref().map_or_else(String::new, Token::query));
    let config = GatewayConfig {
        max_still_px: args.max_still.0,
        hosts: args.names.hosts,
        origins: args.names.origins,
        tls,
        token,
        quality: args.quality,
        ..GatewayConfig::new(&args.coordinator.coordinator, request_of(args.policy, args.tone), shared_light_methods())
    };
    gateway::serve(gateway::accept(listener), config, StopSignals::listen()?.first).await;
    Ok(Outcome::Done)
}

/// The host and port by which others reach an address: its first name, or the machine's own address where it is bound to all.
fn reachable(address: SocketAddr, name: Option<&String>) -> String {
    match name {
        Some(name) => format!("{name}:{}", address.port()),
        None if address.ip().is_unspecified() => outbound(address).unwrap_or(address).to_string(),
        None => address.to_string(),
    }
}

/// The address from which this machine would reach others.
fn outbound(address: SocketAddr) -> Option<SocketAddr> {
    let elsewhere = if address.is_ipv4() { "192.0.2.1:9" } else { "[2001:db8::1]:9" };
    address_towards(address, elsewhere)
}
