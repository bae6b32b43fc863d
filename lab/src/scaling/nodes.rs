//! The nodes of a measurement, each with an equal share of the machine.

use std::path::Path;
use std::time::Duration;

use anyhow::Context as _;
use app_core::setup::SceneArgs;
use client::Client;
use cluster::{Costs, MeasureCosts};
use gpu::DevicePreference;
use wire::rpc::{NodeClient, connect};

use crate::cpu_share::CpuGroup;
use crate::processes::{Processes, Setting, Share};

/// The longest wait for the coordinator to miss a killed node.
const LEAVE: Duration = Duration::from_secs(30);
const LOOK_AGAIN: Duration = Duration::from_millis(20);
/// Nodes are at rest when none uses more than this share of a core between two readings.
const AT_REST: f64 = 0.01;
const REST_LOOK: Duration = Duration::from_millis(250);
const REST: Duration = Duration::from_secs(120);

/// A cluster whose nodes are limited, timed and ended.
pub struct Nodes {
    pub client: Client,
    pub quota_cores: f64,
    processes: Processes,
}

impl Nodes {
    /// Starts all processes without a limit, and waits until all nodes have joined. The schedule's events are written
    /// to `event_log`, for `myriorama replay`.
    ///
    /// # Errors
    /// Processes or control groups are not to be had.
    pub async fn start(
        scene: &SceneArgs,
        device: DevicePreference,
        nodes: usize,
        event_log: &Path,
    ) -> anyhow::Result<Self> {
        // Sessions state everything else that the coordinator offers.
        let coordinator =
            ["--scene", &scene.scene.to_string(), "--record", &event_log.display().to_string()].map(str::to_owned);
        let setting = Setting { coordinator: coordinator.into(), device, nodes, share: Share::Group };
        let processes = Processes::start(&setting).await?;
        let client = Client::connect(&processes.address).await.context("the coordinator does not answer")?;
        Ok(Self { client, quota_cores: f64::INFINITY, processes })
    }

    /// The number of nodes, P.
    pub fn count(&self) -> usize {
        self.processes.nodes.len()
    }

    /// The name of the nodes' device.
    pub fn device(&self) -> &str {
        &self.processes.device
    }

    fn groups(&self) -> impl Iterator<Item = &CpuGroup> {
        self.processes.nodes.iter().filter_map(|node| node.group.as_ref())
    }

    /// Limits every node to a number of cores.
    pub fn limit(&mut self, cores: f64) -> anyhow::Result<()> {
        self.quota_cores = cores;
        Ok(self.groups().try_for_each(|group| group.limit(cores))?)
    }

    /// Lets nodes time their work at the same time, each with its own request.
    pub async fn measure(&self, requests: impl IntoIterator<Item = MeasureCosts>) -> anyhow::Result<Vec<Costs>> {
        let measuring = self.processes.nodes.iter().zip(requests).map(|(node, request)| {
            let address = node.address.clone();
            tokio::spawn(async move { NodeClient::new(connect(&address).await?).measure_costs(request).await })
        });
        let mut all = Vec::new();
        for (node, measuring) in measuring.collect::<Vec<_>>().into_iter().enumerate() {
            all.push(measuring.await?.with_context(|| format!("node {node} could not measure its costs"))?.costs);
        }
        Ok(all)
    }

    /// Lets one node time its work.
    pub async fn measure_on(&self, node: usize, request: MeasureCosts) -> anyhow::Result<Costs> {
        let client = NodeClient::new(connect(&self.processes.nodes[node].address).await?);
        Ok(client.measure_costs(request).await?.costs)
    }

    /// Ends the last nodes, so that `nodes` are left, and waits until the coordinator misses them.
    ///
    /// # Errors
    /// The coordinator does not answer, or does not notice.
    pub async fn shrink_to(&mut self, nodes: usize) -> anyhow::Result<()> {
        self.processes.nodes.truncate(nodes);
        let end = tokio::time::Instant::now() + LEAVE;
        while self.client.status().await?.nodes.len() > nodes {
            anyhow::ensure!(tokio::time::Instant::now() < end, "the coordinator does not miss nodes that have ended");
            tokio::time::sleep(LOOK_AGAIN).await;
        }
        Ok(())
    }

    /// The processor time that each node has used.
    pub fn used_s(&self) -> anyhow::Result<Vec<f64>> {
        Ok(self.groups().map(CpuGroup::used_s).collect::<Result<_, _>>()?)
    }

    /// Waits until all nodes are at rest: batches that nobody waits for are made to their end.
    ///
    /// # Errors
    /// As [`Nodes::used_s`].
    pub async fn rest(&self) -> anyhow::Result<()> {
        let end = tokio::time::Instant::now() + REST;
        let mut before_s = self.used_s()?;
        while tokio::time::Instant::now() < end {
            tokio::time::sleep(REST_LOOK).await;
            let now_s = self.used_s()?;
            let most_s = now_s.iter().zip(&before_s).map(|(now_s, before_s)| now_s - before_s).fold(0.0, f64::max);
            if most_s < AT_REST * REST_LOOK.as_secs_f64() {
                return Ok(());
            }
            before_s = now_s;
        }
        Ok(())
    }
}
