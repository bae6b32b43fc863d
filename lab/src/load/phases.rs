//! The loads, each on a cluster that was started for it.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use glam::UVec2;
use indicatif::ProgressBar;

use super::crowd::{Crowd, Outcome, Tour, follow};
use super::processes::{Processes, Setting, memory_mib};

/// Of every frame.
const SIZE_PX: UVec2 = UVec2::new(320, 180);
/// Clients that do nothing.
const IDLE: usize = 200;
/// Until idle clients' memory is looked at.
const REST: Duration = Duration::from_secs(3);
/// Between two looks at the processes' memory.
const LOOK: Duration = Duration::from_secs(1);

/// What a crowd got.
#[derive(Debug, Clone)]
pub struct Load {
    /// As it is called in tables.
    pub name: String,
    /// Who asked for what.
    pub crowd: Crowd,
    /// What became of each client.
    pub outcomes: Vec<Outcome>,
    /// Views that nodes dropped, by reason.
    pub dropped: BTreeMap<String, u64>,
    /// Of each process, clients last: seconds since the start, and MiB.
    pub memory: Vec<(String, Vec<(f64, f64)>)>,
}

/// What idle clients cost.
#[derive(Debug, Clone)]
pub struct Idle {
    /// How many.
    pub clients: usize,
    /// Of each process, clients last: MiB before, and with all of them.
    pub memory: Vec<(String, f64, f64)>,
}

/// All of it.
#[derive(Debug, Clone)]
pub struct Phases {
    /// As the nodes name it.
    pub device: String,
    /// Few enough clients for all to be served; too many; far too many.
    pub loads: Vec<Load>,
    /// 200 that do nothing.
    pub idle: Idle,
}

/// One load after the other, each for so long.
///
/// # Errors
/// Where processes do not start, or a client fails but by being refused.
pub async fn run(setting: &Setting, lasting: Duration, progress: &ProgressBar) -> anyhow::Result<Phases> {
    let mut device = String::new();
    let mut loads = Vec::new();
    for (clients, rate_hz) in [(8, 10.0), (16, 15.0), (80, 10.0)] {
        progress.set_message(format!("{clients} clients, {rate_hz} frames a second"));
        let crowd = Crowd { clients, rate_hz, size_px: SIZE_PX, lasting };
        let (load, named) = load(setting, crowd).await?;
        loads.push(load);
        device = named;
        progress.inc(1);
    }
    progress.set_message(format!("{IDLE} clients that do nothing"));
    let idle = idle(setting).await?;
    progress.inc(1);
    Ok(Phases { device, loads, idle })
}

async fn load(setting: &Setting, crowd: Crowd) -> anyhow::Result<(Load, String)> {
    let processes = Processes::start(setting).await?;
    let tour = Tour::of(&processes.address, crowd.size_px, crowd.rate_hz).await?;
    drop(tour.warm().await?);
    let (start, mut memory) = (Instant::now(), Memory::default());
    let mut following = Box::pin(follow(&tour, &crowd));
    let outcomes = loop {
        memory.look(&processes, start.elapsed().as_secs_f64());
        tokio::select! {
            outcomes = &mut following => break outcomes?,
            () = tokio::time::sleep(LOOK) => (),
        }
    };
    drop(following);
    let dropped = processes.dropped().await?;
    let name = format!("{} × {}", crowd.clients, crowd.rate_hz);
    Ok((Load { name, crowd, outcomes, dropped, memory: memory.0 }, processes.device.clone()))
}

async fn idle(setting: &Setting) -> anyhow::Result<Idle> {
    let processes = Processes::start(setting).await?;
    let tour = Tour::of(&processes.address, SIZE_PX, 0.0).await?;
    let first = tour.warm().await?;
    tokio::time::sleep(REST).await;
    let mut before = Memory::default();
    before.look(&processes, 0.0);
    let mut clients = Vec::with_capacity(IDLE);
    for _ in 0..IDLE {
        clients.push(tour.idle().await?);
    }
    tokio::time::sleep(REST).await;
    let mut after = Memory::default();
    after.look(&processes, 0.0);
    drop((first, clients));
    let both = before.0.into_iter().zip(after.0);
    let memory = both.map(|((name, before), (_, after))| (name, before[0].1, after[0].1)).collect();
    Ok(Idle { clients: IDLE, memory })
}

/// Of each process, clients last.
#[derive(Default)]
struct Memory(Vec<(String, Vec<(f64, f64)>)>);

impl Memory {
    fn look(&mut self, processes: &Processes, at_s: f64) {
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
