//! Views from sample sets, in batches: tile starts, the method, and the fill, in one submission each.

mod bindings;
mod in_flight;

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use depth_image::{DepthImage, PinholeCamera, View, ViewPlanes};
use glam::{UVec2, Vec3};
use gpu::{BufferPool, Frame, Gpu, PooledBuffer, Templates};
use wgpu::{BindingResource, BufferUsages};

use self::in_flight::{InFlight, Reads};
use crate::{
    ReconstructionError, ReconstructionMethod, SHADERS, SampleSet, SetDescription, ShaderKey,
    layout::{GpuFillWork, GpuList, GpuSampleCamera, GpuViewCamera, GpuViewWork},
    quad_drawing::{QuadDrawing, Targets},
    shader_text,
    word_texture::WordTextures,
};

const TILE_PX: u32 = 8;
/// Bounds the memory of a batch: 12 bytes a pixel on the device, up to as much again on the host.
const PIXELS_A_BATCH: usize = 1 << 20;
const MAX_VIEWS_A_BATCH: usize = 256;
/// Marches in the nearest two cameras, and the carve.
const MAX_PASSES: usize = 3;
/// Uniform offsets must be multiples of this on every device.
const UNIFORM_ALIGNMENT: u32 = 256;
const FILL_STRIDE: u32 = UNIFORM_ALIGNMENT;

/// Device time and fetches of a reconstruction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Statistics {
    /// Seconds on the device, all batches.
    pub device_s: f64,
    /// Mean loads of depth and colour words a pixel, where counted.
    pub fetches_per_ray: Option<f64>,
}

/// Pipelines for every method and number of cameras that has been asked for.
pub struct Reconstructor {
    pub(crate) gpu: Arc<Gpu>,
    pub(crate) pool: BufferPool,
    textures: WordTextures,
    pub(crate) templates: Templates,
    pipelines: Mutex<HashMap<ShaderKey, Arc<wgpu::ComputePipeline>>>,
    pub(crate) drawing: QuadDrawing,
}

/// Views of one size that are made together, and what that takes on the device.
struct Batch {
    size_px: UVec2,
    tiles: UVec2,
    count: usize,
    /// Of one plane of all views.
    bytes: u64,
    /// Between the views' uniforms.
    stride: u32,
    works: wgpu::Buffer,
    starts: PooledBuffer,
    /// sRGB, inverse depth, provenance and, where counted, fetches.
    outputs: Vec<PooledBuffer>,
    /// What each pass leaves to the next.
    list_pixels: [PooledBuffer; MAX_PASSES],
    lists: [wgpu::Buffer; MAX_PASSES],
}

/// In [`Batch::outputs`], after the planes.
const FETCHES: usize = 3;

impl Batch {
    /// What all passes over sample cameras begin with.
    fn over<'b>(&'b self, set: &'b SampleSet) -> Vec<BindingResource<'b>> {
        let textures = [&set.nodes, &set.cell_codes].map(|texture| BindingResource::TextureView(texture));
        [self.works.as_entire_binding()].into_iter().chain(textures).collect()
    }

    fn list(&self, pass: usize) -> [BindingResource<'_>; 2] {
        [self.list_pixels[pass].as_entire_binding(), self.lists[pass].as_entire_binding()]
    }
}

