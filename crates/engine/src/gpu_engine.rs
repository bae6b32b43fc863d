//! The device behind a node: [`node::Engine`] over the drawing, sampling and reconstruction crates.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Weak};
use std::time::Instant;

use depth_image::{DepthImage, PinholeCamera, View};
use gpu::{DevicePreference, Gpu};
use node::{DirectWork, Engine, EngineError, SampleSet, SampleWork, UploadedSet, ViewWork};
use parking_lot::Mutex;
use reconstruction::{ReconstructionMethod, Reconstructor, RequiredPlanes, SetDescription};
use render::{
    AccelerationReport, Choice, DrawWork, GpuScene, Lighting, Refinement, Renderer, SamplePlanes, Visibility,
};
use sampling::{Sampler, SamplingMethod};
use scene::{Limits, Scene};

use crate::error::{device, invalid, parsed, reconstruction_error, render_error, sampling_error};

/// The most scenes on the device; the one that was loaded first is evicted first.
const KEPT_SCENES: usize = 8;

/// One device, its pipelines, and the scenes on it.
pub struct GpuEngine {
    gpu: Arc<Gpu>,
    renderer: Arc<Renderer>,
    sampler: Sampler,
    reconstructor: Reconstructor,
    scenes: Mutex<Vec<(String, Arc<GpuScene>)>>,
    /// Batches run one at a time: the device is no faster with several, and memory holds one.
    reconstructing: Mutex<()>,
    /// Scenes load one at a time: nodes of one process need the same scene at the same moment.
    loading: Mutex<()>,
}

/// A sample set on this engine's device.
struct Uploaded(reconstruction::SampleSet);
impl UploadedSet for Uploaded {}

impl GpuEngine {
    /// Opens a device for this engine.
    ///
    /// # Errors
    /// There is no device, or a shader is broken.
    pub fn open(preference: DevicePreference) -> Result<Self, EngineError> {
        let gpu = Gpu::open(preference).map_err(device)?;
        let renderer = Arc::new(sampling::renderer(&gpu).map_err(render_error)?);
        Ok(Self {
            sampler: Sampler::sharing(renderer.clone()),
            reconstructor: Reconstructor::new(&gpu).map_err(reconstruction_error)?,
            renderer,
            gpu,
            scenes: Mutex::default(),
            reconstructing: Mutex::default(),
            loading: Mutex::default(),
        })
    }

    /// The engine that all nodes of this process share; it closes with the last of them.
    ///
    /// # Errors
    /// There is no device, or a shader is broken.
    pub fn shared(preference: DevicePreference) -> Result<Arc<Self>, EngineError> {
        static OPEN: Mutex<Option<HashMap<String, Weak<GpuEngine>>>> = Mutex::new(None);
        let mut open = OPEN.lock();
        let engines = open.get_or_insert_default();
        if let Some(engine) = engines.get(&preference.to_string()).and_then(Weak::upgrade) {
            return Ok(engine);
        }
        let engine = Arc::new(Self::open(preference)?);
        engines.insert(preference.to_string(), Arc::downgrade(&engine));
        Ok(engine)
    }

    /// Uploads a scene under the hash of its package, unless it is there; returns the seconds spent.
    ///
    /// # Errors
    /// The device cannot hold the scene.
    pub fn put_scene(&self, hash: &str, scene: &Scene) -> Result<f64, EngineError> {
        let _one = self.loading.lock();
        if self.has_scene(hash) {
            return Ok(0.0);
        }
        let start = Instant::now();
        let uploaded = Arc::new(GpuScene::upload(&self.gpu, scene).map_err(render_error)?);
        let mut scenes = self.scenes.lock();
        if scenes.len() >= KEPT_SCENES {
            scenes.remove(0);
        }
        scenes.push((hash.to_owned(), uploaded));
        Ok(start.elapsed().as_secs_f64())
    }

    /// The pipelines that reconstruct, for measurements without a service in between.
    #[must_use]
    pub fn reconstructor(&self) -> &Reconstructor {
        &self.reconstructor
    }

    /// The renderer, for measurements without a service in between.
    #[must_use]
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// The renderer, to be shared with another sampler.
    #[must_use]
    pub fn shared_renderer(&self) -> Arc<Renderer> {
        self.renderer.clone()
    }

