//! A coordinator or a node of the scalar device as a process of its own, for tests that kill and stop processes.
//!
//! It prints where it serves, and ends at SIGTERM or with its input. At SIGUSR1 a node's device is lost.

use std::fs::File;
use std::io::Read as _;
use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, Parser};
use coordinator::schedule::Recorder;
use coordinator::{CoordinatorConfig, CoordinatorMetrics, EventLog, Observers};
use node::{NodeConfig, NodeMetrics, init_logging};
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

use crate::cluster::two_offers;
use crate::scalar_engine::ScalarEngine;

/// Less than a watcher's sets take.
const SET_MEMORY_BYTES: usize = 8 << 20;

#[derive(Parser)]
enum Role {
    Coordinator(CoordinatorArgs),
    Node(NodeArgs),
}

#[derive(Args)]
struct CoordinatorArgs {
    #[arg(long, default_value = "127.0.0.1:0")]
    listen: String,
    #[arg(long)]
    record: Option<PathBuf>,
}

#[derive(Args)]
struct NodeArgs {
    #[arg(long)]
    name: String,
    #[arg(long)]
    coordinator: String,
    #[arg(long, default_value = "127.0.0.1:0")]
    listen: String,
    #[arg(long)]
    advertise: Option<String>,
}

/// The whole program.
///
/// # Errors
/// It cannot serve.
pub async fn run() -> anyhow::Result<()> {
    init_logging("error");
    let shutdown = CancellationToken::new();
    end_with_input(shutdown.clone());
    end_at_signal(shutdown.clone())?;
    match Role::parse() {
        Role::Coordinator(args) => coordinate(args, shutdown).await,
        Role::Node(args) => host(args, shutdown).await,
    }
}

fn end_with_input(shutdown: CancellationToken) {
    std::thread::spawn(move || {
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        shutdown.cancel();
    });
}

fn end_at_signal(shutdown: CancellationToken) -> anyhow::Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::spawn(async move {
        terminate.recv().await;
        shutdown.cancel();
    });
    Ok(())
}

async fn listen(address: &str) -> anyhow::Result<TcpListener> {
    let listener = TcpListener::bind(address).await?;
    println!("http://{}", listener.local_addr()?);
    Ok(listener)
}

async fn coordinate(args: CoordinatorArgs, shutdown: CancellationToken) -> anyhow::Result<()> {
    let log = args.record.map(event_log).transpose()?;
    let observers = Observers { metrics: CoordinatorMetrics::default(), log };
    let listener = listen(&args.listen).await?;
    Ok(coordinator::serve(listener, CoordinatorConfig::default(), two_offers(), observers, shutdown).await?)
}

fn event_log(path: PathBuf) -> std::io::Result<EventLog> {
    Recorder::new(Box::new(File::create(path)?))
}

async fn host(args: NodeArgs, shutdown: CancellationToken) -> anyhow::Result<()> {
    let engine = ScalarEngine::default();
    let listener = listen(&args.listen).await?;
    let mut lose = signal(SignalKind::user_defined1())?;
    let device = engine.clone();
    tokio::spawn(async move {
        lose.recv().await;
        device.lose();
    });
    let config = NodeConfig {
        advertised_address: args.advertise,
        set_memory_bytes: SET_MEMORY_BYTES,
        ..NodeConfig::new(args.name, args.coordinator)
    };
    let open = Arc::new(move || Ok(Arc::new(engine.opened()) as _));
    Ok(node_host::serve(listener, config, open, NodeMetrics::default(), shutdown).await?)
}
