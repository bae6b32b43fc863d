//! The boundary to the device.

use std::any::Any;
use std::sync::Arc;
use std::time::Instant;

use cluster::{CommonCell, SamplePlanes, Workload};
use depth_image::{
    Aabb, Environment, Illumination, PinholeCamera, Refinement, SampleCamera, SampleImage, SampleImageError,
    SampleImages, Turn, View, ViewPlanes,
};
use tonic::Status;

/// The operations of a node's device. Calls block; services run them on blocking threads. Methods, sampling and lighting are
/// text, as on the command line, and are parsed here. Calls fail for text that is unknown, a scene that is not loaded, and a
/// device that fails.
pub trait Engine: Send + Sync + 'static {
    /// The device's name, which every reported time is listed with.
    fn device_name(&self) -> String;
    /// Whether the device is a CPU.
    fn is_software(&self) -> bool;
    /// Loads a scene package, whose bytes have been checked against the hash, under its hash. Fails where the package cannot be
    /// read or the device cannot hold it.
    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<(), EngineError>;
    /// Whether [`Engine::load_scene`] has loaded the scene.
    fn has_scene(&self, hash: &str) -> bool;
    /// Whether an image depends on the images before it, so that one node samples a whole set.
    fn images_are_sequential(&self, sampling: &str) -> Result<bool, EngineError>;
    /// Whether an image depends on its own camera alone, so that it is tileable.
    fn images_are_independent(&self, sampling: &str) -> Result<bool, EngineError>;
    /// The planes of sample images that a reconstruction method needs.
    fn sample_planes(&self, method: &str) -> Result<SamplePlanes, EngineError>;
    /// The lighting of views that are drawn quickly until their set is there: a single ray of each kind.
    fn preview_lighting(&self, lighting: &str) -> Result<String, EngineError> {
        Ok(lighting.to_owned())
    }
    /// Counts a live stream as open until the guard is dropped. Meanwhile long work is cut into slices, so that live work
    /// goes between them.
    fn live_stream(&self) -> Box<dyn Any + Send + Sync> {
        Box::new(())
    }
    /// Seconds for which calls of this thread have waited for their turns so far.
    fn waited_s(&self) -> f64 {
        0.0
    }
    /// Samples the wanted images of a set, in their order.
    fn sample(&self, request: &SampleWork, turn: Turn) -> Result<Vec<SampleImage>, EngineError>;
    /// Uploads a set for reconstruction. Fails for images that the device cannot take.
    fn upload(&self, set: &SampleSet, turn: Turn) -> Result<SharedSet, EngineError>;
    /// A set with those of common cells, which it keeps on the device: its mirrors show what the sets of mirrors hold. A base tells
    /// what its own images leave unknown, and what mirrors without such a set and rough surfaces show. Without both, mirrors show lamps and the
    /// environment.
    fn with_common(&self, set: SharedSet, common: Vec<CommonSet>) -> Result<SharedSet, EngineError>;
    /// Reconstructs one view for each camera. A set of light needs its scene, which must be loaded.
    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork, turn: Turn) -> Result<Vec<View>, EngineError>;
    /// The parts of making views whose light comes from samples; `None` for a set of another kind.
    fn light_parts(
        &self,
        _set: &dyn UploadedSet,
        _work: &ViewWork,
        _turn: Turn,
    ) -> Result<Option<LightParts>, EngineError> {
        Ok(None)
    }
    /// Draws one view for each camera from the scene itself.
    fn draw_direct(&self, work: &DirectWork, turn: Turn) -> Result<Vec<View>, EngineError>;
    /// The pixels up to which pictures of a scene find surfaces faster by rays than by drawing triangles, measured for views like
    /// the first of `work`. `None` for an engine that knows one way only.
    fn traced_pixel_count(&self, _work: &DirectWork, _turn: Turn) -> Result<Option<u32>, EngineError> {
        Ok(None)
    }
}

