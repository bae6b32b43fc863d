//! The device behind a node: [`node::Engine`] over the drawing, sampling and reconstruction crates.

use std::any::Any;
use std::collections::BTreeMap;
use std::str::FromStr;
use std::sync::{Arc, Weak};

use bands::{BAND_PIXELS, views_in_bands};
use cluster::{CommonKind, DIRECT, SamplePlanes};
use depth_image::{
    Aabb, Camera, DepthImage, LightCacheQuality, PinholeCamera, ProvenanceKind, SampleCamera, SampleImage,
    SampleImages, View, ViewPlanes,
};
use gpu::{DevicePreference, Gpu, GpuError};
use lamp_samples::{LampError, LampPipelines, LampSamples, LampScene, Lamps, MOST_LAMPS};
use node::{
    CommonSet, DirectWork, Engine, EngineError, LightParts, OpenEngine, SampleSet, SampleWork, SharedSet, Turn,
    UploadedSet, ViewWork, own_time,
};
use parking_lot::Mutex;
use reconstruction::{
    CommonSets, MirrorCell, Mirrors, ReconstructRequest, ReconstructionError, ReconstructionMethod, Reconstructor,
    SetDescription,
};
use render::{DrawWork, GpuScene, LightCache, Lighting, RenderError, Renderer, Visibility};
use sampling::{Sampler, SamplingError, SamplingMethod};
use scene::{Limits, Scene};
use scene_cache::SceneCache;

mod bands;
mod lamp_samples;
mod scene_cache;

pub use lamp_samples::{LampSampling, UnknownLampSampling};

/// The bound of scenes' memory where none is given.
const SCENE_BYTES: u64 = 2 << 30;

/// One device, its pipelines, and the scenes on it.
pub struct GpuEngine {
    gpu: Arc<Gpu>,
    preference: DevicePreference,
    /// The pipelines that draw, for measurements without a service in between.
    pub renderer: Arc<Renderer>,
    sampler: Sampler,
    /// The pipelines that reconstruct, for measurements without a service in between.
    pub reconstructor: Reconstructor,
    scenes: SceneCache,
    lamp_samples: LampSamples,
    /// Scenes load one at a time: nodes of one process need the same scene at the same moment.
    loading: Mutex<()>,
}

/// Samples of light, with the scene that they are of.
struct UploadedLight {
    cache: LightCache,
    scene_hash: String,
    lighting: Lighting,
    scene_time_s: f32,
    /// Views of at most so many pixels find surfaces by rays.
    traced_pixel_count: Option<u32>,
}

impl UploadedLight {
    /// How surfaces of views of so many pixels are found; `None` where nobody measured it.
    fn by_rays(&self, pixels: usize) -> Option<bool> {
        self.traced_pixel_count.map(|most| pixels <= most as usize)
    }
}

/// A set of images, with those of common cells.
struct UploadedImages {
    set: Arc<reconstruction::SampleSet>,
    /// Mirrors that a ray meets one after the other in this light.
    reflections: u32,
    /// Rays of what rough surfaces show.
    glossy_rays: u32,
    /// What mirrors show.
    mirrors: Vec<(Aabb, Arc<reconstruction::SampleSet>)>,
    /// What tells where its images leave anything unknown.
    base: Option<Arc<reconstruction::SampleSet>>,
    /// What comes before its images.
    blocks: Vec<Arc<reconstruction::SampleSet>>,
}

impl UploadedSet for UploadedImages {}
impl UploadedSet for UploadedLight {}

/// The images of a set; fails for samples of light, and for a set of another device.
fn images(set: &dyn UploadedSet) -> Result<&UploadedImages, EngineError> {
    if (set as &dyn Any).is::<UploadedLight>() {
        let reason =
            "views that take light from samples have no mirror cells, base or blocks; leave out --base and --blocks";
        return Err(invalid("common_cells", reason));
    }
    (set as &dyn Any).downcast_ref().ok_or_else(|| device("a sample set of another device"))
}

impl GpuEngine {
    /// Opens a device for this engine.
    ///
    /// # Errors
    /// There is no device, or a shader is broken.
    pub fn open(preference: DevicePreference) -> Result<Self, EngineError> {
        let gpu = Gpu::open(preference).map_err(device)?;
        let renderer = Arc::new(sampling::renderer(&gpu).map_err(Caught::from)?);
        Ok(Self {
            sampler: Sampler::sharing(renderer.clone()),
            reconstructor: Reconstructor::new(&gpu).map_err(Caught::from)?,
            renderer,
            gpu,
            preference,
            scenes: SceneCache::new(SCENE_BYTES, GpuScene::bytes),
            lamp_samples: LampSamples::default(),
            loading: Mutex::default(),
        })
    }

