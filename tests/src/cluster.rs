//! A cluster in one process over real loopback ports. Every node has its own runtime, so that a test can kill it
//! abruptly.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

use bytes::Bytes;
use client::{Client, ClientError, Session, ViewRequest};
use cluster::{
    ApplyPlan, Assignment, BudgetRequest, CommonCell, CommonKind, OfferSettings, PolicyChoice, SceneHash,
    SessionRequest, Timeline,
};
use codec::{FrameAssembly, FramePart, WholeFrame};
use coordinator::{CoordinatorConfig, Observers, OfferedCell, OfferedCube, SceneOffer, SceneOffers};
use depth_image::{
    Aabb, Camera, CubeGrid, Environment, LightDirections, LightFieldCamera, PinholeCamera, SourceSpace, ViewPlanes,
};
use glam::{UVec2, Vec3};
use node::{NodeConfig, NodeMetrics};
use planner::Row;
use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};
use tokio_stream::StreamExt as _;
use tokio_util::sync::CancellationToken;
use wire::rpc::Messages;

use crate::scalar_engine::{Pace, SKY_LINEAR, ScalarEngine, illumination};

/// A server with its own runtime.
pub struct Server {
    runtime: Option<Runtime>,
    shutdown: CancellationToken,
    stopped: tokio::sync::watch::Receiver<bool>,
    /// Its address, as `http://host:port`.
    pub address: String,
}