/// Opens the engine of a device, for a node's start and again after the device was lost. It blocks.
pub type OpenEngine = Arc<dyn Fn() -> Result<Arc<dyn Engine>, EngineError> + Send + Sync>;

/// The set of a view cell with those of common cells, from the sets of all cells of a workload [of one
/// view](Workload::of_one_view).
pub(crate) fn set_of_view(
    engine: &dyn Engine,
    workload: &Workload,
    sets: Vec<SharedSet>,
) -> Result<SharedSet, EngineError> {
    let mut sets = sets.into_iter();
    let reason = "a view has none".to_owned();
    let set = sets.next().ok_or(EngineError::InvalidArgument { field: "sample_cameras", reason })?;
    let common: Vec<CommonSet> = workload.common_cells.iter().cloned().zip(sets).collect();
    if common.is_empty() { Ok(set) } else { engine.with_common(set, common) }
}

/// The result of work on this thread, and the seconds that it took, without those for which it waited for others.
pub fn own_time<T>(engine: &dyn Engine, work: impl FnOnce() -> T) -> (T, f64) {
    let waited_before_s = engine.waited_s();
    let start = Instant::now();
    let done = work();
    let waited_s = engine.waited_s() - waited_before_s;
    (done, (start.elapsed().as_secs_f64() - waited_s).max(0.0))
}

/// A sample set on the device; the engine downcasts it to its own type.
pub trait UploadedSet: Any + Send + Sync {}

/// A sample set on the device, which the views of it share.
pub type SharedSet = Arc<dyn UploadedSet>;

/// A common cell and its set.
pub type CommonSet = (CommonCell, SharedSet);

/// Images to sample.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct SampleWork {
    pub scene_hash: String,
    /// The cameras of the whole set, in its order: an image may depend on the cameras before its own.
    pub cameras: Vec<SampleCamera>,
    /// T: each image is cut into this many tiles, one above the other; 1 for whole images.
    pub tile_count: u32,
    /// The tiles to sample: those of image i are i · T to (i + 1) · T - 1.
    pub wanted: Vec<u32>,
    pub sampling: String,
    /// Planes beside colour and inverse depth.
    pub planes: SamplePlanes,
    pub lighting: String,
    pub scene_time_s: f32,
    /// How far the light is refined. Any step may be asked for first, or alone.
    pub refinement: Refinement,
    /// Whether surfaces are found by rays or drawn; `None`: whichever this node measured to be faster.
    pub surfaces_by_rays: Option<bool>,
}

impl SampleWork {
    /// All images of the first set of a workload of one cell, finished at once.
    #[must_use]
    pub fn of(workload: &Workload) -> Self {
        let pixel_count = workload.sample_cameras.first().map(SampleCamera::pixel_count);
        Self {
            scene_hash: workload.scene.hash.to_string(),
            cameras: workload.sample_cameras.clone(),
            tile_count: 1,
            wanted: (0..workload.sample_cameras.len() as u32).collect(),
            sampling: workload.sampling.clone(),
            planes: workload.planes,
            lighting: workload.lighting.clone(),
            scene_time_s: workload.timeline.start_s as f32,
            refinement: Refinement::default(),
            surfaces_by_rays: pixel_count.and_then(|pixels| workload.finds_surfaces_by_rays(pixels)),
        }
    }

    /// The camera of a tile; `None` beyond the last.
    #[must_use]
    pub fn camera_of_tile(&self, tile: u32) -> Option<SampleCamera> {
        let camera = self.cameras.get((tile / self.tile_count) as usize)?;
        Some(camera.tile(tile % self.tile_count, self.tile_count))
    }
}

