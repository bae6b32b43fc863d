//! Small scenes in closed form.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::geometry::{MeshBuilder, vertex};
use crate::{Material, Scene, Texture, Vertex};

const WHITE: Vec3 = Vec3::splat(255.0);

const POLE_COUNT: u32 = 9;
const POLE_SIDES: u32 = 12;
const HALF_HEIGHT_M: f32 = 1.5;

const HALF_WIDTH_M: f32 = 2.0;
const WALL_THICKNESS_M: f32 = 0.2;
const WALL_HEIGHT_M: f32 = 2.0;

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
    let material = Material { base_color_texture: Some(0.into()), ..Material::default() };
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

/// Nine upright poles of `radius_m` in the plane z = -1, at x = -2, -1.5 … 2, 3 m high around y = 0. A wall in the
/// plane z = -3 is 10 m wide and 6 m high, with coloured squares of half a metre. Views are at z > 0.
#[must_use]
pub fn poles(radius_m: f32) -> Scene {
    let mut builder = MeshBuilder::default();
    add_wall(&mut builder);
    for pole in 0..POLE_COUNT {
        let foot = Vec3::new(-2.0 + 0.5 * pole as f32, -HALF_HEIGHT_M, -1.0);
        add_pole(&mut builder, foot, radius_m);
    }
    builder.into_scene("poles", Material::default())
}

fn add_wall(builder: &mut MeshBuilder) {
    for row in 0..12 {
        for column in 0..20 {
            let centre = Vec3::new(-4.75 + 0.5 * column as f32, -2.75 + 0.5 * row as f32, -3.0);
            let tint = Vec3::new((column * 37 % 5) as f32, (row * 53 % 7) as f32, ((row + column) % 3) as f32);
            let color = Vec3::new(90.0, 100.0, 110.0) + tint * Vec3::new(30.0, 18.0, 40.0);
            builder.rectangle(centre, Vec3::X * 0.25, Vec3::Y * 0.25, color);
        }
    }
}

/// A tube, open at its ends.
fn add_pole(builder: &mut MeshBuilder, foot: Vec3, radius_m: f32) {
    let first = builder.vertices.len() as u32;
    for side in 0..POLE_SIDES {
        let (sin, cos) = (TAU * side as f32 / POLE_SIDES as f32).sin_cos();
        let outwards = Vec3::new(sin, 0.0, cos);
        for height_m in [0.0, 2.0 * HALF_HEIGHT_M] {
            builder.push(vertex(
                foot + outwards * radius_m + Vec3::Y * height_m,
                outwards,
                Vec3::new(196.0, 64.0, 48.0),
            ));
        }
    }
    for side in 0..POLE_SIDES {
        let (left, right) = (first + 2 * side, first + 2 * ((side + 1) % POLE_SIDES));
        builder.quad([left, right, right + 1, left + 1]);
    }
}

/// Four walls 2 m high around a yard of 3.6 × 3.6 m, centred at the origin on ground 16 m wide. The yard's red floor
/// and its pillar (0.8 m) are visible only from inside or from above. They are hidden from points outside the walls and
/// below their tops.
#[must_use]
pub fn courtyard() -> Scene {
    let mut builder = MeshBuilder::default();
    add_ground(&mut builder);
    let (outer, inner) = (HALF_WIDTH_M, HALF_WIDTH_M - WALL_THICKNESS_M);
    let stone = Vec3::new(186.0, 176.0, 158.0);
    let mut wall = |min_x, min_z, max_x, max_z| {
        builder.cuboid(Vec3::new(min_x, 0.0, min_z), Vec3::new(max_x, WALL_HEIGHT_M, max_z), stone);
    };
    wall(-outer, -outer, outer, -inner);
    wall(-outer, inner, outer, outer);
    wall(-outer, -inner, -inner, inner);
    wall(inner, -inner, outer, inner);
    let floor_right = Vec3::Z * inner;
    builder.rectangle(Vec3::ZERO, floor_right, Vec3::X * inner, Vec3::new(200.0, 60.0, 50.0));
    builder.cuboid(Vec3::new(-0.2, 0.0, -0.2), Vec3::new(0.2, 0.8, 0.2), Vec3::new(70.0, 90.0, 200.0));
    builder.into_scene("courtyard", Material::default())
}

/// A frame around the walls, so that only the floor lies in the plane of the yard's floor.
fn add_ground(builder: &mut MeshBuilder) {
    const REACH_M: f32 = 8.0;
    let half_strip = (REACH_M - HALF_WIDTH_M) * 0.5;
    let middle = HALF_WIDTH_M + half_strip;
    let grass = Vec3::new(110.0, 128.0, 84.0);
    for side in [-1.0, 1.0] {
        builder.rectangle(Vec3::X * (side * middle), Vec3::Z * HALF_WIDTH_M, Vec3::X * half_strip, grass);
        builder.rectangle(Vec3::Z * (side * middle), Vec3::Z * half_strip, Vec3::X * REACH_M, grass);
    }
}
