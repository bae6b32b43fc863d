//! A scene, a cluster in this process, and a client of it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use client::{Client, Frame};
use cluster::{SessionPlan, SessionRequest};
use coordinator::CoordinatorConfig;
use depth_image::{PinholeCamera, SampleCamera, ViewCell};
use engine::GpuEngine;
use glam::UVec2;
use gpu::DevicePreference;
use node::{NodeConfig, most_image_bytes, most_set_bytes};
use tokio::runtime::Runtime;

use crate::addresses::listen;
use crate::cluster::Cluster;
use crate::delivery::{open, receive};
use crate::process::runtime;
use crate::setup::{SceneArgs, Setup};

/// The number of views V of the paper's headline: 290 views of 200×150.
pub const PAPER_VIEWS: usize = 290;
/// The size of every view, unless cameras are given.
pub const VIEW_SIZE_PX: UVec2 = UVec2::new(200, 150);

/// Delivered views.
#[derive(Debug)]
pub struct Delivered {
    /// The coordinator's plan, and the costs that it measured.
    pub plan: SessionPlan,
    /// Seconds from the request to the last frame, decoded and checksummed.
    pub seconds: f64,
}

/// The longest time until the coordinator has heard of the end of a session, and between two looks.
const LONGEST_CLOSING: Duration = Duration::from_secs(10);
const LOOK_AGAIN: Duration = Duration::from_millis(2);

/// Half of a node's memory is for sets on the device, with the images that are relayed. There is room for one set in use and one
/// to come: every run has sets of its own, and none needs them again.
fn set_memory_bytes(setup: &Setup) -> usize {
    let illumination = &setup.scene.illumination;
    let cameras: Vec<_> = setup.samples.iter().copied().map(SampleCamera::from).collect();
    2 * (most_set_bytes(illumination, &cameras) + most_image_bytes(illumination, &cameras))
}

/// A cluster that runs until it is stopped.
pub struct Experiment {
    /// The device of all nodes.
    pub engine: Arc<GpuEngine>,
    /// The scene and its sample cameras.
    pub setup: Setup,
    /// The arguments that `setup` was loaded from.
    pub args: SceneArgs,
    runtime: Runtime,
    cluster: Cluster,
    client: Client,
}

impl Experiment {
    /// Starts `nodes` nodes, which share a device.
    ///
    /// # Errors
    /// The scene is not sampled by depth images, or a device or port is not to be had.
    pub fn start(args: SceneArgs, setup: Setup, device: DevicePreference, nodes: usize) -> anyhow::Result<Self> {
        setup.check_depth_images()?;
        let engine = GpuEngine::shared(device)?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        let runtime = runtime()?;
        let (cluster, client) = runtime.block_on(async {
            let listener = listen(([127, 0, 0, 1], 0).into(), false).await?;
            let cluster = Cluster::start(
                |config| NodeConfig { set_memory_bytes: set_memory_bytes(&setup), ..config },
                listener,
                CoordinatorConfig::default(),
                setup.offer.clone().into(),
                engine.clone().opener(),
                nodes,
            )
            .await?;
            let client = cluster.client().await?;
            anyhow::Ok((cluster, client))
        })?;
        Ok(Self { engine, setup, args, runtime, cluster, client })
    }

    /// `count` views, spread between the sample cameras.
    ///
    /// # Errors
    /// There are no sample cameras.
    pub fn views(&self, count: usize) -> anyhow::Result<Vec<PinholeCamera>> {
        let cell = ViewCell::between(&self.setup.around).context("no sample cameras")?;
        Ok(cell.spread(count, VIEW_SIZE_PX))
    }

    /// Delivers views as a request says. The time excludes the coordinator's measurements.
    ///
    /// # Errors
    /// The coordinator refuses the request, or the cluster fails.
    pub fn receive(
        &self,
        request: SessionRequest,
        views: &[PinholeCamera],
        mut arrived: impl FnMut(Frame),
    ) -> anyhow::Result<Delivered> {
        self.runtime.block_on(async {
            let session = open(&self.client, request).await?;
            let received = async |frame| {
                arrived(frame);
                Ok(())
            };
            let seconds = receive(&session, views, received).await?;
            let plan = session.plan();
            drop(session);
            self.wait_for_ended_sessions().await?;
            Ok(Delivered { plan, seconds })
        })
    }

    /// Waits until the coordinator has heard that sessions have ended: the next one may have the same samples and another policy.
    async fn wait_for_ended_sessions(&self) -> anyhow::Result<()> {
        let end = Instant::now() + LONGEST_CLOSING;
        while !self.client.status().await?.workloads.is_empty() {
            anyhow::ensure!(Instant::now() < end, "the coordinator does not hear that a session has ended");
            tokio::time::sleep(LOOK_AGAIN).await;
        }
        Ok(())
    }

    /// Drains the cluster.
    ///
    /// # Errors
    /// A server failed.
    pub fn stop(self) -> anyhow::Result<()> {
        drop(self.client);
        self.runtime.block_on(self.cluster.drain())
    }
}
