//! A yard behind walls.

use glam::Vec3;

use super::parts::MeshBuilder;
use crate::{Material, Scene};

const HALF_WIDTH_M: f32 = 2.0;
const WALL_THICKNESS_M: f32 = 0.2;
const WALL_HEIGHT_M: f32 = 2.0;

/// Four walls 2 m high around a yard of 3.6 × 3.6 m, centred at the origin on ground 16 m wide. The yard's red floor
/// and its pillar (0.8 m) are visible only from inside or from above. They are hidden from points outside the walls and
/// below their tops.
#[must_use]
pub fn courtyard() -> Scene {
    let mut builder = MeshBuilder::default();
    add_ground(&mut builder);
    let outer = HALF_WIDTH_M;
    let inner = HALF_WIDTH_M - WALL_THICKNESS_M;
    let stone = Vec3::new(186.0, 176.0, 158.0);
    let mut wall = |min_x, min_z, max_x, max_z| {
        builder.cuboid(Vec3::new(min_x, 0.0, min_z), Vec3::new(max_x, WALL_HEIGHT_M, max_z), stone);
    };
    wall(-outer, -outer, outer, -inner);
    wall(-outer, inner, outer, outer);
    wall(-outer, -inner, -inner, inner);
    wall(inner, -inner, outer, inner);
    builder.rectangle(Vec3::ZERO, Vec3::Z * inner, Vec3::X * inner, Vec3::new(200.0, 60.0, 50.0));
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