    /// The engine that all nodes of this process share; it closes with the last of them.
    ///
    /// # Errors
    /// There is no device, or a shader is broken.
    pub fn shared(preference: DevicePreference) -> Result<Arc<Self>, EngineError> {
        static OPEN: Mutex<BTreeMap<String, Weak<GpuEngine>>> = Mutex::new(BTreeMap::new());
        let mut open = OPEN.lock();
        if let Some(engine) = open.get(&preference.to_string()).and_then(Weak::upgrade) {
            return Ok(engine);
        }
        let engine = Arc::new(Self::open(preference)?);
        open.insert(preference.to_string(), Arc::downgrade(&engine));
        Ok(engine)
    }

    /// Gives nodes this engine; one with a new device and the same bound of scenes once this device is lost. It holds no
    /// engine that a node has: a lost one closes with the last node that leaves it.
    #[must_use]
    pub fn opener(self: Arc<Self>) -> OpenEngine {
        let preference = self.preference;
        let scene_bytes = self.scenes.max_bytes();
        let lamp_sampling = *self.lamp_samples.sampling.lock();
        let first = Arc::downgrade(&self);
        let open = Mutex::new((Some(self), first));
        Arc::new(move || {
            let (unused, open) = &mut *open.lock();
            let last = unused.take().or_else(|| open.upgrade()).filter(|engine| !engine.gpu.is_lost());
            let engine = match last {
                Some(engine) => engine,
                None => Arc::new(Self::open(preference)?),
            };
            engine.scenes.set_max_bytes(scene_bytes);
            engine.set_lamp_sampling(lamp_sampling);
            *open = Arc::downgrade(&engine);
            Ok(engine)
        })
    }

    /// Bounds the memory of scenes to come, in bytes. One in use stays, and one beyond the bound is there alone.
    pub fn bound_scenes(&self, bytes: usize) {
        self.scenes.set_max_bytes(bytes as u64);
    }

    /// Says how lamps are sampled for light of a grid by samples, and how large shadow maps are.
    pub fn set_lamp_sampling(&self, sampling: LampSampling) {
        *self.lamp_samples.sampling.lock() = sampling;
    }

