//! `myriorama coordinator`: plans for nodes that join it, and serves them the scene.

use std::fs::File;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use app_core::addresses::{MetricsArgs, listen, listen_address, loopback_of};
use app_core::exit::Outcome;
use app_core::print_line;
use app_core::process::StopSignals;
use app_core::scenes::ScenesArgs;
use clap::Args;
use coordinator::schedule::Recorder;
use coordinator::{CoordinatorConfig, CoordinatorMetrics, EventLog, Observers};
use node::Telemetry;

use crate::serving::ServingArgs;

/// Serves a scene and plans the work of the nodes that join. A coordinator draws nothing and needs no device.
#[derive(Debug, Args)]
pub struct CoordinatorArgs {
    #[command(flatten)]
    scenes: ScenesArgs,
    /// The address to listen on
    #[arg(long, default_value = "127.0.0.1:7420", value_name = "HOST:PORT", value_parser = listen_address)]
    listen: SocketAddr,
    #[command(flatten)]
    metrics: MetricsArgs,
    /// Records the schedule's events to a file, for `myriorama replay`
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// The most open workloads; sessions of further ones are refused. Sessions of one scene, lighting, sampling and
    /// timeline share a workload
    #[arg(long, value_name = "N", default_value_t = CoordinatorConfig::default().max_workloads,
        value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=64))]
    max_workloads: usize,
    #[command(flatten)]
    serving: ServingArgs,
}

/// Runs until a signal.
///
/// # Errors
/// The scene cannot be used, or the port is taken.
pub async fn run(args: CoordinatorArgs) -> anyhow::Result<Outcome> {
    let ServingArgs { insecure, viewer, .. } = &args.serving;
    let (scenes, offers) = args.serving.load(&args.scenes)?;
    let listener = listen(args.listen, insecure.insecure_bind).await?;
    let address = listener.local_addr()?;
    for (scene, offer) in scenes.iter().zip(offers.iter()) {
        print_line!("{}: {}, offered at http://{address}", offer.name, scene.contents());
    }
    drop(scenes);
    let shutdown = StopSignals::listen()?.first;
    let config = CoordinatorConfig { max_workloads: args.max_workloads, ..args.serving.config() };
    let log = args.record.as_deref().map(event_log).transpose()?;
    let telemetry = Telemetry::default();
    let metrics = CoordinatorMetrics::new(&telemetry);
    args.metrics.serve(*insecure, telemetry, shutdown.clone()).await?;
    let own_address = format!("http://{}", loopback_of(&listener)?);
    let (port, browsers) = viewer.share(listener);
    let mut visits = viewer.serve(browsers, &own_address, shutdown.clone());
    coordinator::serve(port, config, offers, Observers { metrics, log }, shutdown.clone()).await?;
    shutdown.cancel();
    while visits.join_next().await.is_some() {}
    Ok(Outcome::Done)
}

fn event_log(path: &Path) -> anyhow::Result<EventLog> {
    let log = File::create(path).and_then(|file| Recorder::new(Box::new(file) as Box<dyn std::io::Write + Send>));
    log.with_context(|| format!("cannot write {}", path.display()))
}
