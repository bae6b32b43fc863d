//! A cluster with a budget, and a live viewer of it.

use std::path::Path;
use std::time::Duration;

use anyhow::Context as _;
use app_core::delivery::{Terms, open, request, viewpoints};
use app_core::live::{Drive, Record, drive};
use client::{Client, Session};
use cluster::{BudgetRequest, OfferStatus, PolicyChoice, Promise, PromiseState, SessionRequest};
use depth_image::{PinholeCamera, ViewCell};
use glam::UVec2;

use crate::process::Process;

const SIZE_PX: UVec2 = UVec2::new(200, 150);
/// Poses of the path: no place comes twice within a measurement of a minute.
const PATH_POSES: usize = 600;
/// Places of half a circle around the scene, and those beyond its back that a viewer goes to slowly.
const BACK: usize = 6000;
const STAY: usize = 600;
/// The longest time until a promise is kept.
const PLANNED_WITHIN: Duration = Duration::from_secs(240);

/// A running `myriorama up`, which ends when it is dropped.
pub(super) struct Cluster {
    client: Client,
    offer: OfferStatus,
    pub(super) device: String,
    _process: Process,
}

/// What a viewer asks for.
pub(super) struct Asked<'a> {
    pub(super) budget: Option<&'a str>,
    pub(super) policy: PolicyChoice,
    /// Poses a second.
    pub(super) rate_hz: f64,
    pub(super) path: Vec<PinholeCamera>,
    /// Sample cameras stand in view cells along the path, not between the offered ones.
    pub(super) has_cells: bool,
}

/// A live viewer with a budget, or without one.
pub(super) struct Viewer {
    session: Session,
    path: Vec<PinholeCamera>,
}

impl Cluster {
    /// A cluster for a scene that keeps its measurements in a folder, with further arguments.
    ///
    /// # Errors
    /// It does not start.
    pub(super) async fn start(scene: &str, plans: &Path, further: &[&str]) -> anyhow::Result<Self> {
        let plans = plans.to_str().context("a folder whose name is no text")?;
        let arguments = [&["--scene", scene, "--plans", plans][..], further].concat();
        let mut process = Process::up(&arguments.into_iter().map(str::to_owned).collect::<Vec<_>>())?;
        let client = Client::connect(&process.address()?).await?;
        let status = client.status().await?;
        let device = status.nodes.first().map_or_else(String::new, |node| node.device_name.clone());
        let offer = status.offers.into_iter().next().context("no scene is on offer")?;
        Ok(Self { client, offer, device, _process: process })
    }

    /// The nodes' time for audits so far.
    ///
    /// # Errors
    /// The coordinator does not answer.
    pub(super) async fn audit_s(&self) -> anyhow::Result<f64> {
        Ok(self.promise().await?.and_then(|promise| promise.audit).map_or(0.0, |audit| audit.busy_s))
    }

    /// The promise to the viewers, with its figures now.
    ///
    /// # Errors
    /// As [`Cluster::audit_s`].
    pub(super) async fn promise(&self) -> anyhow::Result<Option<Promise>> {
        let status = self.client.status().await?;
        Ok(status.workloads.into_iter().find_map(|workload| workload.promise))
    }

    /// Places on an ellipse between the sample cameras.
    ///
    /// # Errors
    /// The scene has no sample cameras.
    pub(super) fn orbit(&self) -> anyhow::Result<Vec<PinholeCamera>> {
        Ok(self.cell()?.orbit(PATH_POSES, SIZE_PX))
    }

    /// A way around the scene to its back, and then slowly on.
    ///
    /// # Errors
    /// As [`Cluster::orbit`].
    pub(super) fn to_the_back(&self, poses_of_the_way: usize, poses: usize) -> anyhow::Result<Vec<PinholeCamera>> {
        let circle = self.cell()?.around(self.offer.volume.center(), 2 * BACK, SIZE_PX);
        let place = |pose: usize| match pose.checked_sub(poses_of_the_way) {
            None => pose * BACK / poses_of_the_way,
            Some(stayed) => BACK + stayed * STAY / poses,
        };
        Ok((0..poses).map(|pose| circle[place(pose)]).collect())
    }

    fn cell(&self) -> anyhow::Result<ViewCell> {
        let samples: Vec<_> = self.offer.sample_cameras.iter().map(|camera| *camera.reference()).collect();
        ViewCell::between(&samples).context("no sample cameras")
    }

    /// A viewer that asks for poses at a rate.
    ///
    /// # Errors
    /// The coordinator refuses.
    pub(super) async fn viewer(&self, asked: Asked<'_>) -> anyhow::Result<Viewer> {
        let Asked { budget, policy, rate_hz, path, has_cells } = asked;
        let budget = BudgetRequest { budget: budget.map(str::to_owned), names_method: false };
        let viewpoints = if has_cells { viewpoints(&path) } else { Vec::new() };
        let request = request(self.offer.settings.clone(), Terms { policy, budget }, &path[..1])?;
        let request = SessionRequest { frames_per_s: Some(rate_hz), viewpoints, ..request };
        Ok(Viewer { session: open(&self.client, request).await?, path })
    }
}

impl Viewer {
    /// Waits for the promise of a plan.
    ///
    /// # Errors
    /// Nothing keeps the budget, or the plan takes too long.
    pub(super) async fn kept(&self) -> anyhow::Result<Promise> {
        let settled = async {
            let mut promise = self.session.promise();
            while promise.as_ref().is_none_or(|promise| promise.state == PromiseState::Measuring) {
                promise = Some(self.session.another_promise(promise.as_ref()).await);
            }
            promise
        };
        let promise = tokio::time::timeout(PLANNED_WITHIN, settled).await.context("the plan takes too long")?;
        let promise = promise.context("there is no promise")?;
        anyhow::ensure!(promise.state == PromiseState::Kept, "{promise}");
        Ok(promise)
    }

    /// The promise, where there is one.
    pub(super) fn promise(&self) -> Option<Promise> {
        self.session.promise()
    }

    /// Follows the path for some seconds, or until `stop` resolves.
    ///
    /// # Errors
    /// The frames end by an error.
    pub(super) async fn follow(&self, rate_hz: f64, seconds: f64, stop: impl Future) -> anyhow::Result<Record> {
        let lasting = Duration::from_secs_f64(seconds);
        let settings = Drive { path: self.path.clone(), rate_hz, lasting, set_step_s: 1.0, set_count: 1 };
        let record = drive(&self.session, &settings, stop).await?;
        match record.error.clone() {
            Some(error) => Err(error).context("the viewer's frames have ended"),
            None => Ok(record),
        }
    }
}
