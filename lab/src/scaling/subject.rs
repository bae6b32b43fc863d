//! The scene to measure, its sample cameras, and the views between them.

use std::cell::Cell;

use anyhow::Context as _;
use app_core::delivery::request;
use app_core::experiment::VIEW_SIZE_PX;
use app_core::setup::{SceneArgs, Setup};
use cluster::{MeasureCosts, PolicyChoice, SamplePlanes, SessionRequest, Timeline, Workload};
use depth_image::{Camera, PinholeCamera, ViewCell, ViewPlanes};
use glam::UVec2;

/// Scene time between sets: far less than any motion, but a new set, which is sampled as the paper's sets are.
const SET_STEP_S: f64 = 1e-3;
/// Views of one measured call, as in the coordinator's own requests.
pub const MEASURED_BATCH: u32 = 32;
/// The codec of frames.
const CODEC: &str = "lz4";

/// The density of the paper's images.
const PAPER_DENSITY: f32 = 2.0;

/// The size of a sample set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetSize {
    /// S.
    pub images: usize,
    /// Texels a view's pixel, each way.
    pub density: f32,
}

/// A scene and its rig. No two runs have the same scene times.
pub struct Subject {
    pub args: SceneArgs,
    pub setup: Setup,
    pub view_size_px: UVec2,
    sets_so_far: Cell<u32>,
}

impl Subject {
    /// Loads a scene.
    ///
    /// # Errors
    /// The scene cannot be used.
    pub fn load(args: &SceneArgs, view_size_px: UVec2) -> anyhow::Result<Self> {
        Ok(Self { args: args.clone(), setup: args.load()?, view_size_px, sets_so_far: Cell::new(0) })
    }

    /// The number of sample images, S.
    pub fn images(&self) -> usize {
        self.setup.samples.len()
    }

    /// Whether samples hold light, and surfaces come from the scene.
    pub fn takes_light(&self) -> bool {
        self.args.method().light_cache_quality().is_some()
    }

    /// The cameras of a set: those of the rig, or fewer within the cell, in a density of texels a view's pixel each way.
    ///
    /// # Errors
    /// There are no sample cameras.
    pub fn sample_cameras(&self, set: SetSize) -> anyhow::Result<Vec<Camera>> {
        let corner = self.setup.samples.first().context("no sample cameras")?;
        let cameras = match set.images < self.images() {
            true => self.cell()?.nested_cameras(set.images, corner.size_px),
            false => self.setup.samples.clone(),
        };
        let views_ratio = self.view_size_px.y as f32 / VIEW_SIZE_PX.y as f32;
        let focal_px = corner.focal_px.y * views_ratio * set.density / PAPER_DENSITY;
        let resized = cameras.into_iter().map(|camera| {
            let size_px = camera.size_px.as_vec2() * (focal_px / camera.focal_px.y);
            Camera::Pinhole(camera.resized(size_px.round().as_uvec2()))
        });
        Ok(resized.collect())
    }

    /// The set of all points: the paper's, or, where samples hold light, as dense as views.
    pub fn set(&self) -> SetSize {
        SetSize { images: self.images(), density: if self.takes_light() { 1.0 } else { PAPER_DENSITY } }
    }

    fn cell(&self) -> anyhow::Result<ViewCell> {
        ViewCell::between(&self.setup.around).context("no sample cameras")
    }

    /// The first `count` views of a sequence that fills the cell between the sample cameras evenly.
    ///
    /// # Errors
    /// There are no sample cameras.
    pub fn views(&self, count: usize) -> anyhow::Result<Vec<PinholeCamera>> {
        Ok(self.cell()?.spread(count, self.view_size_px))
    }

    /// A timeline of sets that no node has sampled yet.
    pub fn fresh_timeline(&self, set_count: u32) -> Timeline {
        let first = self.sets_so_far.replace(self.sets_so_far.get() + set_count);
        Timeline { start_s: f64::from(first) * SET_STEP_S, step_s: SET_STEP_S, set_count }
    }

    /// The request of a session for `views` of each set.
    ///
    /// # Errors
    /// There are no views.
    pub fn request(
        &self,
        views: &[PinholeCamera],
        policy: PolicyChoice,
        set_count: u32,
    ) -> anyhow::Result<SessionRequest> {
        let request = request(self.setup.offer.settings.clone(), policy, views)?;
        let timeline = self.fresh_timeline(set_count);
        let sample_cameras = self.sample_cameras(self.set())?;
        Ok(SessionRequest { lighting: self.args.lighting.to_string(), timeline, sample_cameras, ..request })
    }

    /// A measurement for a node: a new set of a size, and views in calls of `batch_count`.
    ///
    /// # Errors
    /// There are no sample cameras.
    pub fn measurement(
        &self,
        set: SetSize,
        typical_views: Vec<PinholeCamera>,
        batch_count: u32,
    ) -> anyhow::Result<MeasureCosts> {
        let offer = &self.setup.offer;
        let workload = Workload {
            scene: offer.scene(),
            sample_cameras: self.sample_cameras(set)?.into_iter().map(Into::into).collect(),
            cell_first_indices: Vec::new(),
            common_cells: Vec::new(),
            sampling: self.args.sampling().to_string(),
            lighting: self.args.lighting.to_string(),
            planes: SamplePlanes::default(),
            volume: offer.volume,
            background: offer.background,
            timeline: self.fresh_timeline(1),
            illumination: offer.illumination.clone(),
            refinement_steps: 1,
            traced_pixel_count: None,
        };
        Ok(MeasureCosts {
            workload,
            method: self.args.method().to_string(),
            codec: CODEC.to_owned(),
            typical_views,
            batch_count,
            planes: ViewPlanes::default(),
            in_background: false,
            budget: None,
        })
    }
}