impl Reconstructor {
    /// Pipelines are built when first used.
    ///
    /// # Errors
    /// When a shader template is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, ReconstructionError> {
        Ok(Self {
            gpu: gpu.clone(),
            pool: BufferPool::new(gpu),
            textures: WordTextures::new(gpu),
            templates: Templates::new(SHADERS)?,
            pipelines: Mutex::default(),
            drawing: QuadDrawing::default(),
        })
    }

    /// Puts a sample set on the device.
    ///
    /// # Errors
    /// Images, cameras or a volume that cannot be used, or the device's limits.
    pub fn upload(&self, images: &[DepthImage], set: &SetDescription<'_>) -> Result<SampleSet, ReconstructionError> {
        SampleSet::upload(&self.textures, images, set)
    }

    /// One view a camera, in their order.
    ///
    /// # Errors
    /// A camera that is not valid (all are checked first), or the device.
    pub fn reconstruct(
        &self,
        set: &SampleSet,
        cameras: &[PinholeCamera],
        method: ReconstructionMethod,
        planes: ViewPlanes,
    ) -> Result<Vec<View>, ReconstructionError> {
        self.reconstruct_measured(set, cameras, method, planes, false).map(|(views, _)| views)
    }

    /// As [`Reconstructor::reconstruct`], and what it cost; counting fetches slows it down.
    ///
    /// # Errors
    /// As [`Reconstructor::reconstruct`].
    pub fn reconstruct_measured(
        &self,
        set: &SampleSet,
        cameras: &[PinholeCamera],
        method: ReconstructionMethod,
        planes: ViewPlanes,
        count_fetches: bool,
    ) -> Result<(Vec<View>, Statistics), ReconstructionError> {
        for (index, camera) in cameras.iter().enumerate() {
            camera.validate().map_err(|source| ReconstructionError::Camera { index, source })?;
        }
        let mut views = Vec::with_capacity(cameras.len());
        let mut statistics = Statistics::default();
        let mut in_flight: Option<InFlight<'_>> = None;
        // The device works on one batch while the host takes the one before apart.
        for batch in batches(cameras) {
            let next = self.submit(set, batch, method, planes, count_fetches)?;
            if let Some(done) = in_flight.replace(next) {
                done.finish(&mut views, &mut statistics)?;
            }
        }
        if let Some(done) = in_flight {
            done.finish(&mut views, &mut statistics)?;
        }
        statistics.fetches_per_ray = statistics.fetches_per_ray.map(|sum| sum / cameras.len().max(1) as f64);
        Ok((views, statistics))
    }

    fn submit(
        &self,
        set: &SampleSet,
        cameras: &[PinholeCamera],
        method: ReconstructionMethod,
        planes: ViewPlanes,
        count_fetches: bool,
    ) -> Result<InFlight<'_>, ReconstructionError> {
        let (steps, passes) = passes(method, set, count_fetches);
        let batch = self.batch(set, cameras, steps, count_fetches)?;
        let mut frame = Frame::begin(&self.gpu, "reconstruct");
        if count_fetches {
            frame.encoder.clear_buffer(&batch.outputs[FETCHES], 0, None);
        }
        let drawn = self.draw_mesh(&mut frame, set, cameras, method)?;
        if drawn.is_none() {
            self.find_tile_starts(&mut frame, set, &batch)?;
        }
        for (number, &key) in passes.iter().enumerate() {
            self.find_surfaces(&mut frame, set, &batch, (number, key), drawn.as_deref())?;
        }
        self.fill(&mut frame, &batch, passes.len() - 1)?;
        self.add_highlights(&mut frame, set, &batch)?;
        let reads = self.read(&mut frame, &batch, planes, count_fetches);
        let (size_px, count) = (batch.size_px, batch.count);
        Ok(InFlight { submitted: frame.submit(), reads, size_px, count, _batch: batch })
    }

    fn batch(
        &self,
        set: &SampleSet,
        cameras: &[PinholeCamera],
        steps: u32,
        count_fetches: bool,
    ) -> Result<Batch, ReconstructionError> {
        let (size_px, count) = (cameras[0].size_px, cameras.len());
        let tiles = size_px.map(|side| side.div_ceil(TILE_PX));
        let bytes = 4 * (cameras[0].pixel_count() * count) as u64;
        self.gpu.check_storage_bytes("a batch of views (bytes)", bytes)?;
        let outputs = ["srgb8", "inverse depth", "provenance", "fetches"];
        let list = || {
            let usage = BufferUsages::STORAGE | BufferUsages::INDIRECT;
            self.gpu.buffer_with("lists", &vec![GpuList::EMPTY; count], usage)
        };
        Ok(Batch {
            size_px,
            tiles,
            count,
            bytes,
            stride: view_stride(set),
            works: self.gpu.buffer_with("views", &view_works(set, cameras, tiles, steps), BufferUsages::UNIFORM),
            starts: self.pool.lend_storage("tile starts", 4 * u64::from(tiles.element_product()) * count as u64),
            outputs: outputs[..3 + usize::from(count_fetches)]
                .iter()
                .map(|label| self.pool.lend_storage(label, bytes))
                .collect(),
            list_pixels: [(); MAX_PASSES].map(|()| self.pool.lend_storage("pixels left for later", bytes)),
            lists: [(); MAX_PASSES].map(|()| list()),
        })
    }

    fn find_tile_starts(
        &self,
        frame: &mut Frame<'_>,
        set: &SampleSet,
        batch: &Batch,
    ) -> Result<(), ReconstructionError> {
        let name = "tile_start.wgsl";
        let key = ShaderKey { name, cameras: set.cameras.len(), holes: set.has_holes(), ..ShaderKey::default() };
        let pipeline = self.pipeline(key)?;
        let mut resources = batch.over(set);
        resources.push(batch.starts.as_entire_binding());
        let bound = self.bind(&pipeline, batch.stride, resources);
        let [across, down] = batch.tiles.to_array().map(|tiles| tiles.div_ceil(TILE_PX));
        frame.compute_each(name, &pipeline, &bound, batch.stride, batch.count, [across, down, 1]);
        Ok(())
    }

    /// One pass of the method: the first over all pixels, each other over those that the one before left. `drawn`: what
    /// quads were drawn into, of methods that draw.
    fn find_surfaces(
        &self,
        frame: &mut Frame<'_>,
        set: &SampleSet,
        batch: &Batch,
        (number, key): (usize, ShaderKey),
        drawn: Option<&Targets>,
    ) -> Result<(), ReconstructionError> {
        let pipeline = self.pipeline(key)?;
        let mut resources = batch.over(set);
        resources.push(batch.starts.as_entire_binding());
        resources.extend(batch.outputs[..FETCHES].iter().map(|buffer| buffer.as_entire_binding()));
        resources.extend(batch.list(number));
        resources.push(BindingResource::TextureView(&set.cell_colors));
        resources.extend(batch.outputs.get(FETCHES).map(|buffer| buffer.as_entire_binding()));
        resources.extend(number.checked_sub(1).into_iter().flat_map(|earlier| batch.list(earlier)));
        resources.extend(drawn.into_iter().flat_map(Targets::drawn));
        let bound = self.bind(&pipeline, batch.stride, resources);
        match number.checked_sub(1) {
            None => {
                let groups = [batch.tiles.x, batch.tiles.y, 1];
                frame.compute_each(key.name, &pipeline, &bound, batch.stride, batch.count, groups);
            }
            Some(earlier) => {
                let left = &batch.lists[earlier];
                frame.compute_each_indirect(key.name, &pipeline, &bound, batch.stride, batch.count, left);
            }
        }
        Ok(())
    }

    /// Over what the last pass left.
    fn fill(&self, frame: &mut Frame<'_>, batch: &Batch, last: usize) -> Result<(), ReconstructionError> {
        let pipeline = self.pipeline(ShaderKey { name: "fill.wgsl", ..ShaderKey::default() })?;
        let works = fill_works(batch.size_px, batch.count);
        let works = self.gpu.buffer_with("fill", &works, BufferUsages::UNIFORM);
        let mut resources = vec![works.as_entire_binding()];
        resources.extend(batch.outputs[..FETCHES].iter().map(|buffer| buffer.as_entire_binding()));
        resources.extend(batch.list(last));
        let bound = self.bind(&pipeline, FILL_STRIDE, resources);
        frame.compute_each_indirect("fill", &pipeline, &bound, FILL_STRIDE, batch.count, &batch.lists[last]);
        Ok(())
    }

    /// After the fill, which shall not spread them.
    fn add_highlights(&self, frame: &mut Frame<'_>, set: &SampleSet, batch: &Batch) -> Result<(), ReconstructionError> {
        let Some(reflectors) = &set.reflectors else { return Ok(()) };
        let pipeline = self.pipeline(ShaderKey {
            name: "specular.wgsl",
            cameras: set.cameras.len(),
            holes: set.has_holes(),
            highlight: reflectors.highlight,
            lights: reflectors.lights,
            visibility_words: reflectors.visibility_words,
            ..ShaderKey::default()
        })?;
        let mut resources = batch.over(set);
        resources.extend(batch.outputs[..FETCHES].iter().map(|buffer| buffer.as_entire_binding()));
        resources.push(reflectors.illumination.as_entire_binding());
        resources.push(BindingResource::TextureView(&reflectors.samples));
        let bound = self.bind(&pipeline, batch.stride, resources);
        let groups = [batch.tiles.x, batch.tiles.y, 1];
        frame.compute_each("specular", &pipeline, &bound, batch.stride, batch.count, groups);
        Ok(())
    }

    fn read(&self, frame: &mut Frame<'_>, batch: &Batch, planes: ViewPlanes, count_fetches: bool) -> Reads {
        let host = || self.pool.lend_host("view read-back", batch.bytes);
        let mut read = |index: usize| frame.read_back(&batch.outputs[index], 0..batch.bytes, host());
        Reads {
            srgb8: read(0),
            inverse_depth: planes.inverse_depth.then(|| read(1)),
            provenance: planes.provenance.then(|| read(2)),
            fetches: count_fetches.then(|| read(FETCHES)),
        }
    }

    pub(crate) fn pipeline(&self, key: ShaderKey) -> Result<Arc<wgpu::ComputePipeline>, ReconstructionError> {
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = pipelines.get(&key) {
            return Ok(pipeline.clone());
        }
        let layout = self.layout(key);
        let pipeline =
            Arc::new(self.gpu.compute_pipeline(key.name, &shader_text(&self.templates, key)?, Some(&layout)));
        pipelines.insert(key, pipeline.clone());
        Ok(pipeline)
    }
}

