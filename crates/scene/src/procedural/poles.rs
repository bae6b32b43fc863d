//! Thin poles before a wall: many silhouettes, and a wall that shows different parts to each view.

use std::f32::consts::TAU;

use glam::Vec3;

use super::mesh_builder::{MeshBuilder, vertex};
use crate::{Material, Scene};

const POLE_COUNT: u32 = 9;
const POLE_SIDES: u32 = 12;
const HALF_HEIGHT_M: f32 = 1.5;

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
