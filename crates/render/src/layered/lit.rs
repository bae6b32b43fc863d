//! The light of listed surfaces, as their colours and as the shares of lamps that they see.

use bytemuck::Zeroable;
use depth_image::{ParallelCamera, PixelDepth};
use glam::{UVec2, Vec2};
use gpu::{Binding, ShaderVariant};
use minijinja::{Value, context};

use super::crossings::Crossing;
use crate::batch::Batch;
use crate::planes::Output;
use crate::reflections::bounces::{GpuBounce, Rays};
use crate::{RenderError, illuminate, stages::Stages, sums::SumPlanes, work::DrawWork};

/// Surfaces that are lit together: bounds their memory.
const POINTS_A_LIST: usize = 1 << 18;
/// Rays begin above a surface by this share of the pixel's footprint on it: less than can be seen, more than the rounding of the
/// point.
pub(crate) const BIAS_FOOTPRINTS: f32 = 0.015_625;
/// Rays also begin higher by the rounding of coordinates, relative to the greatest.
pub(crate) const BIAS_ROUNDINGS: f32 = 4e-7;

#[derive(Debug)]
pub(crate) struct Lit {
    lit: bool,
    sums: SumPlanes,
}

impl ShaderVariant for Lit {
    const TEMPLATE: &'static str = "layered/lit.wgsl";

    fn context(&self) -> Value {
        context! { single_pole => false, lit => self.lit, ..self.sums.context() }
    }

    fn all() -> Vec<Self> {
        SumPlanes::all().flat_map(|sums| [false, true].map(|lit| Self { lit, sums })).collect()
    }
}

/// What listed surfaces send to all sides, and see of lamps.
#[derive(Default)]
pub(super) struct Light {
    pub color_rgb9e5: Vec<u32>,
    /// As [`depth_image::SpecularPlanes::visibility8`].
    pub visibility8: Vec<Vec<u32>>,
}

/// The light of the crossings of a camera's lines, given with the number of the first of each line.
pub(super) fn light(
    stages: &Stages,
    work: DrawWork<'_>,
    camera: &ParallelCamera,
    first: &[u32],
    crossings: &[Crossing],
) -> Result<Light, RenderError> {
    let traced = work.lighting.is_traced().then(|| work.scene.rays.at(work.scene_time_s)).transpose()?;
    let output = Output { samples: true, ..Output::of(work, work.highlight().is_some()) };
    let batch = Batch { traced, ..Batch::new(work, output) };
    let points = Points::of(camera, first);
    let mut light = Light { visibility8: vec![Vec::new(); output.sums.visibility_words()], ..Light::default() };
    let a_list = points_a_list(stages, output);
    for (number, listed) in crossings.chunks(a_list).enumerate() {
        let first_point = number * a_list;
        let bounces: Vec<GpuBounce> =
            (first_point..).zip(listed).map(|(place, crossing)| points.bounce(place, crossing)).collect();
        light_list(stages, &batch, &bounces, &mut light)?;
    }
    Ok(light)
}

/// Surfaces for which no buffer is larger than the device binds.
fn points_a_list(stages: &Stages, output: Output) -> usize {
    let bytes = stages.gpu.most_storage_bytes() as usize;
    let planes = output.sums.count().max(1 + output.sums.visibility_words()).max(size_of::<GpuBounce>() / 4);
    POINTS_A_LIST.min(bytes / (4 * planes)).max(1)
}

/// Lights one list of surfaces.
fn light_list(stages: &Stages, batch: &Batch<'_>, bounces: &[GpuBounce], light: &mut Light) -> Result<(), RenderError> {
    let Stages { gpu, pool, .. } = stages;
    let count = bounces.len() as u32;
    let plane_bytes = 4 * u64::from(count);
    let _one = stages.batches.begin(batch.work.turn.class);
    let sums = pool.lend_storage("light of layers", plane_bytes * batch.output.sums.count() as u64);
    let memory = pool.lend_storage("surfaces of layers", size_of_val(bounces) as u64);
    gpu.queue.write_buffer(&memory, 0, bytemuck::cast_slice(bounces));
    let bytes = plane_bytes * (1 + batch.output.sums.visibility_words()) as u64;
    let words = pool.lend_storage("colours of layers", bytes);
    let points = Rays::of_points(gpu, &memory, count, 1);
    let (mut recording, parts) = batch.record_points(&stages.gpu, &stages.passes, "light of layers", sums, count);
    let lit = batch.work.lighting.is_lit();
    if lit {
        let sums = (*recording.sums.buffer).clone();
        illuminate::record_points(&mut recording, &parts, &points, &sums)?;
    }
    let own = [Binding::buffer("words", &words)].into_iter().chain(points.bindings());
    let bound = recording.bind(&Lit { lit, sums: batch.output.sums }, points.generation, own)?;
    points.dispatch(&mut recording, &bound);
    let mut frame = recording.frame;
    let read = frame.read_back(&words, 0..bytes, pool.lend_host("colours of layers", bytes));
    let result = frame.submit()?.wait()?;
    result.with(read, |words: &[u32]| {
        let mut planes = words.chunks(bounces.len());
        light.color_rgb9e5.extend_from_slice(planes.next().unwrap_or_default());
        light.visibility8.iter_mut().zip(planes).for_each(|(plane, own)| plane.extend_from_slice(own));
    })?;
    Ok(())
}

/// The surfaces of an image as points to be lit.
struct Points<'a> {
    camera: &'a ParallelCamera,
    first: &'a [u32],
    /// The number of the first line among those of the same spacing through all space: a part of an image has the noise of the whole.
    first_line: UVec2,
    seed: u32,
}

impl<'a> Points<'a> {
    fn of(camera: &'a ParallelCamera, first: &'a [u32]) -> Self {
        let [right, down, forward] = camera.axes_in_world();
        let corner = Vec2::new(camera.corner_in_world.dot(right), camera.corner_in_world.dot(down)) / camera.spacing_m;
        let seed = forward.to_array().iter().fold(1, |seed, c| mixed(seed ^ (c * 1024.0).round() as i32 as u32));
        Self { camera, first, first_line: (corner + 0.25).floor().as_ivec2().as_uvec2(), seed }
    }

    fn bounce(&self, place: usize, crossing: &Crossing) -> GpuBounce {
        let Self { camera, first, first_line, seed } = *self;
        let columns = camera.size_px.x;
        let pixel = UVec2::new(crossing.line % columns, crossing.line / columns);
        let planar_depth_m = crossing.planar_depth_m;
        let at = pixel.as_vec2() + 0.5;
        let point = camera.unproject(PixelDepth { pixel: at, planar_depth_m });
        let layer = place as u32 - first[crossing.line as usize];
        let line = UVec2::new(first_line.x.wrapping_add(pixel.x), first_line.y.wrapping_add(pixel.y));
        GpuBounce {
            point_in_world: point.to_array(),
            seed: mixed(mixed(seed ^ line.x) ^ line.y.rotate_left(16) ^ (layer << 8)),
            side_m: camera.spacing_m,
            surface: crossing.surface,
            bias_m: BIAS_FOOTPRINTS * camera.spacing_m + BIAS_ROUNDINGS * point.abs().max_element(),
            met: 1,
            ..GpuBounce::zeroed()
        }
    }
}

/// A permutation of all words (Wellons' `lowbias32`).
pub(super) fn mixed(word: u32) -> u32 {
    let a = (word ^ word >> 16).wrapping_mul(0x7feb_352d);
    let b = (a ^ a >> 15).wrapping_mul(0x846c_a68b);
    b ^ b >> 16
}
