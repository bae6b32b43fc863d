//! A layered light field on the device, in which the light that comes to a surface is gathered.

use bytemuck::{Pod, Zeroable};
use depth_image::{LayeredLightField, LightDirection, LightDirections, LightFieldCamera};
use glam::{IVec3, Vec3, Vec4};
use gpu::{Binding, Table, TablePool, Turn};
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

/// The lobe with which mirrors are gathered: the exponent of the cosine to the mirrored ray. Narrower lobes hold fewer than three
/// directions too often. Lischinski's figure 3 has 40.
fn mirror_exponent(directions: LightDirections) -> f32 {
    match directions {
        LightDirections::D66 => 30.0,
        LightDirections::D258 => 120.0,
        LightDirections::D1026 => 480.0,
    }
}

/// The width of a microfacet lobe that is as wide as one of an exponent around the mirrored ray: a half-way vector turns by half as much.
fn alpha_of(exponent: f32) -> f32 {
    (2.0 / (4.0 * exponent + 2.0)).sqrt()
}

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
        let exponent = mirror_exponent(camera.directions);
        Self {
            directions: camera.directions.count(),
            divisions: camera.directions.divisions(),
            side_px: camera.side_px,
            exponent,
            least_alpha: alpha_of(exponent),
        }
    }
}

/// A light field, ready to be gathered in.
pub(crate) struct LightField {
    own: wgpu::Buffer,
    directions: Table,
    orders: Table,
    lines: Table,
    samples: Table,
}

impl LightField {
    /// Fails for a part of a light field, damaged samples, and beyond the device's limits.
    pub fn upload(tables: &TablePool, field: &LayeredLightField, turn: Turn) -> Result<Self, ReconstructionError> {
        let wrong = |reason: String| ReconstructionError::LightField { reason };
        field.validate().map_err(|error| wrong(error.to_string()))?;
        if field.camera.pairs != field.camera.directions.pairs() {
            return Err(wrong(format!("{} of {} pairs", field.camera.pairs, field.camera.directions.pairs())));
        }
        tables.gpu.check_table("lines of a light field", field.first.len())?;
        tables.gpu.check_table("samples of a light field", field.sample_count())?;
        let directions: Vec<[u32; 4]> = field
            .camera
            .directions
            .all()
            .iter()
            .flat_map(|direction| direction_rows(&field.camera, direction))
            .collect();
        let lines: Vec<[u32; 2]> = field.first.windows(2).map(|ends| [ends[0], ends[1]]).collect();
        let samples = field.planar_depth_m.iter().zip(&field.radiance_rgb9e5);
        let mut samples: Vec<[u32; 2]> = samples.map(|(depth_m, &radiance)| [depth_m.to_bits(), radiance]).collect();
        // A table has one texel at least.
        samples.resize(samples.len().max(1), [0; 2]);
        Ok(Self {
            own: tables.gpu.buffer_with("light field", &[GpuLightField::of(&field.camera)], BufferUsages::UNIFORM),
            directions: tables.upload("directions of a light field", TextureFormat::Rgba32Uint, &directions, turn)?,
            orders: tables.upload(
                "orders of directions",
                TextureFormat::R32Uint,
                &orders(field.camera.directions),
                turn,
            )?,
            lines: tables.upload("lines of a light field", TextureFormat::Rg32Uint, &lines, turn)?,
            samples: tables.upload("samples of a light field", TextureFormat::Rg32Uint, &samples, turn)?,
        })
    }

    /// The resources of `cube/gather.wgsl`.
    pub fn bindings(&self) -> [Binding<'_>; 5] {
        [
            Binding::buffer("light_field", &self.own),
            Binding::texture("light_directions", &self.directions),
            Binding::texture("light_orders", &self.orders),
            Binding::texture("light_lines", &self.lines),
            Binding::texture("light_samples", &self.samples),
        ]
    }
}

/// Texels of `light_orders`.
fn orders(directions: LightDirections) -> Vec<u32> {
    let all: Vec<Vec3> = directions.all().iter().map(|direction| direction.towards).collect();
    let n = directions.divisions() as i32;
    let cell = |half: i32, j: i32, i: i32| {
        let height = (n - i.abs() - j.abs()).max(0) * half;
        let towards = IVec3::new(i, j, height).as_vec3().normalize_or_zero();
        all.iter()
            .map(|own| own.dot(towards))
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(0, |(at, _)| at as u32)
    };
    let rows = [1, -1].into_iter().flat_map(|half| (-n..=n).map(move |j| (half, j)));
    let mut orders: Vec<u32> = rows.flat_map(|(half, j)| (-n..=n).map(move |i| cell(half, j, i))).collect();
    let order = |middle: &Vec3| {
        let mut order: Vec<u32> = (0..all.len() as u32).collect();
        order.sort_by(|&a, &b| all[b as usize].dot(*middle).total_cmp(&all[a as usize].dot(*middle)));
        order
    };
    orders.extend(all.par_iter().map(order).flatten_iter().collect::<Vec<u32>>());
    orders
}

/// Texels of `light_directions`.
fn direction_rows(camera: &LightFieldCamera, direction: &LightDirection) -> [[u32; 4]; 4] {
    let lines = camera.lines(direction.towards);
    let [right, down, forward] = lines.axes_in_world();
    let row = |axis: Vec3, offset: f32| axis.extend(offset - axis.dot(lines.corner_in_world));
    let rows: [Vec4; 4] = [
        direction.towards.extend(direction.solid_angle_sr),
        row(right / lines.spacing_m, 0.0),
        row(down / lines.spacing_m, 0.0),
        row(forward, NEAREST_SPACINGS * lines.spacing_m),
    ];
    rows.map(|row| row.to_array().map(f32::to_bits))
}
