//! The scene to measure, its sample cameras, and the views between them.

use std::cell::Cell;

use anyhow::Context as _;
use app_core::delivery::request;
use app_core::experiment::VIEW_SIZE_PX;
use app_core::setup::{SceneArgs, Setup};
use cluster::{MeasureCosts, PolicyChoice, SamplePlanes, SessionRequest, Timeline, Workload};
use depth_image::{PinholeCamera, ViewCell, ViewPlanes};

/// Scene time between sets: far less than any motion, but a new set, which is sampled as the paper's sets are.
const SET_STEP_S: f64 = 1e-3;
/// Views of one measured call, as in the coordinator's own requests.
pub const MEASURED_BATCH: u32 = 32;
/// The codec of frames.
const CODEC: &str = "lz4";

/// A scene and its rig. No two runs have the same scene times.
pub struct Subject {
    pub args: SceneArgs,
    pub setup: Setup,
    sets_so_far: Cell<u32>,
}

impl Subject {
    /// Loads a scene.
    ///
    /// # Errors
    /// The scene cannot be used.
    pub fn load(args: &SceneArgs) -> anyhow::Result<Self> {
        Ok(Self { args: args.clone(), setup: args.load()?, sets_so_far: Cell::new(0) })
    }

    /// The number of sample images, S.
    pub fn images(&self) -> usize {
        self.setup.samples.len()
    }

    /// The first `count` views of a sequence that fills the cell between the sample cameras evenly.
    ///
    /// # Errors
    /// There are no sample cameras.
    pub fn views(&self, count: usize) -> anyhow::Result<Vec<PinholeCamera>> {
        let cell = ViewCell::between(&self.setup.around).context("no sample cameras")?;
        Ok(cell.spread(count, VIEW_SIZE_PX))
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
        Ok(SessionRequest { lighting: self.args.lighting.to_string(), timeline, ..request })
    }

    /// A measurement for a node: a new set, and views in calls of `batch_count`.
    pub fn measurement(&self, typical_views: Vec<PinholeCamera>, batch_count: u32) -> MeasureCosts {
        let offer = &self.setup.offer;
        let workload = Workload {
            scene: offer.scene(),
            sample_cameras: offer.rig.iter().copied().map(Into::into).collect(),
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
        MeasureCosts {
            workload,
            method: self.args.method().to_string(),
            codec: CODEC.to_owned(),
            typical_views,
            batch_count,
            planes: ViewPlanes::default(),
            in_background: false,
            budget: None,
        }
    }
}
