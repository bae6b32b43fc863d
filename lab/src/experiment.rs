//! A scene, a cluster in this process and a client of it: what demo and bench measure on.

use std::cell::Cell;
use std::sync::Arc;

use anyhow::Context as _;
use app_core::cluster::Cluster;
use app_core::delivery::{Delivered, Wishes, open, receive};
use app_core::process::{listen, runtime};
use app_core::setup::{SceneArgs, Setup};
use client::{Client, Frame};
use cluster::{PolicyChoice, Timeline};
use depth_image::{PinholeCamera, ViewCell};
use engine::GpuEngine;
use glam::UVec2;
use gpu::DevicePreference;
use reconstruction::ReconstructionMethod;
use render::{Choice, Lighting};
use tokio::runtime::Runtime;

/// V of the paper's headline: 290 views of 200×150.
pub const PAPER_VIEWS: usize = 290;
/// Of every view, unless cameras were given.
pub const VIEW_SIZE_PX: UVec2 = UVec2::new(200, 150);
/// Scene time between runs: far less than any motion, but another sample set, which no node has kept.
const RUN_STEP_S: f64 = 1e-4;

/// What is asked of the cluster.
#[derive(Debug, Clone, Copy)]
pub struct Wish {
    /// How surfaces are lit.
    pub lighting: Lighting,
    /// Who makes the views.
    pub policy: PolicyChoice,
    /// How they are reconstructed.
    pub method: ReconstructionMethod,
    /// V.
    pub views: usize,
    /// Sample sets of one moment, each with all views.
    pub sets: u32,
}

/// Runs until it is stopped.
pub struct Experiment {
    /// The device.
    pub engine: Arc<GpuEngine>,
    /// The scene.
    pub setup: Setup,
    /// How it is sampled and lit.
    pub args: SceneArgs,
    given_views: Vec<PinholeCamera>,
    runtime: Runtime,
    cluster: Cluster,
    client: Client,
    runs: Cell<u32>,
}

impl Experiment {
    /// Loads the scene and starts `nodes` nodes. Views are those given; without any they are spread between the
    /// sample cameras.
    ///
    /// # Errors
    /// Input that cannot be used, or a device or port that cannot be had.
    pub fn start(
        args: SceneArgs,
        given_views: Vec<PinholeCamera>,
        device: DevicePreference,
        nodes: usize,
    ) -> anyhow::Result<Self> {
        let setup = args.load()?;
        let engine = GpuEngine::shared(device)?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        let runtime = runtime()?;
        let (cluster, client) = runtime.block_on(async {
            let listener = listen(([127, 0, 0, 1], 0).into(), false).await?;
            let cluster = Cluster::start(listener, setup.offer.clone(), engine.clone(), nodes, false).await?;
            let client = cluster.client().await?;
            anyhow::Ok((cluster, client))
        })?;
        Ok(Self { engine, setup, args, given_views, runtime, cluster, client, runs: Cell::new(0) })
    }

    /// `count` views: those given, again from the first where there are fewer, or spread between the samples.
    ///
    /// # Errors
    /// Without sample cameras.
    pub fn views(&self, count: usize) -> anyhow::Result<Vec<PinholeCamera>> {
        if !self.given_views.is_empty() {
            return Ok(self.given_views.iter().copied().cycle().take(count).collect());
        }
        let cell = ViewCell::between(&self.setup.around).context("no sample cameras")?;
        Ok(cell.spread(count, VIEW_SIZE_PX))
    }

    /// `views` of one set, everything else as the scene's arguments say.
    #[must_use]
    pub fn wish(&self, policy: PolicyChoice, views: usize) -> Wish {
        Wish { lighting: self.args.lighting, policy, method: self.args.method, views, sets: 1 }
    }

    /// Delivers views of a sample set that nobody has yet. What the coordinator measures before is not in the time.
    ///
    /// # Errors
    /// The cluster's.
    pub fn deliver(&self, wish: Wish, arrived: impl FnMut(&Frame)) -> anyhow::Result<Delivered> {
        let run = self.runs.replace(self.runs.get() + 1);
        let (method, sampling) = (wish.method.to_string(), self.args.sampling.to_string());
        let wishes = Wishes {
            policy: wish.policy,
            timeline: Timeline { set_count: wish.sets, ..Timeline::still(f64::from(run) * RUN_STEP_S) },
            ..Wishes::new(method, sampling, wish.lighting.to_string())
        };
        let views = self.views(wish.views)?;
        self.runtime.block_on(async {
            let session = open(&self.client, &wishes, &views).await?;
            receive(&session, &views, arrived).await
        })
    }

    /// How direct rendering finds surfaces in views of this size.
    ///
    /// # Errors
    /// The device's.
    pub fn visibility(&self) -> anyhow::Result<Choice> {
        let view = self.views(1)?;
        Ok(self.engine.visibility_choice(self.setup.offer.hash.as_str(), &view[0])?)
    }

    /// Drains the cluster.
    ///
    /// # Errors
    /// When a server failed.
    pub fn stop(self) -> anyhow::Result<()> {
        drop(self.client);
        self.runtime.block_on(self.cluster.drain())
    }
}
