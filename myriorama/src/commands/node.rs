//! `myriorama node`: samples and composites by the coordinator's plan.

use std::net::SocketAddr;
use std::path::PathBuf;

use app_core::addresses::{CoordinatorArgs, InsecureArgs, MetricsArgs, address_towards, listen, listen_address};
use app_core::exit::Outcome;
use app_core::node_limits::NodeLimitArgs;
use app_core::print_line;
use app_core::process::StopSignals;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::{GpuEngine, LampSampling};
use node::{Engine as _, NodeConfig, NodeMetrics, Telemetry};

/// Joins a coordinator, and samples and composites by its plan. Joins again when the coordinator comes back.
#[derive(Debug, Args)]
pub struct NodeArgs {
    #[command(flatten)]
    coordinator: CoordinatorArgs,
    /// The address to listen on; port 0 takes a free port
    #[arg(long, default_value = "127.0.0.1:0", value_name = "HOST:PORT", value_parser = listen_address)]
    listen: SocketAddr,
    /// A name that is unique in the cluster [default: node-PORT, or the host's name if it listens on all addresses]
    #[arg(long)]
    name: Option<String>,
    /// The address at which others reach the node [default: --listen, or the address towards the coordinator]
    #[arg(long, value_name = "URL")]
    advertise: Option<String>,
    /// A folder of scenes by hash, which is searched before a scene is fetched
    #[arg(long, value_name = "DIR")]
    scene_folder: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    limits: NodeLimitArgs,
    /// How rectangle lights are sampled under "soft NxN by samples": a sampling method, the side of images and shadow maps
    /// (and of the layered cube of "by cube"), and mesh or hybrid_mesh[:PX]
    #[arg(long, value_name = "SAMPLING SIDE METHOD", default_value_t)]
    lamp_samples: LampSampling,
    #[command(flatten)]
    metrics: MetricsArgs,
    #[command(flatten)]
    insecure: InsecureArgs,
}

/// Runs until a signal.
///
/// # Errors
/// There is no device, or the port is taken.
pub async fn run(args: NodeArgs) -> anyhow::Result<Outcome> {
    let coordinator = args.coordinator.coordinator;
    let listener = listen(args.listen, args.insecure.insecure_bind).await?;
    let address = listener.local_addr()?;
    let engine = GpuEngine::shared(args.device.device)?;
    let memory = args.limits.set_memory_bytes(engine.is_software());
    engine.bound_scenes(memory);
    engine.set_lamp_sampling(args.lamp_samples);
    let name = args.name.unwrap_or_else(|| name_of(address));
    let advertise = args.advertise.or_else(|| own_address(&coordinator, address));
    print_line!("{name} on {}, at http://{address}", engine.device_name());
    let config = NodeConfig {
        scene_folder: args.scene_folder,
        advertised_address: advertise,
        insecure_bind: args.insecure.insecure_bind,
        ..args.limits.within(memory, NodeConfig::new(name, coordinator))
    };
    let shutdown = StopSignals::listen()?.first;
    let telemetry = Telemetry::default();
    let metrics = NodeMetrics::new(&telemetry);
    args.metrics.serve(args.insecure, telemetry, shutdown.clone()).await?;
    node_host::serve(listener, config, engine.opener(), metrics, shutdown).await?;
    Ok(Outcome::Done)
}

fn name_of(address: SocketAddr) -> String {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").ok().filter(|_| address.ip().is_unspecified());
    host.map_or_else(|| format!("node-{}", address.port()), |host| host.trim().to_owned())
}

/// The address of the network interface towards the coordinator, for a node that listens on all addresses.
fn own_address(coordinator: &str, address: SocketAddr) -> Option<String> {
    let authority = coordinator.split("://").last()?.split('/').next()?;
    let own = Some(address).filter(|address| address.ip().is_unspecified())?;
    Some(format!("http://{}", address_towards(own, authority)?))
}
