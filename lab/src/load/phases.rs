//! Loads, each on a cluster of its own.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use super::clients::{Clients, Outcome, Tour, Wanted, follow};
use crate::memory::memory_mib;
use crate::processes::{Processes, Setting};

/// The number of idle clients.
const IDLE: usize = 200;
/// The wait before the memory of idle clients is read.
const REST: Duration = Duration::from_secs(3);
/// The time between two readings of memory.
const MEMORY_INTERVAL: Duration = Duration::from_secs(1);

/// Results of one load.
#[derive(Debug, Clone)]
pub struct Load {
    pub name: String,
    pub clients: Clients,
    pub outcomes: Vec<Outcome>,
    /// Views that nodes dropped, by reason.
    pub dropped: BTreeMap<String, u64>,
    /// Memory of each process, clients last: seconds since the start, and MiB.
    pub memory: Vec<(String, Vec<(f64, f64)>)>,
}

/// Memory that idle clients take.
#[derive(Debug, Clone)]
pub struct Idle {
    pub clients: usize,
    /// Memory of each process, clients last: MiB before, and with all clients.
    pub memory: Vec<(String, f64, f64)>,
}

/// Results of all loads.
#[derive(Debug, Clone)]
pub struct Phases {
    pub device: String,
    /// Loads with few enough clients for all, with too many, and with far too many.
    pub loads: Vec<Load>,
    pub idle: Idle,
}

/// Runs one load after the other, each for `lasting`.
///
/// # Errors
/// A process does not start, or a client fails other than by refusal.
pub async fn run(
    setting: &Setting,
    wanted: &Wanted,
    lasting: Duration,
    progress: &ProgressBar,
) -> anyhow::Result<Phases> {
    let mut device = String::new();
    let mut loads = Vec::new();
    for (clients, rate_hz) in [(8, 10.0), (16, 15.0), (80, 10.0)] {
        let rate_hz = wanted.rate_hz.unwrap_or(rate_hz);
        progress.set_message(format!("{clients} clients, {rate_hz} frames a second"));
        let clients = Clients { count: clients, rate_hz, lasting };
        let (load, named) = load(setting, wanted, clients).await?;
        loads.push(load);
        device = named;
        progress.inc(1);
    }
    progress.set_message(format!("{IDLE} idle clients"));
    let idle = idle(setting, wanted).await?;
    progress.inc(1);
    Ok(Phases { device, loads, idle })
}

async fn load(setting: &Setting, wanted: &Wanted, clients: Clients) -> anyhow::Result<(Load, String)> {
    let processes = Processes::start(setting).await?;
    let tour = Tour::of(&processes.address, wanted, clients.rate_hz).await?;
    drop(tour.warm().await?);
    let start = Instant::now();
    let mut memory = Memory::default();
    let mut following = Box::pin(follow(&tour, &clients));
    let outcomes = loop {
        memory.read(&processes, start.elapsed().as_secs_f64());
        tokio::select! {
            outcomes = &mut following => break outcomes?,
            () = tokio::time::sleep(MEMORY_INTERVAL) => (),
        }
    };
    drop(following);
    let dropped = processes.dropped().await?;
    let name = format!("{} × {}", clients.count, clients.rate_hz);
    Ok((Load { name, clients, outcomes, dropped, memory: memory.0 }, processes.device.clone()))
}

async fn idle(setting: &Setting, wanted: &Wanted) -> anyhow::Result<Idle> {
    let processes = Processes::start(setting).await?;
    let tour = Tour::of(&processes.address, wanted, 0.0).await?;
    let first = tour.warm().await?;
    tokio::time::sleep(REST).await;
    let mut before = Memory::default();
    before.read(&processes, 0.0);
    let mut clients = Vec::with_capacity(IDLE);
    for _ in 0..IDLE {
        clients.push(tour.idle().await?);
    }
    tokio::time::sleep(REST).await;
    let mut after = Memory::default();
    after.read(&processes, 0.0);
    drop((first, clients));
    let both = before.0.into_iter().zip(after.0);
    let memory = both.map(|((name, before), (_, after))| (name, before[0].1, after[0].1)).collect();
    Ok(Idle { clients: IDLE, memory })
}

/// Memory of each process, clients last.
#[derive(Default)]
struct Memory(Vec<(String, Vec<(f64, f64)>)>);

impl Memory {
    fn read(&mut self, processes: &Processes, at_s: f64) {
        let mut now = processes.memory_mib();
        now.push(("clients".to_owned(), memory_mib("self").unwrap_or(f64::NAN)));
        if self.0.is_empty() {
            self.0 = now.iter().map(|(name, _)| (name.clone(), Vec::new())).collect();
        }
        for ((_, all), (_, mib)) in self.0.iter_mut().zip(now) {
            all.push((at_s, mib));
        }
    }
}
