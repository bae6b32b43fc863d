//! Which places of a grid on each lamp each pixel's surface sees: `lamp_bits.wgsl`.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use depth_image::{LampRig, PinholeCamera};
use glam::Vec3;
use gpu::cube_walk::CubeBricks;
use gpu::{Binding, BufferPool, Gpu, Lent, Pool, PooledBuffer, ShaderVariant, switches};
use minijinja::{Value, context, value::merge_maps};
use wgpu::BufferUsages;

use crate::batch::{Batch, Recording};
use crate::grid::grid_place;
use crate::lamp_maps::{self, MAPS_AT_ONCE};
use crate::layers::{LayerKind, Layers};
use crate::lighting::GridVisibility;
use crate::rays::Traversal;
use crate::{RenderError, raster::Raster, surfaces::Surfaces};

/// Rays that one dispatch traces for a pixel.
const RAYS_AT_ONCE: u32 = 32;

#[derive(Debug, Clone, Copy)]
pub(crate) struct LampBits {
    by_rays: bool,
    single_pole: bool,
    /// Shadow maps are read first.
    pub maps: bool,
    /// A layered cube is walked first.
    pub cube: bool,
    environment_map: bool,
    light_count: usize,
    traversal: Traversal,
}

/// `LampPoint` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLampPoint {
    pub eye_in_world: [f32; 3],
    pub near_m: f32,
    pub principal_px: [f32; 2],
    pub padding: [f32; 2],
}

/// `LampMaps` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLampMaps {
    pub right_in_world: [f32; 3],
    pub side_px: f32,
    pub down_in_world: [f32; 3],
    pub focal_x_px: f32,
    pub forward_in_world: [f32; 3],
    pub focal_y_px: f32,
    pub points: [GpuLampPoint; MAPS_AT_ONCE as usize],
}

impl ShaderVariant for LampBits {
    const TEMPLATE: &'static str = "lamp_bits.wgsl";

    fn context(&self) -> Value {
        let Self { by_rays, single_pole, maps, cube, environment_map, light_count, traversal } = *self;
        let own = context! { light_slots => gpu::light_slots(light_count), by_rays, single_pole, maps, cube, environment_map, meets_both_sides => true, bits => true, writes_bits => true, primary => false, from_eye => false };
        merge_maps([own, traversal.context()])
    }

    fn all() -> Vec<Self> {
        let all = switches().flat_map(|[by_rays, single_pole, maps, cube, environment_map]| {
            Traversal::ALL.map(|traversal| Self {
                by_rays,
                single_pole,
                maps,
                cube,
                environment_map,
                light_count: 1,
                traversal,
            })
        });
        // Rays around a pole find surfaces; a grid is asked in one way.
        let all = all.filter(|variant| (variant.by_rays || !variant.single_pole) && !(variant.maps && variant.cube));
        all.collect()
    }
}

/// Memory for the bits of a batch; `None` for light without a grid, or by rays, unless bits are wanted themselves.
pub(crate) fn lend(pool: &BufferPool, batch: &Batch<'_>) -> Option<PooledBuffer> {
    let work = batch.work;
    let is_used = work.lighting.grid_visibility() != GridVisibility::Rays || batch.output.lamp_bits;
    let bytes = batch.bytes(batch.lamp_words());
    (is_used && bytes > 0).then(|| pool.lend_storage("which places of lamps pixels see", bytes))
}

/// Maps on loan for the light of a batch, which must live until its frame is done.
pub(crate) fn lend_maps(
    gpu: &Gpu,
    pool: &Pool<LayerKind, Layers>,
    batch: &Batch<'_>,
) -> Option<Lent<LayerKind, Layers>> {
    let kind = lamp_maps::kind(batch.work.lamp_maps.side_px);
    let is_used = batch.work.lighting.grid_visibility().has_maps();
    is_used.then(|| pool.lend(kind, |&(size, format)| Layers::new(gpu, size, format)))
}

