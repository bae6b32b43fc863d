//! A coordinator and nodes, each as a process.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::Context as _;
use client::Client;
use gpu::DevicePreference;

use crate::cpu_share::{CpuGroup, Hierarchy};
use crate::memory::memory_mib;
use crate::process::{Process, http_page};

/// The longest wait for nodes to join.
const JOIN: Duration = Duration::from_secs(60);

/// Arguments of a cluster.
#[derive(Debug, Clone)]
pub struct Setting {
    /// The scene, as arguments of `myriorama coordinator`.
    pub scene: Vec<String>,
    pub device: DevicePreference,
    pub nodes: usize,
    /// Cores of each node; `None` sets no limit.
    pub share_cores: Option<f64>,
}

/// One node.
#[derive(Debug)]
struct Member {
    process: Process,
    metrics: String,
    /// The group is dropped last: it cannot be removed before its process has ended.
    _group: Option<CpuGroup>,
}

/// A coordinator and its nodes. Nodes end first: they need not miss their coordinator.
#[derive(Debug)]
pub struct Processes {
    /// The address of the coordinator, as `http://host:port`.
    pub address: String,
    pub device: String,
    nodes: Vec<Member>,
    coordinator: Process,
}

impl Processes {
    /// Starts a cluster and waits until its nodes have joined.
    ///
    /// # Errors
    /// A process does not start or serve.
    pub async fn start(setting: &Setting) -> anyhow::Result<Self> {
        let mut coordinator = Process::coordinator(&setting.scene)?;
        let address = coordinator.address()?;
        let member = |number| Member::start(setting, &address, number);
        let nodes = (0..setting.nodes).map(member).collect::<anyhow::Result<Vec<_>>>()?;
        let status = Client::connect(&address).await?.wait_for_nodes(setting.nodes, JOIN).await?;
        let device = status.nodes.first().map_or_else(String::new, |node| node.device_name.clone());
        Ok(Self { address, device, nodes, coordinator })
    }

    /// Memory of each process in MiB: the coordinator, then the nodes.
    #[must_use]
    pub fn memory_mib(&self) -> Vec<(String, f64)> {
        let of = |process: &Process| memory_mib(&process.id().to_string()).unwrap_or(f64::NAN);
        let all = [&self.coordinator].into_iter().chain(self.nodes.iter().map(|node| &node.process));
        all.map(|process| (process.name().to_owned(), of(process))).collect()
    }

    /// Kills a node as `kill -9` does.
    pub fn kill(&mut self, node_name: &str) {
        self.nodes.retain(|node| node.process.name() != node_name);
    }

    /// Views that all nodes dropped, by reason.
    ///
    /// # Errors
    /// The metrics of a node cannot be read.
    pub async fn dropped(&self) -> anyhow::Result<BTreeMap<String, u64>> {
        let mut dropped = BTreeMap::new();
        for node in &self.nodes {
            for (reason, count) in dropped_in(&http_page(&node.metrics).await?) {
                *dropped.entry(reason).or_insert(0) += count;
            }
        }
        Ok(dropped)
    }
}

impl Member {
    fn start(setting: &Setting, coordinator: &str, number: usize) -> anyhow::Result<Self> {
        let mut process = Process::node(number, coordinator, setting.device)?;
        let (_, metrics) = (process.address()?, process.address()?);
        let limit = |cores| limited(&process, cores);
        let group = setting.share_cores.map(limit).transpose()?;
        Ok(Self { process, metrics, _group: group })
    }
}

/// Limits a node: nodes that share a machine would otherwise each promise all of it.
fn limited(process: &Process, cores: f64) -> anyhow::Result<CpuGroup> {
    let group = CpuGroup::new(&Hierarchy::find()?, &format!("myriorama-{}-{}", std::process::id(), process.name()))?;
    group.limit(Some(cores))?;
    group.admit(process.id()).context("a node cannot be given its share")?;
    Ok(group)
}

fn dropped_in(page: &str) -> Vec<(String, u64)> {
    let reason = |line: &str| {
        let rest = line.strip_prefix("myriorama_dropped_views_total{reason=\"")?;
        let (reason, count) = rest.split_once("\"} ")?;
        Some((reason.to_owned(), count.trim().parse().ok()?))
    };
    page.lines().filter_map(reason).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drops_are_read_by_reason() {
        let page = "# TYPE x\nmyriorama_dropped_views_total{reason=\"newer pose\"} 12\nmyriorama_views_total 4\n\
                    myriorama_dropped_views_total{reason=\"client gone\"} 1\n";
        assert_eq!(dropped_in(page), [("newer pose".to_owned(), 12), ("client gone".to_owned(), 1)]);
    }
}
