//! `myriorama up`: a whole cluster in one process.

use std::net::SocketAddr;

use app_core::addresses::{listen, listen_address};
use app_core::cluster::Cluster;
use app_core::exit::Outcome;
use app_core::node_limits::NodeLimitArgs;
use app_core::print_line;
use app_core::process::StopSignals;
use app_core::scenes::ScenesArgs;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::{GpuEngine, LampSampling};
use node::Engine as _;

use crate::serving::ServingArgs;

/// Serves until ctrl-c or SIGTERM, then drains for at most 10 s.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: myriorama up --scene helmet.gltf --nodes 5\nThen:    myriorama view --orbit 24 --out out/orbit"
)]
pub struct UpArgs {
    #[command(flatten)]
    scenes: ScenesArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    limits: NodeLimitArgs,
    /// How rectangle lights are sampled under "soft NxN by samples": a sampling method, the side of images and shadow maps
    /// (and of the layered cube of "by cube"), and mesh or hybrid_mesh[:PX]
    #[arg(long, value_name = "SAMPLING SIDE METHOD", default_value_t)]
    lamp_samples: LampSampling,
    /// Nodes P that share the device
    #[arg(long, default_value_t = 5, value_name = "P", value_parser = clap::value_parser!(u16).range(1..=256))]
    nodes: u16,
    /// The address that the coordinator listens on
    #[arg(long, default_value = "127.0.0.1:7420", value_name = "HOST:PORT", value_parser = listen_address)]
    listen: SocketAddr,
    #[command(flatten)]
    serving: ServingArgs,
}

/// Runs until a signal.
///
/// # Errors
/// The scene cannot be used, there is no device, or the port is taken.
pub async fn run(args: UpArgs) -> anyhow::Result<Outcome> {
    let (scenes, offers) = args.serving.load(&args.scenes)?;
    let listener = listen(args.listen, args.serving.insecure.insecure_bind).await?;
    let engine = GpuEngine::shared(args.device.device)?;
    let memory = args.limits.set_memory_bytes(engine.is_software());
    let nodes = usize::from(args.nodes);
    engine.bound_scenes(memory);
    engine.set_lamp_sampling(args.lamp_samples);
    for (scene, offer) in scenes.iter().zip(offers.iter()) {
        engine.put_scene(offer.hash.as_str(), scene)?;
        print_line!("{}: {}", offer.name, scene.contents());
    }
    // The device and the packages hold the scenes now; the third copy is dropped.
    drop(scenes);
    let device_name = engine.device_name();
    let (port, browsers) = args.serving.viewer.share(listener);
    let mut cluster = Cluster::start(
        |config| args.limits.within(memory / nodes, config),
        port,
        args.serving.config(),
        offers,
        engine.opener(),
        nodes,
    )
    .await?;
    print_line!("{nodes} nodes on {device_name}, at {}", cluster.address);
    let shutdown = StopSignals::listen()?.first;
    let mut visits = args.serving.viewer.serve(browsers, &cluster.address, shutdown.clone());
    tokio::select! {
        () = shutdown.cancelled() => (),
        failed = cluster.failed() => failed?,
    }
    print_line!("draining");
    // Visits end before the cluster that makes their pictures.
    shutdown.cancel();
    while visits.join_next().await.is_some() {}
    cluster.drain().await?;
    Ok(Outcome::Done)
}
