//! Views from sample sets, in batches: tile starts, the method, and the fill, in one submission each.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use depth_image::{Aabb, DepthImage, PinholeCamera, Provenance, View, ViewPlanes};
use glam::{UVec2, Vec3};
use gpu::{BufferPool, Frame, Gpu, PooledBuffer, Readback, Submitted, Templates};
use wgpu::BufferUsages;

use crate::{
    ReconstructionError, ReconstructionMethod, SHADERS, SampleSet, ShaderKey,
    layout::{GpuFillWork, GpuList, GpuSampleCamera, GpuViewCamera, GpuViewWork},
    shader_text,
};

const TILE_PX: u32 = 8;
/// Bounds the memory of a batch: 12 bytes a pixel on the device, up to as much again on the host.
const PIXELS_A_BATCH: usize = 1 << 20;
const MAX_VIEWS_A_BATCH: usize = 256;
/// Uniform offsets must be multiples of this on every device.
/// Marches in the nearest two cameras, and the carve.
const MAX_PASSES: usize = 3;
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
    gpu: Arc<Gpu>,
    pool: BufferPool,
    templates: Templates,
    pipelines: Mutex<HashMap<ShaderKey, Arc<wgpu::ComputePipeline>>>,
}

fn layout_entry(binding: u32, ty: wgpu::BufferBindingType, has_dynamic_offset: bool) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None },
        count: None,
    }
}