    /// The lamps for a light: those of others than by samples have no images.
    fn lamps(&self, of: LampScene<'_>, lighting: Lighting) -> Result<Lamps<'_>, EngineError> {
        let pipelines =
            LampPipelines { renderer: &self.renderer, sampler: &self.sampler, reconstructor: &self.reconstructor };
        self.catching(|| self.lamp_samples.lamps(pipelines, of, lighting))
    }

    /// Which places of the grid on each lamp the surface of each pixel sees, as [`Renderer::draw_lamp_bits`].
    ///
    /// # Errors
    /// The scene was never loaded, has no lamps for this light, or the device.
    pub fn lamp_bits(&self, hash: &str, lighting: Lighting, camera: &PinholeCamera) -> Result<Vec<u32>, EngineError> {
        let scene = self.scene(hash)?;
        let lamps = self.lamps(LampScene { hash, scene: &scene, time_s: 0.0, turn: Turn::default() }, lighting)?;
        let draw = draw_work(&scene, lighting, 0.0, Some(true), Turn::default());
        self.catching(|| self.renderer.draw_lamp_bits(DrawWork { lamp_maps: lamps.maps(), ..draw }, camera))
    }

    /// Uploads a scene under the hash of its package, unless it is there.
    ///
    /// # Errors
    /// The device cannot hold the scene.
    pub fn put_scene(&self, hash: &str, scene: &Scene) -> Result<(), EngineError> {
        let _one = self.loading.lock();
        if self.has_scene(hash) {
            return Ok(());
        }
        self.scenes.put(hash, self.catching(|| GpuScene::upload(&self.gpu, scene))?);
        Ok(())
    }

    /// Does work on the device on this thread, and turns its errors and faults of the device into errors of engines.
    fn catching<T, E: Into<Caught>>(&self, work: impl FnOnce() -> Result<T, E>) -> Result<T, EngineError> {
        self.gpu.catching(|| work().map_err(Into::<Caught>::into)).map_err(EngineError::from)
    }

    /// A scene on the device.
    ///
    /// # Errors
    /// The scene was never loaded.
    pub fn scene(&self, hash: &str) -> Result<Arc<GpuScene>, EngineError> {
        self.scenes.get(hash).ok_or_else(|| EngineError::UnknownScene { hash: hash.to_owned() })
    }

    /// Images of a cube, and its light field: that shows mirrors, and is lit with what they show.
    fn sample_cube(
        &self,
        request: &SampleWork,
        draw: DrawWork<'_>,
        mirrored: Lighting,
        method: SamplingMethod,
    ) -> Result<Vec<SampleImage>, EngineError> {
        let wanted = request.wanted.iter().filter_map(|&tile| request.camera_of_tile(tile));
        let images = wanted.map(|camera| match &camera {
            SampleCamera::Layered(camera) => {
                let kept = method.layer_selection();
                let kept = kept.ok_or_else(|| SamplingError::Cameras { method: method.to_string() })?;
                Ok(SampleImage::Layered(self.renderer.draw_layers(draw, camera, kept)?))
            }
            SampleCamera::LightField(camera) => {
                let draw = DrawWork { lighting: mirrored, ..draw };
                Ok(SampleImage::LightField(self.renderer.draw_light_field(draw, camera)?))
            }
            SampleCamera::Depth(_) => Err(SamplingError::Lines { method: method.to_string() }),
        });
        self.catching(|| images.collect())
    }

    fn upload_light(
        &self,
        set: &SampleSet,
        lighting: Lighting,
        images: &[DepthImage],
        turn: Turn,
    ) -> Result<SharedSet, EngineError> {
        let scene = self.scene(&set.scene_hash)?;
        let cache = self.catching(|| self.renderer.upload_light(&scene, lighting, images, turn))?;
        Ok(Arc::new(UploadedLight {
            cache,
            scene_hash: set.scene_hash.clone(),
            lighting,
            scene_time_s: set.scene_time_s,
            traced_pixel_count: set.traced_pixel_count,
        }))
    }

    /// The seconds of work on this thread that has been done once before.
    fn warm_time<T>(&self, work: impl Fn() -> Result<T, EngineError>) -> Result<f64, EngineError> {
        work()?;
        let (done, seconds) = own_time(self, work);
        done.map(|_| seconds)
    }

    /// Views whose surfaces come from the scene and whose light comes from samples.
    fn draw_cached(
        &self,
        light: &UploadedLight,
        method: ReconstructionMethod,
        work: &ViewWork,
        turn: Turn,
    ) -> Result<Vec<View>, EngineError> {
        let quality = method.light_cache_quality().ok_or_else(|| {
            invalid("reconstruction_method", format!("the samples have light where {method} needs colour"))
        })?;
        let UploadedLight { cache, scene_hash, lighting, scene_time_s, .. } = light;
        let scene = self.scene(scene_hash)?;
        let pixels = work.cameras.first().map_or(0, PinholeCamera::pixel_count);
        let of = LampScene { hash: scene_hash, scene: &scene, time_s: *scene_time_s, turn };
        let lamps = self.lamps(of, *lighting)?;
        let draw = draw_work(&scene, *lighting, *scene_time_s, light.by_rays(pixels), turn);
        let draw = DrawWork { lamp_maps: lamps.maps(), ..draw };
        views_in_bands(&work.cameras, BAND_PIXELS, |cameras| {
            self.catching(|| self.renderer.draw_cached_views(draw, cache, quality, cameras, work.planes))
        })
    }
}

/// Work of a scene at a moment, with finished light. Surfaces are found as asked, or else by whichever way is faster here.
fn draw_work(
    scene: &GpuScene,
    lighting: Lighting,
    scene_time_s: f32,
    surfaces_by_rays: Option<bool>,
    turn: Turn,
) -> DrawWork<'_> {
    let visibility = match surfaces_by_rays {
        Some(true) => Visibility::Rays,
        Some(false) => Visibility::Triangles,
        None => Visibility::Measured,
    };
    DrawWork { scene_time_s, visibility, turn, ..DrawWork::new(scene, lighting) }
}

impl Engine for GpuEngine {
    fn device_name(&self) -> String {
        self.gpu.name()
    }

    fn is_software(&self) -> bool {
        self.gpu.is_software()
    }

    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<(), EngineError> {
        let scene = scene::unpack(package, &Limits::default()).map_err(|error| invalid("package", error))?;
        self.put_scene(hash, &scene)
    }