impl Server {
    /// Runs `serve` on a listener at a port of the system's choice.
    fn start<F>(serve: impl FnOnce(TcpListener, CancellationToken) -> F + Send + 'static) -> Self
    where
        F: Future<Output = Result<(), node::ServeError>> + Send + 'static,
    {
        Self::start_at("127.0.0.1:0", serve)
    }

    /// As [`Server::start`], at a port that another server may have used.
    pub(crate) fn start_at<F>(
        address: &str,
        serve: impl FnOnce(TcpListener, CancellationToken) -> F + Send + 'static,
    ) -> Self
    where
        F: Future<Output = Result<(), node::ServeError>> + Send + 'static,
    {
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime");
        let listener = bind(address);
        listener.set_nonblocking(true).expect("a socket option");
        let address = format!("http://{}", listener.local_addr().expect("an address"));
        let shutdown = CancellationToken::new();
        let (says, stopped) = tokio::sync::watch::channel(false);
        let token = shutdown.clone();
        runtime.spawn(async move {
            let listener = TcpListener::from_std(listener).expect("a listener");
            serve(listener, token).await.expect("served");
            let _ = says.send(true);
        });
        Self { runtime: Some(runtime), shutdown, stopped, address }
    }

    /// Ends the server at once; connections break.
    pub fn kill(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }

    /// Asks the server to end; returns the time that took.
    pub async fn drain(&mut self) -> Duration {
        let start = Instant::now();
        self.shutdown.cancel();
        self.stopped.wait_for(|stopped| *stopped).await.expect("it says when");
        start.elapsed()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Binds a port that its last user may still hold for a moment.
fn bind(address: &str) -> std::net::TcpListener {
    for _ in 0..500 {
        if let Ok(listener) = std::net::TcpListener::bind(address) {
            return listener;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("no port at {address}");
}

/// A coordinator and its nodes.
pub struct Cluster {
    /// The coordinator.
    pub coordinator: Server,
    /// `n0`, `n1`…
    pub nodes: Vec<Server>,
    /// The counters of all nodes together.
    pub engines: Vec<ScalarEngine>,
    /// The metrics of each node.
    pub metrics: Vec<NodeMetrics>,
    /// A connected client.
    pub client: Client,
    /// The speed of nodes that are added.
    pace: Pace,
}

/// The package is longer than a message, so that it travels in parts.
static PACKAGE: LazyLock<Bytes> = LazyLock::new(|| {
    let mut package = b"ball over floor".to_vec();
    package.extend((0..1_500_000u32).map(|i| (i * 7 % 251) as u8));
    package.into()
});
static PACKAGE_HASH: LazyLock<SceneHash> = LazyLock::new(|| SceneHash::of(&PACKAGE));

/// The package of the scene on offer.
#[must_use]
pub fn package() -> Bytes {
    PACKAGE.clone()
}

/// Three sample cameras on an arc in front of the ball.
#[must_use]
pub fn rig() -> Vec<Camera> {
    [-0.6, 0.0, 0.6].map(|x| Camera::Pinhole(camera(x, UVec2::new(64, 48)))).to_vec()
}

/// Rows of the scalar device: one to four cameras. It draws faster than it makes views from samples.
#[must_use]
pub fn rows(_: &str) -> Vec<Row> {
    let row = |camera_count| Row::Samples { method: "splat".to_owned(), camera_count, density: 1.0 };
    [1, 2, 4].map(row).to_vec()
}

/// The same, and drawing directly.
#[must_use]
pub fn rows_with_direct(lighting: &str) -> Vec<Row> {
    let direct = Row::Direct { lighting: lighting.to_owned(), ray_ratio: 1.0 };
    rows(lighting).into_iter().chain([direct]).collect()
}

/// The sampling method of the scalar device that takes all surfaces on lines.
pub const CUBE: &str = "cube";

fn volume() -> Aabb {
    Aabb { min: Vec3::splat(-3.0), max: Vec3::splat(3.0) }
}

/// The grid of the cube on offer.
///
/// # Panics
/// The volume has no grid.
#[must_use]
pub fn cube_grid() -> CubeGrid {
    CubeGrid::around(&volume(), 96).expect("a volume")
}

/// The offer of a coordinator of the scalar device.
#[must_use]
pub fn offer() -> SceneOffer {
    SceneOffer {
        name: "ball".to_owned(),
        hash: PACKAGE_HASH.clone(),
        package: package(),
        fits_views: false,
        rig: rig(),
        cube: Some(OfferedCube {
            sampling: CUBE.to_owned(),
            grid: cube_grid(),
            light_field: None,
            beside: "conventional".to_owned(),
        }),
        mirrors: mirrors(),
        base: None,
        blocks: Vec::new(),
        volume: volume(),
        background: Environment::uniform(SKY_LINEAR),
        illumination: illumination(),
        source_space: SourceSpace::default(),
        settings: OfferSettings::default(),
        // Six moments of a viewer.
        period_s: Some(0.5),
    }
}

/// As [`offer`], with a light field beside the cube.
#[must_use]
pub fn offer_with_light_field() -> SceneOffer {
    let offer = offer();
    let light_field = Some(LightFieldCamera::around(offer.volume, LightDirections::D66, 16));
    let cube = offer.cube.map(|cube| OfferedCube { light_field, ..cube });
    SceneOffer { cube, ..offer }
}

/// Two mirrors, whose images show the ball in their middle.
fn mirrors() -> Vec<OfferedCell> {
    let mirror = |x_m: f32| {
        let place = Vec3::new(x_m, 0.5, 2.0);
        let towards = Vec3::new(0.0, 0.6, 0.0);
        let camera = PinholeCamera::looking_at(place, towards, Vec3::Y, 0.6, UVec2::splat(16));
        let bounds = Aabb { min: place - 0.1, max: place + 0.1 };
        let cell = CommonCell { kind: CommonKind::Mirrors, bounds, sampling: "conventional".to_owned() };
        OfferedCell { cell, cameras: vec![camera.into()] }
    };
    vec![mirror(-1.0), mirror(1.0)]
}

/// The name of the second scene of [`two_offers`].
pub const OTHER_SCENE: &str = "another ball";

/// The offers of a coordinator with two scenes that look alike.
///
/// # Panics
/// They cannot be offered together.
#[must_use]
pub fn two_offers() -> SceneOffers {
    let package: Bytes = [&package()[..], b"another"].concat().into();
    let other = SceneOffer { name: OTHER_SCENE.to_owned(), hash: SceneHash::of(&package), package, ..offer() };
    SceneOffers::new(vec![offer(), other]).expect("two scenes")
}

/// A camera in front of the ball.
#[must_use]
pub fn camera(x_m: f32, size_px: UVec2) -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(x_m, 1.2, 3.0), Vec3::new(0.0, 0.5, 0.0), Vec3::Y, 0.9, size_px)
}

/// A camera on a circle around the ball.
#[must_use]
pub fn camera_around(azimuth_rad: f32, distance_m: f32, size_px: UVec2) -> PinholeCamera {
    let target = Vec3::new(0.0, 0.5, 0.0);
    let eye = target + Vec3::new(distance_m * azimuth_rad.sin(), 0.7, distance_m * azimuth_rad.cos());
    PinholeCamera::looking_at(eye, target, Vec3::Y, 0.9, size_px)
}

/// A session of the scalar device.
#[must_use]
pub fn request(policy: PolicyChoice, timeline: Timeline) -> SessionRequest {
    SessionRequest {
        scene: None,
        method: "splat".to_owned(),
        sampling: "conventional".to_owned(),
        lighting: "unlit".to_owned(),
        follows_mirrors: false,
        takes_light: false,
        codec: "lz4".to_owned(),
        sample_cameras: Vec::new(),
        sample_size_px: None,
        volume: None,
        typical_view: camera(0.1, UVec2::new(48, 36)),
        views_per_set: 12,
        planes: ViewPlanes::ALL,
        auto_exposure: false,
        timeline,
        policy,
        forced_sampler_count: None,
        refinement_steps: 1,
        frames_per_s: None,
        fallbacks: Vec::new(),
        viewpoints: Vec::new(),
        forced_tile_count: None,
        budget: BudgetRequest::default(),
    }
}

/// `per_set` views of each set, from left to right.
#[must_use]
pub fn views(sets: u32, per_set: u32) -> Vec<ViewRequest> {
    let view = |i: u32| ViewRequest {
        frame: u64::from(i) + 100,
        set_index: i / per_set,
        camera: camera((i % per_set) as f32 * 0.08 - 0.4, UVec2::new(48, 36)),
    };
    (0..sets * per_set).map(view).collect()
}

impl Cluster {
    /// A coordinator and `nodes` nodes that have joined.
    pub async fn start(nodes: usize) -> Self {
        Self::start_with(nodes, |config| config).await
    }

    /// As [`Cluster::start`], with each node's configuration changed by `change`.
    pub async fn start_with(nodes: usize, change: impl Fn(NodeConfig) -> NodeConfig) -> Self {
        Self::start_limited(CoordinatorConfig { rows, ..CoordinatorConfig::default() }, nodes, change).await
    }

    /// As [`Cluster::start_with`], with a coordinator's configuration.
    pub async fn start_limited(
        config: CoordinatorConfig,
        nodes: usize,
        change: impl Fn(NodeConfig) -> NodeConfig,
    ) -> Self {
        Self::start_observed(config, Observers::default(), nodes, change).await
    }

    /// As [`Cluster::start_limited`], with observers of the schedule.
    pub async fn start_observed(
        config: CoordinatorConfig,
        observers: Observers,
        nodes: usize,
        change: impl Fn(NodeConfig) -> NodeConfig,
    ) -> Self {
        let start = move |listener, shutdown| coordinator::serve(listener, config, offer().into(), observers, shutdown);
        Self::start_after(Server::start(start), nodes, change).await
    }

    /// As [`Cluster::start`], with another scene on offer.
    pub async fn start_offering(offer: SceneOffer, nodes: usize) -> Self {
        let config = CoordinatorConfig::default();
        let observers = Observers::default();
        let start = move |listener, shutdown| coordinator::serve(listener, config, offer.into(), observers, shutdown);
        Self::start_after(Server::start(start), nodes, |config| config).await
    }

    async fn start_after(coordinator: Server, nodes: usize, change: impl Fn(NodeConfig) -> NodeConfig) -> Self {
        let client = connected(&coordinator.address).await;
        let mut cluster = Self {
            coordinator,
            nodes: Vec::new(),
            engines: Vec::new(),
            metrics: Vec::new(),
            client,
            pace: Pace::default(),
        };
        for _ in 0..nodes {
            cluster.add_node(&change);
        }
        cluster.client.wait_for_nodes(nodes, Duration::from_secs(10)).await.expect("joined");
        cluster
    }

    /// Gives all nodes a stated speed, also those that are added. Timings of a busy machine then look alike, so that
    /// plans do not change with them.
    pub fn keep_pace(&mut self, pace: Pace) {
        self.pace = pace;
        self.engines.iter().for_each(|engine| engine.keep_pace(pace));
    }

    /// Adds a node, which joins soon.
    pub fn add_node(&mut self, change: impl Fn(NodeConfig) -> NodeConfig) {
        let engine = ScalarEngine::default();
        engine.keep_pace(self.pace);
        let config = change(NodeConfig::new(format!("n{}", self.nodes.len()), &self.coordinator.address));
        let metrics = NodeMetrics::default();
        self.engines.push(engine.clone());
        self.metrics.push(metrics.clone());
        self.nodes.push(Server::start(|listener, shutdown| {
            let open = std::sync::Arc::new(move || Ok(std::sync::Arc::new(engine.opened()) as _));
            node_host::serve(listener, config, open, metrics, shutdown)
        }));
    }

    /// Kills a compositor that samples nothing, abruptly.
    ///
    /// # Panics
    /// The plan has none.
    pub fn kill_compositor(&mut self, plan: &Assignment) {
        let is_sampler = |name: &str| plan.samplers.iter().any(|share| share.node_name == name);
        let killed = plan.compositors.iter().find(|share| !is_sampler(&share.node_name)).expect("a compositor");
        self.nodes[killed.node_name[1..].parse::<usize>().expect("a number")].kill();
    }

    /// Kills the coordinator abruptly.
    pub fn kill_coordinator(&mut self) {
        self.coordinator.kill();
    }

    /// Starts a coordinator at the address of the last one.
    pub fn restart_coordinator(&mut self) {
        let address = self.coordinator.address.trim_start_matches("http://").to_owned();
        let config = CoordinatorConfig::default();
        self.coordinator = Server::start_at(&address, move |listener, shutdown| {
            coordinator::serve(listener, config, offer().into(), Observers::default(), shutdown)
        });
    }

    /// Opens a session, and resets the sample counts of the measurement.
    ///
    /// # Errors
    /// The client's error.
    pub async fn session(&self, request: SessionRequest) -> Result<Session, ClientError> {
        let session = self.client.open_session(request, |_| ()).await?;
        self.take_counts();
        Ok(session)
    }

    /// Closes a session, and waits until the coordinator has heard of it: the next may then force another policy.
    ///
    /// # Panics
    /// The coordinator does not answer.
    pub async fn close(&self, session: Session) {
        let open = async || self.client.status().await.expect("a status").session_count();
        let before = open().await;
        drop(session);
        while open().await >= before {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// The number of times that each image was sampled since the last call, over all nodes.
    pub fn take_counts(&self) -> Vec<usize> {
        let mut all = std::collections::HashMap::new();
        for (image, times) in self.engines.iter().flat_map(ScalarEngine::take_counts) {
            *all.entry(image).or_insert(0) += times;
        }
        all.into_values().collect()
    }
}

/// The next complete frame of a stream.
///
/// # Panics
/// No frame arrives.
pub async fn whole_frame(parts: &mut Messages<FramePart>) -> WholeFrame {
    let mut assembly = FrameAssembly::default();
    loop {
        let part = parts.next().await.expect("a frame").expect("no refusal");
        if let Some(frame) = assembly.push(part).expect("parts in their order") {
            return frame;
        }
    }
}

/// A client of a coordinator that starts soon.
///
/// # Panics
/// The coordinator does not start.
pub async fn connected(address: &str) -> Client {
    for _ in 0..200 {
        if let Ok(client) = Client::connect(address).await {
            return client;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("no coordinator at {address}");
}

/// A plan that does not tell which workloads are open.
#[must_use]
pub fn plan_alone(assignment: Assignment) -> ApplyPlan {
    ApplyPlan { assignment, open_workloads: Vec::new() }
}
