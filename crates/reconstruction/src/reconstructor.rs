//! Views from sample sets, in batches: tile starts, the method, and the fill, in one submission each.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use depth_image::{DepthImage, PinholeCamera, Provenance, View, ViewPlanes};
use glam::{UVec2, Vec3};
use gpu::{BufferPool, Frame, Gpu, PooledBuffer, Readback, Submitted, Templates};
use wgpu::{BindingResource, BufferUsages};

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

/// What a shader finds at a binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Slot {
    /// The view's uniform, at a dynamic offset.
    View,
    Uniform,
    Read,
    Write,
    /// See `word_texture`.
    Words,
    /// A layer for each view of a batch: what of its depth was drawn, and of which samples.
    DrawnDepth,
    DrawnSamples,
}

impl Slot {
    fn ty(self) -> wgpu::BindingType {
        let buffer =
            |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: self == Self::View, min_binding_size: None };
        let texture = |sample_type, view_dimension| wgpu::BindingType::Texture {
            sample_type,
            view_dimension,
            multisampled: false,
        };
        match self {
            Self::View | Self::Uniform => buffer(wgpu::BufferBindingType::Uniform),
            Self::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            Self::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            Self::Words => texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2),
            Self::DrawnDepth => texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2Array),
            Self::DrawnSamples => texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2Array),
        }
    }

    fn entry(self, binding: u32) -> wgpu::BindGroupLayoutEntry {
        let visibility = wgpu::ShaderStages::COMPUTE;
        wgpu::BindGroupLayoutEntry { binding, visibility, ty: self.ty(), count: None }
    }
}

/// A shader's bindings, in their order.
fn slots(key: ShaderKey) -> Vec<Slot> {
    use Slot::{DrawnDepth, DrawnSamples, Read, Uniform, View, Words, Write};
    match key.name {
        "tile_start.wgsl" => vec![View, Words, Words, Write],
        "fill.wgsl" => vec![View, Write, Write, Read, Read, Read],
        "specular.wgsl" => vec![View, Words, Words, Write, Read, Read, Uniform, Words],
        "mesh.wgsl" | "hybrid_mesh.wgsl" => vec![Uniform, Words, Write, Write],
        "merge.wgsl" | "quad_count.wgsl" => vec![Uniform, Read, Write, Write],
        "quad_scan.wgsl" => vec![Uniform, Write, Write],
        "quad_indices.wgsl" => vec![Uniform, Read, Read, Write],
        _ => {
            let mut slots = vec![View, Words, Words, Read, Write, Write, Write, Write, Write, Words];
            slots.extend(key.count_fetches.then_some(Write));
            slots.extend([Read, Read].into_iter().filter(|_| key.march_camera > 0));
            slots.extend([DrawnDepth, DrawnSamples].into_iter().filter(|_| key.name == "resolve.wgsl"));
            slots
        }
    }
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

/// One batch on its way.
struct InFlight<'g> {
    submitted: Submitted<'g>,
    reads: Reads,
    size_px: UVec2,
    count: usize,
    /// Lent until the device is done with it.
    _batch: Batch,
}

#[derive(Clone, Copy)]
struct Reads {
    srgb8: Readback,
    inverse_depth: Option<Readback>,
    provenance: Option<Readback>,
    fetches: Option<Readback>,
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
        SampleSet::upload(&self.gpu, &self.textures, images, set)
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

    fn layout(&self, key: ShaderKey) -> wgpu::BindGroupLayout {
        let entries: Vec<_> = (0..).zip(slots(key)).map(|(binding, slot)| slot.entry(binding)).collect();
        self.gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(key.name), entries: &entries })
    }

    /// The first resource is the views' uniforms, of which a shader sees one.
    fn bind(
        &self,
        pipeline: &wgpu::ComputePipeline,
        stride: u32,
        mut resources: Vec<BindingResource<'_>>,
    ) -> wgpu::BindGroup {
        if let Some(BindingResource::Buffer(views)) = resources.first_mut() {
            views.size = std::num::NonZeroU64::new(u64::from(stride));
        }
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
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

impl InFlight<'_> {
    fn finish(self, views: &mut Vec<View>, statistics: &mut Statistics) -> Result<(), ReconstructionError> {
        let result = self.submitted.wait()?;
        statistics.device_s += result.device_s;
        let pixels = self.size_px.element_product() as usize;
        let planes = |readback: Readback| {
            result.with(readback, |words: &[u32]| {
                words.chunks(pixels).take(self.count).map(<[u32]>::to_vec).collect::<Vec<_>>()
            })
        };
        let mut rgb = result
            .with(self.reads.srgb8, |words: &[u32]| {
                words.chunks(pixels).take(self.count).map(rgb_bytes).collect::<Vec<_>>()
            })?
            .into_iter();
        let mut depths = self.reads.inverse_depth.map(planes).transpose()?.unwrap_or_default().into_iter();
        let mut provenances = self.reads.provenance.map(planes).transpose()?.unwrap_or_default().into_iter();
        if let Some(readback) = self.reads.fetches {
            let sum: f64 = result
                .with(readback, |words: &[u32]| words[..pixels * self.count].iter().map(|&n| f64::from(n)).sum())?;
            *statistics.fetches_per_ray.get_or_insert(0.0) += sum / pixels as f64;
        }
        views.extend((0..self.count).map(|_| View {
            size_px: self.size_px,
            srgb8: rgb.next().unwrap_or_default(),
            inverse_depth_per_m: depths.next().map(bytemuck::cast_vec),
            provenance: provenances.next().map(|words| words.into_iter().map(Provenance).collect()),
        }));
        Ok(())
    }
}

fn rgb_bytes(rgba: &[u32]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(rgba.len() * 3);
    bytes.extend(rgba.iter().flat_map(|word| {
        let [r, g, b, _] = word.to_le_bytes();
        [r, g, b]
    }));
    bytes
}

/// Runs of views of one size, bounded in pixels.
fn batches(cameras: &[PinholeCamera]) -> impl Iterator<Item = &[PinholeCamera]> {
    cameras.chunk_by(|a, b| a.size_px == b.size_px).flat_map(|run| {
        let views = (PIXELS_A_BATCH / run[0].pixel_count()).clamp(1, MAX_VIEWS_A_BATCH);
        run.chunks(views)
    })
}