    fn has_scene(&self, hash: &str) -> bool {
        self.scenes.get(hash).is_some()
    }

    fn images_are_sequential(&self, sampling: &str) -> Result<bool, EngineError> {
        Ok(parsed::<SamplingMethod>("sampling_method", sampling)?.images_are_sequential())
    }

    fn images_are_independent(&self, sampling: &str) -> Result<bool, EngineError> {
        Ok(parsed::<SamplingMethod>("sampling_method", sampling)?.images_are_independent())
    }

    fn sample_planes(&self, method: &str) -> Result<SamplePlanes, EngineError> {
        if method == DIRECT {
            return Ok(SamplePlanes::default());
        }
        let method: ReconstructionMethod = parsed("reconstruction_method", method)?;
        Ok(SamplePlanes {
            normals: method.needs_corners(),
            corner_inverse_depths: method.needs_corners(),
            light: method.light_cache_quality().is_some(),
        })
    }

    fn preview_lighting(&self, lighting: &str) -> Result<String, EngineError> {
        Ok(parsed::<Lighting>("lighting", lighting)?.with_at_most_rays(std::num::NonZeroU32::MIN).to_string())
    }

    fn live_stream(&self) -> Box<dyn Any + Send + Sync> {
        Box::new(self.gpu.device_queue.live_stream())
    }

    fn waited_s(&self) -> f64 {
        gpu::waited_s()
    }

    fn sample(&self, request: &SampleWork, turn: Turn) -> Result<Vec<SampleImage>, EngineError> {
        let scene = self.scene(&request.scene_hash)?;
        let mirrored: Lighting = parsed("lighting", &request.lighting)?;
        // What mirrors show is each view's own.
        let lighting = mirrored.without_reflections().unwrap_or(mirrored);
        let of = LampScene { hash: &request.scene_hash, scene: &scene, time_s: request.scene_time_s, turn };
        let lamps = self.lamps(of, lighting)?;
        let draw = DrawWork {
            refinement: request.refinement,
            lamp_maps: lamps.maps(),
            ..draw_work(&scene, lighting, request.scene_time_s, request.surfaces_by_rays, turn)
        };
        let method: SamplingMethod = parsed("sampling_method", &request.sampling)?;
        if request.cameras.iter().any(|camera| camera.depth().is_none()) {
            if request.planes.light {
                let reason = "light is taken from the images of view cells, not from a layered cube";
                return Err(invalid("reconstruction_method", reason));
            }
            return self.sample_cube(request, draw, mirrored, method);
        }
        let cameras: Vec<Camera> = request.cameras.iter().filter_map(SampleCamera::depth).copied().collect();
        let SamplePlanes { normals: normal, corner_inverse_depths: corners, light } = request.planes;
        let work = sampling::SampleWork {
            draw,
            cameras: &cameras,
            tile_count: request.tile_count,
            wanted: &request.wanted,
            method,
            planes: render::SamplePlanes { specular: true, normal, corners, light, ..Default::default() },
        };
        let images = self.catching(|| self.sampler.sample(&work))?;
        Ok(images.into_iter().map(SampleImage::Depth).collect())
    }

    fn upload(&self, set: &SampleSet, turn: Turn) -> Result<SharedSet, EngineError> {
        let lighting: Lighting = parsed("lighting", &set.lighting)?;
        let images = set.images.depth();
        if images.iter().any(|image| image.light.is_some()) {
            return self.upload_light(set, lighting, images, turn);
        }
        let environment = match set.illumination.environment.is_mapped {
            true => {
                let map = self.scene(&set.scene_hash)?.environment.clone();
                Some(map.ok_or_else(|| invalid("illumination", "the scene has no environment map"))?)
            }
            false => None,
        };
        let description = SetDescription {
            volume: set.volume,
            background: set.background,
            illumination: &set.illumination,
            highlight: lighting.highlight(),
            environment: environment.as_ref(),
            mips: set.is_common,
        };
        let set = self.catching(|| match &set.images {
            SampleImages::Depth(images) => self.reconstructor.upload(images, &description, turn),
            SampleImages::Cube(cube) => self.reconstructor.upload_cube(cube, &description, turn),
        })?;
        Ok(Arc::new(UploadedImages {
            set: Arc::new(set),
            reflections: lighting.reflections(),
            glossy_rays: lighting.glossy_rays(),
            mirrors: Vec::new(),
            base: None,
            blocks: Vec::new(),
        }))
    }