/// Steps for the shaders, and the passes over pixels: the first over all, each other over what the one before
/// left.
fn passes(method: ReconstructionMethod, set: &SampleSet, count_fetches: bool) -> (u32, Vec<ShaderKey>) {
    let cameras = set.cameras.len();
    let key = ShaderKey { cameras, count_fetches, holes: set.has_holes(), ..ShaderKey::default() };
    match method {
        ReconstructionMethod::LightFieldSearch { steps } => {
            (steps, vec![ShaderKey { name: "light_field_search.wgsl", ..key }])
        }
        ReconstructionMethod::JointCarve { stop_level } => {
            let marches = (0..cameras.min(MAX_PASSES - 1)).map(|march_camera| ShaderKey {
                name: "march.wgsl",
                march_camera,
                ..key
            });
            let carve = ShaderKey { name: "joint_carve.wgsl", march_camera: cameras, stop_level, ..key };
            (0, marches.chain([carve]).collect())
        }
        ReconstructionMethod::Mesh | ReconstructionMethod::HybridMesh { .. } => {
            (0, vec![ShaderKey { name: "resolve.wgsl", ..key }])
        }
    }
}

fn view_stride(set: &SampleSet) -> u32 {
    let bytes = size_of::<GpuViewWork>() + set.cameras.len() * size_of::<GpuSampleCamera>();
    (bytes as u32).next_multiple_of(UNIFORM_ALIGNMENT)
}