/// The images of one set.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleSet {
    /// The scene. It must be loaded where it has an environment map, which views show and highlights mirror, and where the images
    /// have light in place of colour: surfaces of such views come from the scene.
    pub scene_hash: String,
    /// One image for each sample camera, in their order.
    pub images: SampleImages,
    /// The bounds of reconstruction.
    pub volume: Aabb,
    /// Radiance of rays that leave the scene, by their direction.
    pub background: Environment,
    /// The scene's lamps and environment, for highlights; in the order of the images' visibility.
    pub illumination: Illumination,
    /// The lighting that the images were sampled with; highlights follow its formula.
    pub lighting: String,
    /// The moment of the scene that the images show.
    pub scene_time_s: f32,
    /// As in the workload, for views of this set whose surfaces come from the scene.
    pub traced_pixel_count: Option<u32>,
    /// It is of a common cell: rays off mirrors are followed in it, and may cover several texels.
    pub is_common: bool,
}

impl SampleSet {
    /// The first set of a workload of one cell.
    ///
    /// # Errors
    /// Images that do not belong together.
    pub fn of(workload: &Workload, images: Vec<SampleImage>, is_common: bool) -> Result<Self, SampleImageError> {
        Ok(Self {
            scene_hash: workload.scene.hash.to_string(),
            images: images.try_into()?,
            volume: workload.volume,
            background: workload.background,
            illumination: workload.illumination.clone(),
            lighting: workload.lighting.clone(),
            scene_time_s: workload.timeline.start_s as f32,
            traced_pixel_count: workload.traced_pixel_count,
            is_common,
        })
    }
}

/// Views to reconstruct.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewWork {
    /// Cameras of one size.
    pub cameras: Vec<PinholeCamera>,
    /// The reconstruction method.
    pub method: String,
    /// Planes beside colour.
    pub planes: ViewPlanes,
}

/// The parts of making views whose light comes from samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightParts {
    /// The share of surface points whose light samples know, from 0 to 1.
    pub known_ratio: f64,
    /// Seconds of finding surfaces.
    pub surfaces_s: f64,
    /// Seconds of surfaces and the look-up, where the light of every sample that is near counts.
    pub draft_s: f64,
}

/// Views to draw from the scene.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct DirectWork {
    pub scene_hash: String,
    /// Cameras of one size.
    pub cameras: Vec<PinholeCamera>,
    pub lighting: String,
    pub scene_time_s: f32,
    /// Planes beside colour.
    pub planes: ViewPlanes,
    /// Whether surfaces are found by rays or drawn; `None`: whichever this node measured to be faster.
    pub surfaces_by_rays: Option<bool>,
}

impl DirectWork {
    /// Views of a workload's scene at its start.
    #[must_use]
    pub fn of(workload: &Workload, cameras: Vec<PinholeCamera>, planes: ViewPlanes) -> Self {
        let pixel_count = cameras.first().map(PinholeCamera::pixel_count);
        Self {
            scene_hash: workload.scene.hash.to_string(),
            cameras,
            lighting: workload.lighting.clone(),
            scene_time_s: workload.timeline.start_s as f32,
            planes,
            surfaces_by_rays: pixel_count.and_then(|pixels| workload.finds_surfaces_by_rays(pixels)),
        }
    }
}

/// Why an operation of the device failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum EngineError {
    /// A setting that cannot be used.
    #[error("{field}: {reason}")]
    InvalidArgument { field: &'static str, reason: String },
    /// A scene that was never loaded.
    #[error("scene {hash} is not loaded")]
    UnknownScene { hash: String },
    /// The device, or its memory, failed in this one operation.
    #[error("device: {0}")]
    Device(String),
    /// The device has no memory for this operation; a smaller one may succeed.
    #[error("out of device memory: {0}")]
    OutOfMemory(String),
    /// The device is lost for all operations.
    #[error("device lost: {0}")]
    Lost(String),
}

impl From<EngineError> for Status {
    fn from(error: EngineError) -> Self {
        let text = error.to_string();
        match error {
            EngineError::InvalidArgument { .. } => Self::invalid_argument(text),
            EngineError::UnknownScene { .. } => Self::failed_precondition(text),
            EngineError::Device(_) => Self::internal(text),
            // Another node's device can do it.
            EngineError::OutOfMemory(_) | EngineError::Lost(_) => Self::unavailable(text),
        }
    }
}
