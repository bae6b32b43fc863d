//! `myriorama gateway`: thin clients in browsers.

use std::net::SocketAddr;
use std::sync::Arc;

use app_core::delivery::{at_rate, request};
use app_core::exit::Outcome;
use app_core::process::{cancel_at_signal, listen};
use app_core::sizes::SizePx;
use clap::Args;
use cluster::{OfferStatus, PolicyChoice, SessionRequest};
use depth_image::PinholeCamera;
use gateway::{GatewayConfig, RequestOf};
use glam::UVec2;
use tokio_util::sync::CancellationToken;

/// Pictures a second of a visitor who moves.
const PICTURES_PER_S: f64 = 20.0;

/// Serves the viewer to browsers. Pictures go on while the coordinator is away. There may be any number of gateways.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama gateway --coordinator http://127.0.0.1:7420 --listen 127.0.0.1:7421")]
pub struct GatewayArgs {
    /// The coordinator
    #[arg(long, default_value = "http://127.0.0.1:7420", value_name = "URL")]
    coordinator: String,
    /// The address to listen on
    #[arg(long, default_value = "127.0.0.1:7421", value_name = "HOST:PORT")]
    listen: SocketAddr,
    /// The most visitors at a time; further ones wait
    #[arg(long, default_value_t = 24, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=24))]
    max_visitors: u16,
    /// The largest still picture
    #[arg(long, default_value_t = SizePx(UVec2::new(1920, 1080)), value_name = "WxH")]
    max_still: SizePx,
    /// The policy of the visitors' sessions: pipeline, direct, time-share, or auto (the fastest by prediction)
    #[arg(long, default_value_t, value_name = "NAME")]
    policy: PolicyChoice,
    /// A name of this server in links, beside localhost and addresses; may be repeated
    #[arg(long = "host", value_name = "NAME")]
    hosts: Vec<String>,
    /// Another page that may use this server, as https://host; may be repeated
    #[arg(long = "allow-origin", value_name = "ORIGIN")]
    origins: Vec<String>,
    /// Serves without TLS on an address that others can reach
    #[arg(long)]
    insecure_bind: bool,
}

/// Runs until a signal.
///
/// # Errors
/// The port is taken, or the address is not allowed.
pub async fn run(args: GatewayArgs) -> anyhow::Result<Outcome> {
    let listener = listen(args.listen, args.insecure_bind).await?;
    println!("Open http://{}/", listener.local_addr()?);
    let config = GatewayConfig {
        max_visitors: usize::from(args.max_visitors),
        max_still_px: args.max_still.0,
        hosts: args.hosts,
        origins: args.origins,
        ..GatewayConfig::new(&args.coordinator, request_of(args.policy))
    };
    let shutdown = CancellationToken::new();
    cancel_at_signal(shutdown.clone());
    gateway::serve(gateway::accept(listener), config, shutdown).await;
    Ok(Outcome::Done)
}

/// The session of a scene's visitors: with the scene's own settings, a rate, fallbacks, and view cells that follow them.
fn request_of(policy: PolicyChoice) -> RequestOf {
    Arc::new(move |offer: &OfferStatus, typical: PinholeCamera| {
        let request = request(offer.settings.clone(), &[typical]).expect("one view");
        let request = at_rate(request, PICTURES_PER_S);
        SessionRequest { scene: Some(offer.name.clone()), policy, viewpoints: vec![typical], ..request }
    })
}