/// The uniforms of a batch's views, at the stride that dynamic offsets need.
fn view_works(set: &SampleSet, cameras: &[PinholeCamera], tiles: UVec2, steps: u32) -> Vec<u8> {
    let stride = view_stride(set) as usize;
    let mut bytes = vec![0; cameras.len() * stride];
    for (number, (camera, slot)) in (0..).zip(cameras.iter().zip(bytes.chunks_mut(stride))) {
        let work = GpuViewWork { view: GpuViewCamera::of(camera, number, tiles, steps), volume: set.volume };
        let mut nearest_first = set.cameras.clone();
        nearest_first.sort_by(|a, b| {
            let distance = |c: &GpuSampleCamera| Vec3::from(c.eye_in_world).distance_squared(camera.eye_in_world);
            // Images that prove nothing everywhere are no use to march in.
            let uncertain = |c: &GpuSampleCamera| set.uncertain[c.mask.trailing_zeros() as usize];
            uncertain(a).cmp(&uncertain(b)).then(distance(a).total_cmp(&distance(b)))
        });
        let (head, tail) = slot.split_at_mut(size_of::<GpuViewWork>());
        head.copy_from_slice(bytemuck::bytes_of(&work));
        let cameras: &[u8] = bytemuck::cast_slice(&nearest_first);
        tail[..cameras.len()].copy_from_slice(cameras);
    }
    bytes
}

fn fill_works(size_px: UVec2, count: usize) -> Vec<u8> {
    let mut bytes = vec![0; count * FILL_STRIDE as usize];
    for (number, slot) in (0..).zip(bytes.chunks_mut(FILL_STRIDE as usize)) {
        let work = GpuFillWork { size_px: size_px.to_array(), first_pixel: number * size_px.element_product(), number };
        slot[..size_of::<GpuFillWork>()].copy_from_slice(bytemuck::bytes_of(&work));
    }
    bytes
}

/// Runs of views of one size, bounded in pixels.
fn batches(cameras: &[PinholeCamera]) -> impl Iterator<Item = &[PinholeCamera]> {
    cameras.chunk_by(|a, b| a.size_px == b.size_px).flat_map(|run| {
        let views = (PIXELS_A_BATCH / run[0].pixel_count()).clamp(1, MAX_VIEWS_A_BATCH);
        run.chunks(views)
    })
}