    /// The renderer's choice between triangles and rays for pictures of a camera's size, with both costs.
    ///
    /// # Errors
    /// The scene is not loaded, or the device fails.
    pub fn visibility_choice(&self, hash: &str, camera: &PinholeCamera) -> Result<Choice, EngineError> {
        self.renderer.choice(&*self.scene(hash)?, camera, 0.0).map_err(render_error)
    }

    /// The tree that rays traverse.
    ///
    /// # Errors
    /// The scene is not loaded, or does not fit the device.
    pub fn acceleration(&self, hash: &str, scene_time_s: f32) -> Result<AccelerationReport, EngineError> {
        self.scene(hash)?.acceleration(scene_time_s).map_err(render_error)
    }

    /// A scene on the device.
    ///
    /// # Errors
    /// The scene was never loaded.
    pub fn scene(&self, hash: &str) -> Result<Arc<GpuScene>, EngineError> {
        let found = self.scenes.lock().iter().find(|(kept, _)| kept == hash).map(|(_, scene)| scene.clone());
        found.ok_or_else(|| EngineError::UnknownScene { hash: hash.to_owned() })
    }
}

/// The planes that a reconstruction method needs in sample images.
#[must_use]
pub fn planes_for(method: ReconstructionMethod) -> SamplePlanes {
    let RequiredPlanes { normal, corner_inverse_depth } = method.required_planes();
    SamplePlanes { specular: true, normal, corners: corner_inverse_depth, ..SamplePlanes::default() }
}

fn draw_work(scene: &GpuScene, lighting: Lighting, scene_time_s: f32) -> DrawWork<'_> {
    let (visibility, refinement) = (Visibility::Measured, Refinement::default());
    DrawWork { scene, lighting, scene_time_s, visibility, refinement }
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
        self.scenes.lock().iter().any(|(kept, _)| kept == hash)
    }

    fn images_are_sequential(&self, sampling: &str) -> Result<bool, EngineError> {
        Ok(parsed::<SamplingMethod>("sampling_method", sampling)?.images_are_sequential())
    }

    fn images_are_independent(&self, sampling: &str) -> Result<bool, EngineError> {
        Ok(parsed::<SamplingMethod>("sampling_method", sampling)?.images_are_independent())
    }

    fn sample(&self, request: &SampleWork) -> Result<Vec<DepthImage>, EngineError> {
        let scene = self.scene(&request.scene_hash)?;
        let cluster::Refinement { step, steps } = request.refinement;
        let draw = DrawWork {
            refinement: Refinement { step, steps },
            ..draw_work(&scene, parsed("lighting", &request.lighting)?, request.scene_time_s)
        };
        let method: ReconstructionMethod = parsed("reconstruction_method", &request.method)?;
        let work = sampling::SampleWork {
            draw,
            cameras: &request.cameras,
            wanted: &request.wanted,
            method: parsed("sampling_method", &request.sampling)?,
            planes: planes_for(method),
            temporal_reference_s: request.temporal_reference_s,
        };
        self.sampler.sample(&work).map_err(sampling_error)
    }

    fn upload(&self, set: &SampleSet) -> Result<Arc<dyn UploadedSet>, EngineError> {
        let lighting: Lighting = parsed("lighting", &set.lighting)?;
        let description = SetDescription {
            volume: set.volume,
            background_linear: set.background_linear,
            illumination: &set.illumination,
            highlight: lighting.highlight(),
        };
        let uploaded = self.reconstructor.upload(&set.images, &description);
        Ok(Arc::new(Uploaded(uploaded.map_err(reconstruction_error)?)))
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork) -> Result<Vec<View>, EngineError> {
        let Uploaded(set) = (set as &dyn Any).downcast_ref().ok_or_else(|| device("a sample set of another device"))?;
        let method: ReconstructionMethod = parsed("reconstruction_method", &work.method)?;
        let _one = self.reconstructing.lock();
        self.reconstructor.reconstruct(set, &work.cameras, method, work.planes).map_err(reconstruction_error)
    }

    fn draw_direct(&self, work: &DirectWork) -> Result<Vec<View>, EngineError> {
        let scene = self.scene(&work.scene_hash)?;
        let draw = draw_work(&scene, parsed("lighting", &work.lighting)?, work.scene_time_s);
        self.renderer.draw_views(draw, &work.cameras, work.planes).map_err(render_error)
    }
}