/// One batch on its way.
struct InFlight<'g> {
    submitted: Submitted<'g>,
    reads: Reads,
    size_px: UVec2,
    count: usize,
    /// Lent until the device is done with them.
    _buffers: Vec<PooledBuffer>,
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
            templates: Templates::new(SHADERS)?,
            pipelines: Mutex::default(),
        })
    }

    /// Puts a sample set on the device. `volume` holds all geometry of the scene.
    ///
    /// # Errors
    /// Images, cameras or a volume that cannot be used, or the device's limits.
    pub fn upload(
        &self,
        images: &[DepthImage],
        volume: &Aabb,
        background_linear: Vec3,
    ) -> Result<SampleSet, ReconstructionError> {
        SampleSet::upload(&self.gpu, images, volume, background_linear)
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
        let size_px = cameras[0].size_px;
        let tiles = size_px.map(|side| side.div_ceil(TILE_PX));
        let count = cameras.len();
        let bytes = 4 * (cameras[0].pixel_count() * count) as u64;
        self.gpu.check_storage_bytes("a batch of views (bytes)", bytes)?;
        let (steps, passes) = passes(method, set.cameras.len(), count_fetches);
        let stride = view_stride(set);
        let works = self.gpu.buffer_with("views", &view_works(set, cameras, tiles, steps), BufferUsages::UNIFORM);
        let starts = self.pool.lend_storage("tile starts", 4 * u64::from(tiles.element_product()) * count as u64);
        let labels = ["srgb8", "inverse depth", "provenance", "fetches"];
        let outputs: Vec<PooledBuffer> = labels
            .iter()
            .take(3 + usize::from(count_fetches))
            .map(|label| self.pool.lend_storage(label, bytes))
            .collect();
        let list_pixels = [(); MAX_PASSES].map(|()| self.pool.lend_storage("pixels left for later", bytes));
        let lists = [(); MAX_PASSES].map(|()| {
            self.gpu.buffer_with("lists", &vec![GpuList::EMPTY; count], BufferUsages::STORAGE | BufferUsages::INDIRECT)
        });

        let mut frame = Frame::begin(&self.gpu, "reconstruct");
        if count_fetches {
            frame.encoder.clear_buffer(&outputs[3], 0, None);
        }
        let tile_start =
            self.pipeline(ShaderKey { name: "tile_start.wgsl", cameras: set.cameras.len(), ..ShaderKey::default() })?;
        let bound = self.bind(&tile_start, stride, &[&works, &set.pyramids, &starts]);
        frame.compute_each(
            "tile start",
            &tile_start,
            &bound,
            stride,
            count,
            [tiles.x.div_ceil(TILE_PX), tiles.y.div_ceil(TILE_PX), 1],
        );
        for (number, &key) in passes.iter().enumerate() {
            let pipeline = self.pipeline(key)?;
            let mut buffers: Vec<&wgpu::Buffer> = vec![&works, &set.pyramids, &starts, &set.colors];
            buffers.extend(outputs[..3].iter().map(|buffer| &**buffer));
            buffers.extend([&*list_pixels[number], &lists[number]]);
            buffers.extend(outputs.get(3).map(|buffer| &**buffer));
            if number == 0 {
                let bound = self.bind(&pipeline, stride, &buffers);
                frame.compute_each(key.name, &pipeline, &bound, stride, count, [tiles.x, tiles.y, 1]);
            } else {
                buffers.extend([&*list_pixels[number - 1], &lists[number - 1]]);
                let bound = self.bind(&pipeline, stride, &buffers);
                frame.compute_each_indirect(key.name, &pipeline, &bound, stride, count, &lists[number - 1]);
            }
        }
        let last = passes.len() - 1;
        let fill = self.pipeline(ShaderKey { name: "fill.wgsl", ..ShaderKey::default() })?;
        let fill_works = self.gpu.buffer_with("fill", &fill_works(size_px, count), BufferUsages::UNIFORM);
        let bound = self.bind(
            &fill,
            FILL_STRIDE,
            &[&fill_works, &outputs[0], &outputs[1], &outputs[2], &list_pixels[last], &lists[last]],
        );
        frame.compute_each_indirect("fill", &fill, &bound, FILL_STRIDE, count, &lists[last]);

        let mut read =
            |index: usize| frame.read_back(&outputs[index], 0..bytes, self.pool.lend_host("view read-back", bytes));
        let reads = Reads {
            srgb8: read(0),
            inverse_depth: planes.inverse_depth.then(|| read(1)),
            provenance: planes.provenance.then(|| read(2)),
            fetches: count_fetches.then(|| read(3)),
        };
        let kept = outputs.into_iter().chain([starts]).chain(list_pixels).collect();
        Ok(InFlight { submitted: frame.submit(), reads, size_px, count, _buffers: kept })
    }

    /// One uniform at a dynamic offset, then what is read, then what is written.
    fn layout(&self, key: ShaderKey) -> wgpu::BindGroupLayout {
        let read = match key.name {
            "tile_start.wgsl" => vec![1],
            "fill.wgsl" => vec![3, 4, 5],
            _ if key.march_camera > 0 => {
                vec![1, 2, 3, 9 + u32::from(key.count_fetches), 10 + u32::from(key.count_fetches)]
            }
            _ => vec![1, 2, 3],
        };
        let bindings = match key.name {
            "tile_start.wgsl" => 3,
            "fill.wgsl" => 6,
            _ if key.march_camera > 0 => 11 + u32::from(key.count_fetches),
            _ => 9 + u32::from(key.count_fetches),
        };
        let storage = |binding| wgpu::BufferBindingType::Storage { read_only: read.contains(&binding) };
        let mut entries = vec![layout_entry(0, wgpu::BufferBindingType::Uniform, true)];
        entries.extend((1..bindings).map(|binding| layout_entry(binding, storage(binding), false)));
        self.gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(key.name), entries: &entries })
    }

    fn bind(&self, pipeline: &wgpu::ComputePipeline, stride: u32, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
        let one_view = std::num::NonZeroU64::new(u64::from(stride));
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, &buffer)| {
                let size = if binding == 0 { one_view } else { None };
                wgpu::BindGroupEntry {
                    binding,
                    resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size }),
                }
            })
            .collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }

    fn pipeline(&self, key: ShaderKey) -> Result<Arc<wgpu::ComputePipeline>, ReconstructionError> {
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
fn passes(method: ReconstructionMethod, cameras: usize, count_fetches: bool) -> (u32, Vec<ShaderKey>) {
    let key = ShaderKey { cameras, count_fetches, ..ShaderKey::default() };
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
            distance(a).total_cmp(&distance(b))
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