    fn with_common(&self, set: SharedSet, common: Vec<CommonSet>) -> Result<SharedSet, EngineError> {
        let &UploadedImages { ref set, reflections, glossy_rays, .. } = images(set.as_ref())?;
        let mut mirrors = Vec::new();
        let mut base = None;
        let mut blocks = Vec::new();
        for (cell, common) in common {
            let common = images(common.as_ref())?.set.clone();
            match cell.kind {
                CommonKind::Mirrors => mirrors.push((cell.bounds, common)),
                CommonKind::Base => base = Some(common),
                CommonKind::Block => blocks.push(common),
            }
        }
        Ok(Arc::new(UploadedImages { set: set.clone(), reflections, glossy_rays, mirrors, base, blocks }))
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork, turn: Turn) -> Result<Vec<View>, EngineError> {
        let method: ReconstructionMethod = parsed("reconstruction_method", &work.method)?;
        if let Some(light) = (set as &dyn Any).downcast_ref() {
            return self.draw_cached(light, method, work, turn);
        }
        let UploadedImages { set, reflections, glossy_rays, mirrors, base, blocks } = images(set)?;
        let cells = mirrors.iter().map(|(bounds, shown)| MirrorCell { bounds: *bounds, surroundings: shown });
        let cells: Vec<MirrorCell<'_>> = cells.collect();
        let mirrors = Mirrors { cells: &cells, reflections: *reflections, glossy_rays: *glossy_rays };
        let blocks: Vec<&reconstruction::SampleSet> = blocks.iter().map(Arc::as_ref).collect();
        let common = CommonSets { mirrors, base: base.as_deref(), blocks: &blocks };
        views_in_bands(&work.cameras, BAND_PIXELS, |cameras| {
            let request = ReconstructRequest::new(set, cameras, method);
            let request = ReconstructRequest { common, turn, planes: work.planes, ..request };
            self.catching(|| self.reconstructor.reconstruct(request))
        })
    }

    fn light_parts(
        &self,
        set: &dyn UploadedSet,
        work: &ViewWork,
        turn: Turn,
    ) -> Result<Option<LightParts>, EngineError> {
        let Some(light) = (set as &dyn Any).downcast_ref::<UploadedLight>() else { return Ok(None) };
        let method: ReconstructionMethod = parsed("reconstruction_method", &work.method)?;
        let with_provenance = ViewWork { planes: ViewPlanes { provenance: true, ..work.planes }, ..work.clone() };
        let views = self.draw_cached(light, method, &with_provenance, turn)?;
        let scene = self.scene(&light.scene_hash)?;
        let pixels = work.cameras.first().map_or(0, PinholeCamera::pixel_count);
        let by_rays = light.by_rays(pixels);
        let unlit = draw_work(&scene, Lighting::UNLIT, light.scene_time_s, by_rays, turn);
        let draw = || self.renderer.draw_views(unlit, &work.cameras, work.planes);
        let draft = ReconstructionMethod::from(LightCacheQuality::Draft);
        Ok(Some(LightParts {
            known_ratio: known_ratio(&views),
            surfaces_s: self.warm_time(|| self.catching(draw))?,
            draft_s: self.warm_time(|| self.draw_cached(light, draft, work, turn))?,
        }))
    }

    fn traced_pixel_count(&self, work: &DirectWork, turn: Turn) -> Result<Option<u32>, EngineError> {
        let scene = self.scene(&work.scene_hash)?;
        let Some(camera) = work.cameras.first() else { return Ok(None) };
        let draw = draw_work(&scene, parsed("lighting", &work.lighting)?, work.scene_time_s, None, turn);
        self.catching(|| self.renderer.traced_pixel_count(draw, camera)).map(Some)
    }

    fn draw_direct(&self, work: &DirectWork, turn: Turn) -> Result<Vec<View>, EngineError> {
        let scene = self.scene(&work.scene_hash)?;
        let lighting: Lighting = parsed("lighting", &work.lighting)?;
        let of = LampScene { hash: &work.scene_hash, scene: &scene, time_s: work.scene_time_s, turn };
        let lamps = self.lamps(of, lighting)?;
        let draw = draw_work(&scene, lighting, work.scene_time_s, work.surfaces_by_rays, turn);
        let draw = DrawWork { lamp_maps: lamps.maps(), ..draw };
        views_in_bands(&work.cameras, BAND_PIXELS, |cameras| {
            self.catching(|| self.renderer.draw_views(draw, cameras, work.planes))
        })
    }
}

