//! A coordinator and P nodes as processes, each node with an equal share of the machine.

use std::path::Path;
use std::time::Duration;

use anyhow::Context as _;
use app_core::setup::SceneArgs;
use client::Client;
use cluster::{Costs, MeasureCosts};
use gpu::DevicePreference;
use wire::rpc::{NodeClient, connect};

use super::counters::{Counters, read};
use crate::cpu_share::{CpuGroup, Hierarchy, OwnGroup, Usage};
use crate::process::Process;

/// The longest wait for all nodes to open their device and join.
const JOIN: Duration = Duration::from_secs(300);
/// The longest wait for the coordinator to miss a killed node.
const LEAVE: Duration = Duration::from_secs(30);
const LOOK_AGAIN: Duration = Duration::from_millis(20);
/// Nodes are at rest when none uses more than this share of a core between two readings.
const AT_REST: f64 = 0.01;
const REST_LOOK: Duration = Duration::from_millis(250);
const REST: Duration = Duration::from_secs(120);

/// One node.
struct Member {
    address: String,
    metrics: String,
    // Fields are dropped in this order: a group cannot be removed before its process has ended.
    _process: Process,
    group: CpuGroup,
}

/// Processes of a cluster, which end when this is dropped.
pub struct NodeProcesses {
    pub client: Client,
    members: Vec<Member>,
    _coordinator: Process,
    _own: OwnGroup,
    quota_cores: Option<f64>,
}

impl NodeProcesses {
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
        let hierarchy = Hierarchy::find()?;
        let own = OwnGroup::new(&hierarchy, &format!("myriorama-{}", std::process::id()))?;
        let mut coordinator = Process::coordinator(&coordinator_arguments(scene, event_log))?;
        own.admit(coordinator.id())?;
        let url = coordinator.address()?;
        let mut started = Vec::new();
        for number in 0..nodes {
            let group = CpuGroup::new(&hierarchy, &format!("myriorama-{}-{number:03}", std::process::id()))?;
            let process = Process::node(number, &url, device)?;
            group.prioritize()?;
            group.admit(process.id())?;
            started.push((process, group));
        }
        let serving = |(mut process, group): (Process, CpuGroup)| {
            let (address, metrics) = (process.address()?, process.address()?);
            anyhow::Ok(Member { address, metrics, _process: process, group })
        };
        let members = started.into_iter().map(serving).collect::<anyhow::Result<Vec<_>>>()?;
        let client = Client::connect(&url).await.context("the coordinator does not answer")?;
        client.wait_for_nodes(nodes, JOIN).await?;
        Ok(Self { client, members, _coordinator: coordinator, _own: own, quota_cores: None })
    }

    /// The number of nodes, P.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.members.len()
    }

    /// Limits every node to a number of cores, or to none.
    pub fn limit(&mut self, cores: Option<f64>) -> anyhow::Result<()> {
        self.quota_cores = cores;
        Ok(self.members.iter().try_for_each(|member| member.group.limit(cores))?)
    }

    /// The cores of each node; infinite without a limit.
    #[must_use]
    pub fn quota_cores(&self) -> f64 {
        self.quota_cores.unwrap_or(f64::INFINITY)
    }

    /// Lets nodes time their work at the same time, each with its own request.
    pub async fn measure(&self, requests: impl IntoIterator<Item = MeasureCosts>) -> anyhow::Result<Vec<Costs>> {
        let measuring = self.members.iter().zip(requests).map(|(member, request)| {
            let address = member.address.clone();
            tokio::spawn(async move { NodeClient::new(connect(&address).await?).measure_costs(request).await })
        });
        let mut all = Vec::new();
        for (node, measuring) in measuring.collect::<Vec<_>>().into_iter().enumerate() {
            all.push(measuring.await?.with_context(|| format!("node {node} could not measure its costs"))?.costs);
        }
        Ok(all)
    }

    /// Lets nodes time their work one after the other.
    pub async fn measure_in_turn(&self, request: &MeasureCosts, mut done: impl FnMut()) -> anyhow::Result<Vec<Costs>> {
        let mut all = Vec::new();
        for member in &self.members {
            let client = NodeClient::new(connect(&member.address).await?);
            all.push(client.measure_costs(request.clone()).await?.costs);
            done();
        }
        Ok(all)
    }

    /// Ends the last nodes, so that `nodes` are left, and waits until the coordinator misses them.
    ///
    /// # Errors
    /// The coordinator does not answer, or does not notice.
    pub async fn shrink_to(&mut self, nodes: usize) -> anyhow::Result<()> {
        self.members.truncate(nodes);
        let end = tokio::time::Instant::now() + LEAVE;
        while self.client.status().await?.nodes.len() > nodes {
            anyhow::ensure!(tokio::time::Instant::now() < end, "the coordinator does not miss nodes that have ended");
            tokio::time::sleep(LOOK_AGAIN).await;
        }
        Ok(())
    }

    /// The processor time that every node has used.
    pub fn usage(&self) -> anyhow::Result<Vec<Usage>> {
        Ok(self.members.iter().map(|member| member.group.usage()).collect::<Result<_, _>>()?)
    }

    /// Waits until all nodes are at rest: batches that nobody waits for are made to their end.
    ///
    /// # Errors
    /// As [`NodeProcesses::usage`].
    pub async fn rest(&self) -> anyhow::Result<()> {
        let end = tokio::time::Instant::now() + REST;
        let mut before = self.usage()?;
        while tokio::time::Instant::now() < end {
            tokio::time::sleep(REST_LOOK).await;
            let now = self.usage()?;
            let most_s = now.iter().zip(&before).map(|(now, before)| now.since(before).cpu_s).fold(0.0, f64::max);
            if most_s < AT_REST * REST_LOOK.as_secs_f64() {
                return Ok(());
            }
            before = now;
        }
        Ok(())
    }

    /// Counters of all nodes together.
    ///
    /// # Errors
    /// A node does not answer.
    pub async fn counters(&self) -> anyhow::Result<Counters> {
        let mut sum = Counters::default();
        for member in &self.members {
            sum = sum.plus(&read(&member.metrics).await?);
        }
        Ok(sum)
    }
}

/// Arguments of the coordinator: sessions state everything else that it offers.
fn coordinator_arguments(scene: &SceneArgs, event_log: &Path) -> Vec<String> {
    let (scene, event_log) = (scene.scene.to_string(), event_log.display().to_string());
    ["--scene", &scene, "--record", &event_log].map(str::to_owned).into()
}
