//! Shapes in closed form.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::mesh_builder::{MeshBuilder, vertex};
use crate::{Material, Scene, Texture, Vertex};

const WHITE: Vec3 = Vec3::splat(255.0);

/// A square that faces along `normal` (+Y for a zero vector): two triangles, unlit, of exactly `color_srgb8`.
#[must_use]
pub fn quad(center: Vec3, half_size_m: f32, normal: Vec3, color_srgb8: [u8; 3]) -> Scene {
    let normal = normal.normalize_or(Vec3::Y);
    // Sides along the axes where the normal is along one.
    let reference = if normal.y.abs() > 0.9 { Vec3::NEG_Z } else { Vec3::Y };
    let right = reference.cross(normal).normalize_or(Vec3::X);
    let up = normal.cross(right);
    let mut builder = MeshBuilder::default();
    builder.rectangle(center, right * half_size_m, up * half_size_m, Vec3::from(color_srgb8.map(f32::from)));
    builder.into_scene("quad", Material { name: "unlit".into(), unlit: true, ..Material::default() })
}

/// The cube from -0.5 to 0.5 on each axis: 12 triangles, a normal and a colour a face.
#[must_use]
pub fn unit_cube() -> Scene {
    let mut builder = MeshBuilder::default();
    builder.cuboid(Vec3::splat(-0.5), Vec3::splat(0.5), WHITE);
    for (face, corners) in builder.vertices.chunks_exact_mut(4).enumerate() {
        let code = |bit: usize| if (face + 1) >> bit & 1 == 1 { 220 } else { 90 };
        corners.iter_mut().for_each(|v| v.color_srgba8 = [code(0), code(1), code(2), 255]);
    }
    builder.into_scene("unit-cube", Material::default())
}

/// A smooth sphere around the origin, `segments` (at least 3) around and half as many from pole to pole.
/// All vertices lie on it.
#[must_use]
pub fn uv_sphere(radius_m: f32, segments: u32) -> Scene {
    sphere(radius_m, segments).into_scene("uv-sphere", Material::default())
}

/// A sphere of radius 1 with a texture of 16 × 8 black and white checks.
#[must_use]
pub fn checker_sphere() -> Scene {
    let material = Material { base_color_texture: Some(0), ..Material::default() };
    let scene = sphere(1.0, 96).into_scene("checker-sphere", material);
    Scene { textures: vec![checks(256, 128, 16)], ..scene }
}

fn checks(width_px: u32, height_px: u32, check_px: u32) -> Texture {
    let texel = |i: u32| {
        let (x, y) = (i % width_px / check_px, i / width_px / check_px);
        if (x + y).is_multiple_of(2) { [235, 235, 230, 255] } else { [25, 30, 40, 255] }
    };
    Texture { width_px, height_px, is_srgb: true, srgba8: (0..width_px * height_px).flat_map(texel).collect() }
}

fn sphere(radius_m: f32, segments: u32) -> MeshBuilder {
    let (columns, rows) = (segments.max(3), (segments / 2).max(2));
    let mut builder = MeshBuilder::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let uv = [column as f32 / columns as f32, row as f32 / rows as f32];
            // The seam's two ends, and each pole, must be equal to the last bit.
            let azimuth = TAU * (column % columns) as f32 / columns as f32;
            let ring = if row % rows == 0 { 0.0 } else { (PI * uv[1]).sin() };
            let normal = Vec3::new(ring * azimuth.sin(), (PI * uv[1]).cos(), ring * azimuth.cos());
            builder.push(Vertex { uv, ..vertex(normal * radius_m, normal, WHITE) });
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let (above, below) = (row * (columns + 1) + column, (row + 1) * (columns + 1) + column);
            if row > 0 {
                builder.indices.extend([above, below, above + 1]);
            }
            if row + 1 < rows {
                builder.indices.extend([above + 1, below, below + 1]);
            }
        }
    }
    builder
}
