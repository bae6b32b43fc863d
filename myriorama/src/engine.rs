//! The device behind a node: [`node::Engine`] over the drawing, sampling and reconstruction crates.

use std::any::Any;
use std::collections::HashMap;
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Instant;

use depth_image::{DepthImage, View};
use gpu::{DevicePreference, Gpu, GpuError};
use node::{DirectWork, Engine, EngineError, SampleSet, SampleWork, UploadedSet, ViewWork};
use reconstruction::{ReconstructionError, ReconstructionMethod, Reconstructor};
use render::{DrawWork, GpuScene, Rasterizer, RenderError, SamplePlanes};
use sampling::{Sampler, SamplingError};
use scene::{Limits, Scene};

/// Scenes that stay on the device; the one that was loaded first goes first.
const KEPT_SCENES: usize = 8;

/// One device, its pipelines, and the scenes on it.
pub struct GpuEngine {
    gpu: Arc<Gpu>,
    rasterizer: Arc<Rasterizer>,
    sampler: Sampler,
    reconstructor: Reconstructor,
    scenes: Mutex<Vec<(String, Arc<GpuScene>)>>,
    /// One load at a time: nodes of one process want the same scene at the same moment.
    loading: Mutex<()>,
}

/// A sample set on this engine's device.
struct Uploaded(reconstruction::SampleSet);
impl UploadedSet for Uploaded {}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn device(error: impl ToString) -> EngineError {
    EngineError::Device(error.to_string())
}

fn invalid(field: &'static str, reason: impl ToString) -> EngineError {
    EngineError::InvalidArgument { field, reason: reason.to_string() }
}

fn render_error(error: RenderError) -> EngineError {
    match error {
        RenderError::Camera { .. } => invalid("camera", error),
        _ => device(error),
    }
}

fn reconstruction_error(error: ReconstructionError) -> EngineError {
    match error {
        ReconstructionError::Camera { .. } => invalid("camera", error),
        ReconstructionError::Sample { .. } | ReconstructionError::SampleCount(_) => invalid("sample_images", error),
        ReconstructionError::Volume => invalid("volume", error),
        _ => device(error),
    }
}

/// A setting out of its name.
pub(crate) fn parsed<T: FromStr<Err: ToString>>(field: &'static str, text: &str) -> Result<T, EngineError> {
    text.parse().map_err(|error: T::Err| invalid(field, error.to_string()))
}

impl GpuEngine {
    /// Opens a device of its own.
    ///
    /// # Errors
    /// When there is no device or a shader is broken.
    pub fn open(preference: DevicePreference) -> Result<Self, EngineError> {
        let gpu = Gpu::open(preference).map_err(|error: GpuError| device(error))?;
        let rasterizer = Arc::new(Rasterizer::new(&gpu).map_err(render_error)?);
        Ok(Self {
            sampler: Sampler::sharing(rasterizer.clone()),
            reconstructor: Reconstructor::new(&gpu).map_err(reconstruction_error)?,
            rasterizer,
            gpu,
            scenes: Mutex::default(),
            loading: Mutex::default(),
        })
    }

    /// The engine that all nodes of this process share; it closes with the last of them.
    ///
    /// # Errors
    /// As [`GpuEngine::open`].
    pub fn shared(preference: DevicePreference) -> Result<Arc<Self>, EngineError> {
        static OPEN: Mutex<Option<HashMap<String, Weak<GpuEngine>>>> = Mutex::new(None);
        let mut open = locked(&OPEN);
        let engines = open.get_or_insert_default();
        if let Some(engine) = engines.get(&preference.to_string()).and_then(Weak::upgrade) {
            return Ok(engine);
        }
        let engine = Arc::new(Self::open(preference)?);
        engines.insert(preference.to_string(), Arc::downgrade(&engine));
        Ok(engine)
    }

    /// Uploads a scene under the hash of its package, unless it is there; gives the seconds spent.
    ///
    /// # Errors
    /// When the device cannot hold it.
    pub fn put_scene(&self, hash: &str, scene: &Scene) -> Result<f64, EngineError> {
        let _one = locked(&self.loading);
        if self.has_scene(hash) {
            return Ok(0.0);
        }
        let start = Instant::now();
        let uploaded = Arc::new(GpuScene::upload(&self.gpu, scene).map_err(render_error)?);
        let mut scenes = locked(&self.scenes);
        if scenes.len() >= KEPT_SCENES {
            scenes.remove(0);
        }
        scenes.push((hash.to_owned(), uploaded));
        Ok(start.elapsed().as_secs_f64())
    }

    /// The pipelines that reconstruct, for measuring without a service in between.
    #[must_use]
    pub fn reconstructor(&self) -> &Reconstructor {
        &self.reconstructor
    }

    fn scene(&self, hash: &str) -> Result<Arc<GpuScene>, EngineError> {
        let found = locked(&self.scenes).iter().find(|(kept, _)| kept == hash).map(|(_, scene)| scene.clone());
        found.ok_or_else(|| EngineError::UnknownScene { hash: hash.to_owned() })
    }
}

impl Engine for GpuEngine {
    fn device_name(&self) -> String {
        self.gpu.name()
    }

    fn is_software(&self) -> bool {
        self.gpu.is_software()
    }

    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<f64, EngineError> {
        let start = Instant::now();
        let scene = scene::unpack(package, &Limits::default()).map_err(|error| invalid("package", error))?;
        self.put_scene(hash, &scene)?;
        Ok(start.elapsed().as_secs_f64())
    }

    fn has_scene(&self, hash: &str) -> bool {
        locked(&self.scenes).iter().any(|(kept, _)| kept == hash)
    }

    fn sample(&self, request: &SampleWork) -> Result<Vec<DepthImage>, EngineError> {
        let scene = self.scene(&request.scene_hash)?;
        let work = sampling::SampleWork {
            scene: &scene,
            cameras: &request.cameras,
            method: parsed("sampling_method", &request.sampling)?,
            lighting: parsed("lighting", &request.lighting)?,
            scene_time_s: request.scene_time_s,
            planes: SamplePlanes::default(),
        };
        self.sampler.sample(&work).map_err(|SamplingError::Render(error)| render_error(error))
    }

    fn upload(&self, set: &SampleSet) -> Result<Arc<dyn UploadedSet>, EngineError> {
        let uploaded = self.reconstructor.upload(&set.images, &set.volume, set.background_linear);
        Ok(Arc::new(Uploaded(uploaded.map_err(reconstruction_error)?)))
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork) -> Result<Vec<View>, EngineError> {
        let Uploaded(set) = (set as &dyn Any).downcast_ref().ok_or_else(|| device("a sample set of another device"))?;
        let method: ReconstructionMethod = parsed("reconstruction_method", &work.method)?;
        self.reconstructor.reconstruct(set, &work.cameras, method, work.planes).map_err(reconstruction_error)
    }

    fn draw_direct(&self, work: &DirectWork) -> Result<Vec<View>, EngineError> {
        let scene = self.scene(&work.scene_hash)?;
        let draw =
            DrawWork { scene: &scene, lighting: parsed("lighting", &work.lighting)?, scene_time_s: work.scene_time_s };
        self.rasterizer.draw_views(draw, &work.cameras, work.planes).map_err(render_error)
    }
}
