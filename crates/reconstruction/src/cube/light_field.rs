//! A layered light field on the device, in which the light that comes to a surface is gathered.

use bytemuck::{Pod, Zeroable};
use depth_image::{LayeredLightField, LightDirection, LightDirections, LightFieldCamera};
use glam::{IVec3, Vec3};
use gpu::{Table, TablePool, Turn};
use rayon::prelude::*;
use wgpu::{BufferUsages, TextureFormat};

use crate::error::ReconstructionError;

/// The least distance from a surface to a sample that lights it, in spacings of the lines. Nearer samples may be of the surface itself.
pub(crate) const NEAREST_SPACINGS: f32 = 0.5;

/// Directions that a lobe takes less of than this, beside the mirrored one, do not count.
pub(crate) const LEAST_LOBE_SHARE: f32 = 0.01;
/// An upper bound of what masking and the cosine weigh for one direction, over what they weigh for the mirrored one.
pub(crate) const MOST_MASKING: f32 = 4.0;
/// How much of a direction's own width its lines are taken from.
pub(crate) const FOOTPRINT_SHARE: f32 = 0.8;

/// `LightField` of `cube/gather.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLightField {
    pub directions: u32,
    pub divisions: u32,
    pub side_px: u32,
    pub exponent: f32,
    pub least_alpha: f32,
}

impl GpuLightField {
    pub fn of(camera: &LightFieldCamera) -> Self {
        // The lobe with which mirrors are gathered: the exponent of the cosine to the mirrored ray. Narrower lobes hold fewer than
        // three directions too often. Lischinski's figure 3 has 40.
        let exponent: f32 = match camera.directions {
            LightDirections::D66 => 30.0,
            LightDirections::D258 => 120.0,
            LightDirections::D1026 => 480.0,
        };
        Self {
            directions: camera.directions.count(),
            divisions: camera.directions.divisions(),
            side_px: camera.side_px,
            exponent,
            // As wide as the lobe around the mirrored ray: a half-way vector turns by half as much.
            least_alpha: (2.0 / (4.0 * exponent + 2.0)).sqrt(),
        }
    }
}

/// A light field, ready to be gathered in.
pub(crate) struct LightField {
    pub own: wgpu::Buffer,
    /// Tables with their names in `cube/gather.wgsl`.
    pub tables: [(&'static str, Table); 4],
}

impl LightField {
    /// Fails for a part of a light field, damaged samples, and beyond the device's limits.
    pub fn upload(tables: &TablePool, field: &LayeredLightField, turn: Turn) -> Result<Self, ReconstructionError> {
        field.validate().map_err(|error| ReconstructionError::LightField { reason: error.to_string() })?;
        let camera = &field.camera;
        if camera.pairs != camera.directions.pairs() {
            let reason = format!("{} of {} pairs", camera.pairs, camera.directions.pairs());
            return Err(ReconstructionError::LightField { reason });
        }
        tables.gpu.check_table("lines of a light field", field.first.len())?;
        tables.gpu.check_table("samples of a light field", field.sample_count())?;
        let directions = camera.directions.all();
        let rows: Vec<[u32; 4]> = directions.iter().flat_map(|direction| direction_rows(camera, direction)).collect();
        let lines: Vec<[u32; 2]> = field.first.windows(2).map(|ends| [ends[0], ends[1]]).collect();
        let samples = field.planar_depth_m.iter().zip(&field.radiance_rgb9e5);
        let mut samples: Vec<[u32; 2]> = samples.map(|(depth_m, &radiance)| [depth_m.to_bits(), radiance]).collect();
        // A table has one texel at least.
        samples.resize(samples.len().max(1), [0; 2]);
        let orders = orders(camera.directions);
        Ok(Self {
            own: tables.gpu.buffer_with("light field", &[GpuLightField::of(camera)], BufferUsages::UNIFORM),
            tables: [
                (
                    "light_directions",
                    tables.upload("directions of a light field", TextureFormat::Rgba32Uint, &rows, turn)?,
                ),
                ("light_orders", tables.upload("orders of directions", TextureFormat::R32Uint, &orders, turn)?),
                ("light_lines", tables.upload("lines of a light field", TextureFormat::Rg32Uint, &lines, turn)?),
                ("light_samples", tables.upload("samples of a light field", TextureFormat::Rg32Uint, &samples, turn)?),
            ],
        })
    }
}

/// Texels of `light_orders`.
fn orders(directions: LightDirections) -> Vec<u32> {
    let all: Vec<Vec3> = directions.all().iter().map(|direction| direction.towards).collect();
    let n = directions.divisions() as i32;
    let mut orders = Vec::new();
    for half in [1, -1] {
        for j in -n..=n {
            for i in -n..=n {
                let height = (n - i.abs() - j.abs()).max(0) * half;
                let towards = IVec3::new(i, j, height).as_vec3().normalize_or_zero();
                let cosines = all.iter().map(|own| own.dot(towards)).enumerate();
                orders.push(cosines.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(at, _)| at as u32));
            }
        }
    }
    let by_angle = all.par_iter().map(|middle| {
        let mut order: Vec<u32> = (0..all.len() as u32).collect();
        order.sort_by(|&a, &b| all[b as usize].dot(*middle).total_cmp(&all[a as usize].dot(*middle)));
        order
    });
    orders.extend(by_angle.flatten_iter().collect::<Vec<u32>>());
    orders
}

/// Texels of `light_directions`.
fn direction_rows(camera: &LightFieldCamera, direction: &LightDirection) -> [[u32; 4]; 4] {
    let lines = camera.lines(direction.towards);
    let [right, down, forward] = lines.axes_in_world();
    let [column, row, depth] =
        [(right / lines.spacing_m, 0.0), (down / lines.spacing_m, 0.0), (forward, NEAREST_SPACINGS * lines.spacing_m)]
            .map(|(axis, offset)| axis.extend(offset - axis.dot(lines.corner_in_world)));
    let own = direction.towards.extend(direction.solid_angle_sr);
    [own, column, row, depth].map(|row| row.to_array().map(f32::to_bits))
}