/// The share of the points with a surface whose light samples know; 1 where no pixel shows a surface.
fn known_ratio(views: &[View]) -> f64 {
    let kinds = views.iter().filter_map(|view| view.provenance.as_ref()).flatten().map(|provenance| provenance.kind());
    let surfaces: Vec<ProvenanceKind> = kinds.filter(|kind| *kind != ProvenanceKind::Empty).collect();
    let unknown = surfaces.iter().filter(|kind| **kind == ProvenanceKind::LitHere).count();
    1.0 - unknown as f64 / surfaces.len().max(1) as f64
}

fn device(error: impl ToString) -> EngineError {
    EngineError::Device(error.to_string())
}

fn invalid(field: &'static str, reason: impl ToString) -> EngineError {
    EngineError::InvalidArgument { field, reason: reason.to_string() }
}

/// An error of work that is done while faults of the device are caught.
struct Caught(EngineError);

impl From<Caught> for EngineError {
    fn from(Caught(error): Caught) -> Self {
        error
    }
}

impl From<GpuError> for Caught {
    fn from(error: GpuError) -> Self {
        Self(match error {
            GpuError::Lost(reason) => EngineError::Lost(reason),
            GpuError::OutOfMemory(reason) => EngineError::OutOfMemory(reason),
            _ => device(error),
        })
    }
}

impl From<RenderError> for Caught {
    fn from(error: RenderError) -> Self {
        Self(match error {
            RenderError::Camera { .. } | RenderError::Model { .. } => invalid("camera", error),
            RenderError::Samples { .. } => invalid("sample_images", error),
            RenderError::LampSamples { .. } => invalid("lighting", error),
            RenderError::LampMaps { .. } => device(error),
            RenderError::Gpu(error) => return error.into(),
            RenderError::Shader(_) => device(error),
        })
    }
}

impl From<ReconstructionError> for Caught {
    fn from(error: ReconstructionError) -> Self {
        use ReconstructionError as Error;
        let field = match error {
            Error::Gpu(error) => return error.into(),
            Error::Shader(_) | Error::MissingPlane { .. } => return Self(device(error)),
            Error::Camera { .. } => "camera",
            Error::Volume => "volume",
            Error::NoSamples { .. } | Error::NoScene { .. } => "reconstruction_method",
            Error::Blocks { .. } => "common_cells of blocks",
            Error::MirrorCells(_) => "common_cells of mirrors",
            Error::Reflections(_) => "reflections",
            Error::Sample { .. }
            | Error::SampleCount(_)
            | Error::Model { .. }
            | Error::LightForColor { .. }
            | Error::CurvedSearch { .. }
            | Error::LightField { .. } => "sample_images",
        };
        Self(invalid(field, error))
    }
}

impl From<LampError> for Caught {
    fn from(error: LampError) -> Self {
        let reason = "soft NxN by samples needs a rectangle light that shines on the scene, and there is none";
        match error {
            LampError::NoRectangle => Self(invalid("lighting", reason)),
            LampError::Rectangles { count } => {
                let reason = format!(
                    "soft NxN by samples takes at most {MOST_LAMPS} rectangle lights, and the scene has {count}"
                );
                Self(invalid("lighting", reason))
            }
            LampError::Bounds(error) => Self(invalid("lighting", format!("the scene has no layered cube: {error}"))),
            LampError::Render(error) => error.into(),
            LampError::Sampling(error) => error.into(),
            LampError::Reconstruction(error) => error.into(),
        }
    }
}

impl From<SamplingError> for Caught {
    fn from(error: SamplingError) -> Self {
        let field = match error {
            SamplingError::Render(error) => return error.into(),
            SamplingError::Layer { .. } | SamplingError::Lines { .. } => "sample_cameras",
            SamplingError::Cameras { .. } | SamplingError::Positions { .. } => "sampling_method",
            SamplingError::Selection { .. } => "image_indices",
        };
        Self(invalid(field, error))
    }
}

/// Parses a setting.
fn parsed<T: FromStr<Err: ToString>>(field: &'static str, text: &str) -> Result<T, EngineError> {
    text.parse().map_err(|error: T::Err| invalid(field, error.to_string()))
}