/// Records the bits of all lamps for the rays of this position and step: some maps, and what pixels see of their places.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    raster: &Raster,
    layers: Option<&Layers>,
    surfaces: &[Surfaces],
) -> Result<(), RenderError> {
    if recording.lamp_bits.is_none() {
        return Ok(());
    }
    let work = recording.batch.work;
    let visibility = work.lighting.grid_visibility();
    let cube = work.lamp_maps.cube.filter(|_| visibility == GridVisibility::Cube);
    let without_maps = cube.map_or(Answer::Rays, Answer::Cube);
    let rays = recording.sums.rays[0].clone();
    for (lamp, rig) in work.scene.lamp_rigs(work.lamp_maps.side_px).into_iter().enumerate() {
        let mapped = rig.zip(layers);
        let at_once = mapped.map_or(RAYS_AT_ONCE, |(_, layers)| layers.each.len() as u32);
        for first in rays.clone().step_by(at_once as usize) {
            let chunk = first..(first + at_once).min(rays.end);
            let Some((rig, layers)) = mapped else {
                find(recording, surfaces, lamp, chunk, without_maps)?;
                continue;
            };
            let cameras = cameras_of(recording.batch, &rig, chunk.clone());
            match work.lamp_maps.samples.filter(|_| visibility == GridVisibility::Samples) {
                Some(samples) => samples.record(&mut recording.frame, lamp, &cameras, &layers.each)?,
                None => raster.record_maps(&mut recording.frame, &work, &cameras, &layers.each)?,
            }
            let uniform = GpuLampMaps::new(&cameras);
            let uniform = recording.gpu.buffer_with("cameras on a lamp", &[uniform], BufferUsages::UNIFORM);
            let maps = layers.first(layers.each.len());
            find(recording, surfaces, lamp, chunk, Answer::Maps { uniform: &uniform, maps: &maps })?;
        }
    }
    Ok(())
}

/// What is asked before rays.
#[derive(Clone, Copy)]
enum Answer<'m> {
    Rays,
    /// Maps, and the uniform of their cameras.
    Maps {
        uniform: &'m wgpu::Buffer,
        maps: &'m wgpu::TextureView,
    },
    Cube(&'m CubeBricks),
}

impl<'m> Answer<'m> {
    fn bindings(self) -> Vec<Binding<'m>> {
        match self {
            Self::Rays => Vec::new(),
            Self::Maps { uniform, maps } => {
                vec![Binding::buffer("lamp_maps", uniform), Binding::texture("maps", maps)]
            }
            Self::Cube(cube) => cube.bindings().collect(),
        }
    }
}

/// Cameras at the places of some rays of a step.
fn cameras_of(batch: &Batch<'_>, rig: &LampRig, rays: Range<u32>) -> Vec<PinholeCamera> {
    let side = batch.work.lighting.grid_side();
    let first = batch.first_shadow_ray();
    rays.map(|ray| rig.camera(grid_place(side, first + ray))).collect()
}

/// Records the pass over all pixels for some rays to a lamp.
fn find(
    recording: &mut Recording<'_>,
    surfaces: &[Surfaces],
    lamp: usize,
    rays: Range<u32>,
    answer: Answer<'_>,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let Some(traced) = batch.traced.as_deref() else { return Ok(()) };
    let variant = LampBits {
        by_rays: batch.by_rays,
        single_pole: batch.is_single_pole(),
        maps: matches!(answer, Answer::Maps { .. }),
        cube: matches!(answer, Answer::Cube(_)),
        environment_map: batch.work.scene.environment.is_some(),
        light_count: batch.work.scene.light_count,
        traversal: traced.traversal,
    };
    let detail = rays.len();
    let cameras = batch.uniform_of_lamp(recording.gpu, &recording.pieces, &recording.sums, lamp as u32, rays);
    for (camera, target) in surfaces.iter().enumerate() {
        let own = [Binding::buffer("camera", &cameras)].into_iter().chain(target.bindings()).chain(answer.bindings());
        let bound = recording.bind(&variant, detail, own)?;
        recording.dispatch(&bound, camera);
    }
    Ok(())
}

impl GpuLampMaps {
    /// Of cameras of one rig.
    fn new(cameras: &[PinholeCamera]) -> Self {
        let Some(first) = cameras.first() else { return Self::zeroed() };
        let mut points = [GpuLampPoint::zeroed(); MAPS_AT_ONCE as usize];
        for (point, camera) in points.iter_mut().zip(cameras) {
            point.eye_in_world = camera.eye_in_world.to_array();
            point.near_m = camera.near_m;
            point.principal_px = camera.principal_px.to_array();
        }
        Self {
            right_in_world: (first.world_from_camera * Vec3::X).to_array(),
            side_px: first.size_px.x as f32,
            down_in_world: (first.world_from_camera * Vec3::NEG_Y).to_array(),
            focal_x_px: first.focal_px.x,
            forward_in_world: first.forward_in_world().to_array(),
            focal_y_px: first.focal_px.y,
            points,
        }
    }
}
