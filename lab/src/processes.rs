//! A coordinator and nodes, each as a process of its own.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::Context as _;
use client::Client;
use cluster::OfferStatus;
use depth_image::{PinholeCamera, ViewCell};
use glam::UVec2;
use gpu::DevicePreference;

use crate::cpu_share::{CpuGroup, Hierarchy};
use crate::memory::memory_mib;
use crate::process::{Process, http_page};

/// The longest wait for all nodes to open their device and join.
const JOIN: Duration = Duration::from_secs(300);

/// Arguments of a cluster.
#[derive(Debug, Clone)]
pub struct Setting {
    /// Arguments of `myriorama coordinator`.
    pub coordinator: Vec<String>,
    pub device: DevicePreference,
    pub nodes: usize,
    pub share: Share,
}

/// The processors of each node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Share {
    /// All of the machine.
    Whole,
    /// All of the machine, in a control group, which may be limited later.
    Group,
    /// A number of cores, by a control group: nodes that share a machine would otherwise each promise all of it.
    Cores(f64),
}

/// One node.
#[derive(Debug)]
pub struct Member {
    /// The address at which it serves the cluster.
    pub address: String,
    process: Process,
    metrics: String,
    /// The group is dropped last: it cannot be removed before its process has ended.
    pub group: Option<CpuGroup>,
}

/// A coordinator and its nodes. Nodes end first: they need not miss their coordinator.
#[derive(Debug)]
pub struct Processes {
    /// The address of the coordinator, as `http://host:port`.
    pub address: String,
    pub device: String,
    pub nodes: Vec<Member>,
    coordinator: Process,
}

impl Processes {
    /// Starts a cluster and waits until its nodes have joined.
    ///
    /// # Errors
    /// A process does not start or serve, or there are no control groups.
    pub async fn start(setting: &Setting) -> anyhow::Result<Self> {
        let mut coordinator = Process::coordinator(&setting.coordinator)?;
        let address = coordinator.address()?;
        let started = (0..setting.nodes).map(|number| Process::node(number, &address, setting.device));
        // All start before the first is waited for.
        let started = started.collect::<anyhow::Result<Vec<_>>>()?;
        let members = started.into_iter().map(|process| Member::new(process, setting.share));
        let nodes = members.collect::<anyhow::Result<Vec<_>>>()?;
        let status = Client::connect(&address).await?.wait_for_nodes(setting.nodes, JOIN).await?;
        let device = status.nodes.first().map_or_else(String::new, |node| node.device_name.clone());
        Ok(Self { address, device, nodes, coordinator })
    }

    /// Memory of each process in MiB: the coordinator, then the nodes.
    pub fn memory_mib(&self) -> Vec<(String, f64)> {
        let all = [&self.coordinator].into_iter().chain(self.nodes.iter().map(|node| &node.process));
        let memory =
            all.map(|process| (process.name().to_owned(), memory_mib(&process.id().to_string()).unwrap_or(f64::NAN)));
        memory.collect()
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
    fn new(mut process: Process, share: Share) -> anyhow::Result<Self> {
        let address = process.address()?;
        let metrics = process.address()?;
        let group = match share {
            Share::Whole => None,
            Share::Group | Share::Cores(_) => Some(group_of(&process)?),
        };
        if let (Some(group), Share::Cores(cores)) = (&group, share) {
            group.limit(cores)?;
        }
        Ok(Self { address, process, metrics, group })
    }
}

/// Views between the sample cameras of a scene on offer.
///
/// # Errors
/// There are no sample cameras.
pub fn orbit(offer: &OfferStatus, count: usize, size_px: UVec2) -> anyhow::Result<Vec<PinholeCamera>> {
    let samples: Vec<_> = offer.sample_cameras.iter().map(|camera| *camera.reference()).collect();
    Ok(ViewCell::between(&samples).context("no sample cameras")?.orbit(count, size_px))
}

/// A control group with a process in it.
fn group_of(process: &Process) -> anyhow::Result<CpuGroup> {
    let group = CpuGroup::new(&Hierarchy::find()?, &format!("myriorama-{}-{}", std::process::id(), process.name()))?;
    group.admit(process.id())?;
    Ok(group)
}

fn dropped_in(page: &str) -> Vec<(String, u64)> {
    let dropped = page.lines().filter_map(|line| {
        let rest = line.strip_prefix("myriorama_dropped_views_total{reason=\"")?;
        let (reason, count) = rest.split_once("\"} ")?;
        Some((reason.to_owned(), count.trim().parse().ok()?))
    });
    dropped.collect()
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
