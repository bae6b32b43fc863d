//! `myriorama up`: a whole cluster in one process.

use std::net::SocketAddr;

use app_core::addresses::{InsecureArgs, listen, listen_address};
use app_core::cluster::Cluster;
use app_core::exit::Outcome;
use app_core::memory::MemoryArgs;
use app_core::print_line;
use app_core::process::stop_signal;
use app_core::scenes::ScenesArgs;
use app_core::setup::DeviceArgs;
use app_core::view_limits::ViewLimitArgs;
use clap::Args;
use coordinator::CoordinatorConfig;
use engine::GpuEngine;
use node::{Engine as _, NodeConfig, Quotas};
use tokio_util::sync::CancellationToken;

use crate::budget::BudgetArgs;
use crate::viewer::ViewerArgs;

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
    memory: MemoryArgs,
    #[command(flatten)]
    limits: ViewLimitArgs,
    /// Nodes P that share the device
    #[arg(long, default_value_t = 5, value_name = "P", value_parser = clap::value_parser!(u16).range(1..=256))]
    nodes: u16,
    /// The address that the coordinator listens on
    #[arg(long, default_value = "127.0.0.1:7420", value_name = "HOST:PORT", value_parser = listen_address)]
    listen: SocketAddr,
    #[command(flatten)]
    insecure: InsecureArgs,
    #[command(flatten)]
    budget: BudgetArgs,
    #[command(flatten)]
    viewer: ViewerArgs,
}

/// Runs until a signal.
///
/// # Errors
/// The scene cannot be used, there is no device, or the port is taken.
pub async fn run(args: UpArgs) -> anyhow::Result<Outcome> {
    let (scenes, offers) = args.scenes.load(args.budget.is_given())?;
    args.budget.check(&offers)?;
    let listener = listen(args.listen, args.insecure.insecure_bind).await?;
    let engine = GpuEngine::shared(args.device.device)?;
    let memory = args.memory.set_memory_bytes(engine.is_software());
    let nodes = usize::from(args.nodes);
    engine.bound_scenes(memory);
    for (scene, offer) in scenes.iter().zip(offers.iter()) {
        engine.put_scene(offer.hash.as_str(), scene)?;
        print_line!("{}: {}", offer.name, scene.contents());
    }
    // The device and the packages hold the scenes now; the third copy is dropped.
    drop(scenes);
    let view_bytes = args.memory.view_memory;
    let device_name = engine.device_name();
    let (port, browsers) = args.viewer.share(listener);
    let config = CoordinatorConfig { insecure_bind: args.insecure.insecure_bind, ..CoordinatorConfig::default() };
    let config = args.budget.configure(config);
    let mut cluster = Cluster::start(
        |config| NodeConfig {
            set_memory_bytes: memory / nodes,
            quotas: Quotas { view_bytes, ..config.quotas },
            ..args.limits.within(config)
        },
        port,
        config,
        offers,
        engine.opener(),
        nodes,
    )
    .await?;
    print_line!("{nodes} nodes on {device_name}, at {}", cluster.address);
    let viewer = args.viewer.serve(browsers, &cluster.address, CancellationToken::new());
    tokio::select! {
        stopped = stop_signal() => stopped?,
        failed = cluster.failed() => failed?,
    }
    print_line!("draining");
    if let Some(viewer) = viewer {
        viewer.end().await;
    }
    cluster.drain().await?;
    Ok(Outcome::Done)
}
