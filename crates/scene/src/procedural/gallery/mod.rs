//! A furnished room with pictures and sculptures, lit by the sun and the sky through its windows and by glowing lamps: most of its
//! light is indirect.

mod art;
mod furniture;
mod size;

use depth_image::{Environment, Illumination, Light};
use glam::{Affine3A, Mat3, Vec3};

use super::parts::{MeshBuilder, Rng, matt};
use crate::{Material, Scene, SourceCamera};
use size::{HALF_LENGTH_M, HALF_WIDTH_M, HEIGHT_M};

const PLANK_M: [f32; 2] = [1.5, 0.2];
const WINDOW_MIDDLES_M: [f32; 4] = [-4.3, -1.45, 1.4, 4.25];
const HALF_WINDOW_M: f32 = 0.85;
const SILL_M: f32 = 0.75;
const LINTEL_M: f32 = 3.45;
const WALL_M: f32 = 0.35;

const PLASTER: Vec3 = Vec3::new(226.0, 220.0, 208.0);
const TERRACOTTA: Vec3 = Vec3::new(186.0, 88.0, 62.0);
const TEAL: Vec3 = Vec3::new(52.0, 116.0, 118.0);
const WOOD: Vec3 = Vec3::new(150.0, 104.0, 66.0);
const FRAME: Vec3 = Vec3::new(70.0, 62.0, 54.0);

const EYE: Vec3 = Vec3::new(4.3, 1.65, 2.9);
const TARGET: Vec3 = Vec3::new(-2.2, 1.35, -1.0);
const FOV_Y_RAD: f32 = 1.0;

/// About 80,000 triangles.
#[must_use]
pub fn gallery() -> Scene {
    let mut builder = MeshBuilder::default();
    add_room(&mut builder);
    furniture::add(&mut builder);
    art::add(&mut builder);
    builder.finish_part(0);
    furniture::add_leaves(&mut builder);
    builder.finish_part(1);
    furniture::add_lanterns(&mut builder);
    builder.finish_part(2);
    art::add_ring(&mut builder);
    builder.finish_part(3);
    let leaves = Material { double_sided: true, ..matt("leaves") };
    let materials = vec![matt("matt"), leaves, glowing("lantern", [4.0, 2.9, 1.7]), glowing("ring", [4.5, 0.7, 2.0])];
    let mut scene = builder.into_scene_of("gallery", materials);
    let sun = Light::Directional {
        towards_light_in_world: Vec3::new(0.42, 0.68, -0.6).normalize_or(Vec3::Y),
        irradiance_linear: Vec3::new(9.0, 8.2, 7.0),
        angular_radius_rad: 0.01,
    };
    let environment = Environment::gradient(Vec3::new(1.7, 2.2, 3.2), Vec3::new(1.0, 0.94, 0.82));
    scene.illumination = Illumination { lights: vec![sun], environment };
    // As bright as a picture shows it beside the room.
    scene.background = Environment::gradient(Vec3::new(0.62, 0.82, 1.2), Vec3::new(0.42, 0.4, 0.34));
    let back = (EYE - TARGET).normalize_or(Vec3::Z);
    let right = Vec3::Y.cross(back).normalize_or(Vec3::X);
    let turned = Mat3::from_cols(right, back.cross(right), back);
    let world_from_camera = Affine3A::from_mat3_translation(turned, EYE);
    scene.cameras = vec![SourceCamera { name: "entrance".into(), world_from_camera, fov_y_rad: FOV_Y_RAD }];
    scene
}

fn glowing(name: &str, radiance: [f32; 3]) -> Material {
    Material { base_color_linear: [0.0, 0.0, 0.0, 1.0], emissive_linear: Vec3::from(radiance), ..matt(name) }
}

fn add_room(builder: &mut MeshBuilder) {
    add_floor(builder);
    let up = Vec3::Y * (0.5 * HEIGHT_M);
    let along = Vec3::X * HALF_LENGTH_M;
    let across = Vec3::Z * HALF_WIDTH_M;
    builder.rectangle(up * 2.0, along, across, PLASTER);
    builder.rectangle(up - along, -across, up, TERRACOTTA);
    builder.rectangle(up + along, across, up, TEAL);
    builder.rectangle(up + across, -along, up, PLASTER);
    add_windows(builder);
    for beam in 0..6 {
        let x = -5.0 + 2.0 * beam as f32;
        let min = Vec3::new(x - 0.1, HEIGHT_M - 0.28, -HALF_WIDTH_M);
        let max = Vec3::new(x + 0.1, HEIGHT_M, HALF_WIDTH_M);
        builder.cuboid(min, max, WOOD * 0.8);
    }
    add_skirting(builder);
}

