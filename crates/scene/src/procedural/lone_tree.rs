//! One tree on its mound.

use std::f32::consts::TAU;

use glam::{Affine3A, Vec2, Vec3};

use super::geometry::{MeshBuilder, matt, vertex};
use super::random::{Noise, mix};
use super::tree::{TreePlan, tree_mesh};
use crate::{Environment, Instance, Material, Mesh, Scene};

/// Number of triangles of the model in the paper's table 1.
const TRIANGLES: u32 = 113_000;
const SEED: u64 = 1113;
/// The tree grows at the height for which its leaves are made, and is scaled afterwards.
const GROWN_HEIGHT_M: f32 = 0.8;
const SCALE: f32 = 12.0;
const GROUND_RADIUS_M: f32 = 5.5;
const GROUND_RINGS: u32 = 14;
const GROUND_SECTORS: u32 = 64;

/// A broad-leaved tree, 9.6 m high, on a mound 11 m wide: 113,000 triangles, nearly all of them its own.
#[must_use]
pub fn lone_tree() -> Scene {
    let ground = ground();
    let plan = TreePlan {
        foot_in_world: Vec3::Y * -0.004,
        height_m: GROWN_HEIGHT_M,
        triangles: TRIANGLES - ground.triangle_count() as u32,
    };
    let instance = |mesh: u32, scale: f32| Instance { mesh, world_from_mesh: Affine3A::from_scale(Vec3::splat(scale)) };
    Scene {
        name: "tree".into(),
        meshes: vec![ground, tree_mesh(&plan, SEED)],
        instances: vec![instance(0, 1.0), instance(1, SCALE)],
        materials: vec![matt("ground"), matt("bark"), Material { double_sided: true, ..matt("leaves") }],
        background: Environment::uniform(Vec3::new(0.46, 0.60, 0.80)),
        ..Scene::default()
    }
    .with_default_lights()
}

/// A low round mound, its middle at the origin.
fn ground() -> Mesh {
    let noise = Noise::new(SEED);
    let height_m = |at: Vec2| {
        let bumps = 0.10 * noise.fractal(at * 0.6, 3) * (at.length() / GROUND_RADIUS_M);
        bumps - 0.45 * (at.length() / GROUND_RADIUS_M).powi(2)
    };
    let at = |at: Vec2| {
        let step_m = 0.05;
        let slope = |axis: Vec2| (height_m(at + axis * step_m) - height_m(at - axis * step_m)) / (2.0 * step_m);
        let normal = Vec3::new(-slope(Vec2::X), 1.0, -slope(Vec2::Y)).normalize_or(Vec3::Y);
        let tuft = 0.5 + 0.5 * noise.fractal(at * 1.4 + 20.0, 3);
        let grass = mix(Vec3::new(84.0, 112.0, 46.0), Vec3::new(140.0, 148.0, 74.0), tuft);
        let color = mix(Vec3::new(112.0, 90.0, 62.0), grass, (at.length() - 0.5 + 0.5 * tuft) / 1.2);
        vertex(Vec3::new(at.x, height_m(at), at.y), normal, color)
    };
    let mut builder = MeshBuilder::default();
    let middle = builder.push(at(Vec2::ZERO));
    for ring in 1..=GROUND_RINGS {
        let radius_m = GROUND_RADIUS_M * ring as f32 / GROUND_RINGS as f32;
        for sector in 0..GROUND_SECTORS {
            let angle_rad = TAU * sector as f32 / GROUND_SECTORS as f32;
            builder.push(at(Vec2::from_angle(angle_rad) * radius_m));
        }
    }
    let index = |ring: u32, sector: u32| 1 + (ring - 1) * GROUND_SECTORS + sector % GROUND_SECTORS;
    for sector in 0..GROUND_SECTORS {
        builder.indices.extend([middle, index(1, sector + 1), index(1, sector)]);
        for ring in 1..GROUND_RINGS {
            let (inner, outer) = (index(ring, sector), index(ring + 1, sector));
            builder.quad([inner, index(ring, sector + 1), index(ring + 1, sector + 1), outer]);
        }
    }
    builder.finish_part(0);
    builder.into_mesh()
}