/// Planks of unequal wood, with narrow joints.
fn add_floor(builder: &mut MeshBuilder) {
    let mut rng = Rng::new(11, 1);
    let [length_m, width_m] = PLANK_M;
    let rows = (2.0 * HALF_WIDTH_M / width_m) as i32;
    let columns = (2.0 * HALF_LENGTH_M / length_m) as i32 + 1;
    builder.rectangle(Vec3::Y * -0.004, Vec3::Z * HALF_WIDTH_M, Vec3::X * HALF_LENGTH_M, WOOD * 0.3);
    for row in 0..rows {
        let shift_m = rng.unit() * length_m;
        for column in 0..=columns {
            let start_m = -HALF_LENGTH_M - shift_m + column as f32 * length_m;
            let [first, last] = [start_m, start_m + length_m - 0.006].map(|x| x.clamp(-HALF_LENGTH_M, HALF_LENGTH_M));
            if last - first < 0.01 {
                continue;
            }
            let z = -HALF_WIDTH_M + (row as f32 + 0.5) * width_m;
            let color = WOOD * rng.between(0.82, 1.12) + Vec3::new(rng.between(-6.0, 8.0), 0.0, 0.0);
            let middle = Vec3::new(0.5 * (first + last), 0.0, z);
            builder.rectangle(middle, Vec3::Z * (0.5 * width_m - 0.003), Vec3::X * (0.5 * (last - first)), color);
        }
    }
}

/// The wall with windows is as thick as their reveals.
fn add_windows(builder: &mut MeshBuilder) {
    let [inner, outer] = [-HALF_WIDTH_M, -HALF_WIDTH_M - WALL_M];
    let mut block = |x: [f32; 2], y: [f32; 2]| {
        builder.cuboid(Vec3::new(x[0], y[0], outer), Vec3::new(x[1], y[1], inner), PLASTER);
    };
    block([-HALF_LENGTH_M, HALF_LENGTH_M], [-0.01, SILL_M]);
    block([-HALF_LENGTH_M, HALF_LENGTH_M], [LINTEL_M, HEIGHT_M]);
    let mut last = -HALF_LENGTH_M;
    for middle in WINDOW_MIDDLES_M {
        block([last, middle - HALF_WINDOW_M], [SILL_M, LINTEL_M]);
        last = middle + HALF_WINDOW_M;
    }
    block([last, HALF_LENGTH_M], [SILL_M, LINTEL_M]);
    for middle in WINDOW_MIDDLES_M {
        add_frame(builder, middle);
    }
}

/// Bars of a window, and the board below it.
fn add_frame(builder: &mut MeshBuilder, middle: f32) {
    let z = [-HALF_WIDTH_M - 0.22, -HALF_WIDTH_M - 0.15];
    let mut bar = |x: [f32; 2], y: [f32; 2]| {
        builder.cuboid(Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]), FRAME);
    };
    let left = middle - HALF_WINDOW_M;
    let right = middle + HALF_WINDOW_M;
    for x in [left, middle - 0.03, right - 0.06] {
        bar([x, x + 0.06], [SILL_M, LINTEL_M]);
    }
    for y in [SILL_M, 0.5 * (SILL_M + LINTEL_M) + 0.3, LINTEL_M - 0.06] {
        bar([left, right], [y, y + 0.06]);
    }
    let board = [
        Vec3::new(left - 0.08, SILL_M, -HALF_WIDTH_M - 0.12),
        Vec3::new(right + 0.08, SILL_M + 0.05, 0.16 - HALF_WIDTH_M),
    ];
    builder.cuboid(board[0], board[1], WOOD);
}

fn add_skirting(builder: &mut MeshBuilder) {
    let x = HALF_LENGTH_M;
    let z = HALF_WIDTH_M;
    for [min, max] in [
        [Vec3::new(-x, 0.0, -z), Vec3::new(x, 0.14, 0.025 - z)],
        [Vec3::new(-x, 0.0, z - 0.025), Vec3::new(x, 0.14, z)],
        [Vec3::new(-x, 0.0, -z), Vec3::new(0.025 - x, 0.14, z)],
        [Vec3::new(x - 0.025, 0.0, -z), Vec3::new(x, 0.14, z)],
    ] {
        builder.cuboid(min, max, FRAME);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gallery_is_a_closed_room_but_for_its_windows() {
        let scene = gallery();
        let triangles = scene.triangle_count();
        assert!((50_000..150_000).contains(&triangles), "{triangles} triangles");
        let volume = scene.bounds();
        assert!(volume.min.cmple(-Vec3::new(HALF_LENGTH_M, 0.0, HALF_WIDTH_M)).all(), "{volume:?}");
        assert!(scene.vertices_in_world().all(Vec3::is_finite));
        let eye = scene.cameras[0].world_from_camera.translation;
        assert!(Vec3::from(eye).distance(EYE) < 1e-6);
        let glowing = scene.materials.iter().filter(|material| material.emissive_linear != Vec3::ZERO);
        assert_eq!(glowing.count(), 2);
    }
}
