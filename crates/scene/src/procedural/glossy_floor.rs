//! A teapot on a glossy floor, alone and among balls: after the second and third scene of Lischinski and Rappoport, *Image-Based
//! Rendering for Non-Diffuse Synthetic Scenes* (1998).

use depth_image::Light;
use glam::Vec3;

use super::geometry::{MeshBuilder, matt};
use super::mirrors::{ball, checked, mirror};
use super::teapot::{Teapot, teapot};
use crate::{Material, Scene};

/// The half side of the floor, and the height of the two walls, in checks of 1 m.
const HALF_SIDE_M: u32 = 5;
const HEIGHT_M: u32 = 5;
/// As wide as Phong's lobe of exponent 40 around the mirrored direction.
const FLOOR_ROUGHNESS: f32 = 0.33;

const BALL_M: f32 = 0.35;
const BALL_DISTANCE_M: f32 = 0.9;
/// The rows of balls on either side of the teapot: number, and distance from its middle. Those of the middle row mirror.
const ROWS: [(u32, f32); 3] = [(10, 2.6), (9, 3.4), (10, 4.2)];
const MATT_BALLS: [Vec3; 2] = [Vec3::new(204.0, 92.0, 48.0), Vec3::new(64.0, 130.0, 190.0)];

/// Newell's teapot of 9,216 triangles on a floor of 10 m whose glossy reflection shows it and two walls of checks,
/// under two lamps.
#[must_use]
pub fn teapot_floor() -> Scene {
    let mut builder = MeshBuilder::default();
    room(&mut builder);
    builder.into_scene_of("teapot-floor", materials()).under_lamps()
}

/// The same among 58 balls in rows, of which 18 are mirrors. A line through the longest rows meets 20 surfaces.
#[must_use]
pub fn teapot_spheres() -> Scene {
    let mut builder = MeshBuilder::default();
    room(&mut builder);
    let [outer, middle] = [[ROWS[0], ROWS[2]].as_slice(), &ROWS[1..2]];
    for (material, rows, colors_srgb) in [(0, outer, MATT_BALLS), (2, middle, [Vec3::splat(255.0); 2])] {
        for &(count, aside_m) in rows {
            [-aside_m, aside_m].iter().for_each(|&z_m| row(&mut builder, (count, z_m), colors_srgb));
        }
        builder.finish_part(material);
    }
    builder.into_scene_of("teapot-spheres", materials()).under_lamps()
}

fn materials() -> Vec<Material> {
    let base_color_linear = [0.7, 0.7, 0.72, 1.0];
    let floor = Material { base_color_linear, metallic: 0.9, roughness: FLOOR_ROUGHNESS, ..matt("floor") };
    vec![matt("matt"), floor, mirror(0.8)]
}

/// The teapot and two walls, then the floor.
fn room(builder: &mut MeshBuilder) {
    let half_side_m = HALF_SIDE_M as f32;
    for inwards in [Vec3::X, Vec3::Z] {
        let right = Vec3::Y.cross(inwards);
        let corner = -half_side_m * (inwards + right);
        checked(builder, corner, [right, Vec3::Y], [2 * HALF_SIDE_M, HEIGHT_M]);
    }
    teapot(builder, Teapot { foot: Vec3::ZERO, scale: 1.0, squares: 12 });
    builder.finish_part(0);
    builder.rectangle(Vec3::ZERO, Vec3::Z * half_side_m, Vec3::X * half_side_m, Vec3::splat(255.0));
    builder.finish_part(1);
}

/// A row of balls along x, in two colours by turns.
fn row(builder: &mut MeshBuilder, (count, z_m): (u32, f32), colors_srgb: [Vec3; 2]) {
    for number in 0..count {
        let x_m = (number as f32 - 0.5 * (count - 1) as f32) * BALL_DISTANCE_M;
        ball(builder, Vec3::new(x_m, BALL_M, z_m), BALL_M, colors_srgb[number as usize % 2]);
    }
}

impl Scene {
    /// Two lamps in place of the sun.
    fn under_lamps(mut self) -> Self {
        let lamp = |x_m: f32, z_m: f32| Light::Point {
            position_in_world: Vec3::new(x_m, 6.0, z_m),
            intensity_linear: Vec3::splat(28.0),
            radius_m: 0.3,
        };
        self.illumination.lights = vec![lamp(3.5, 2.0), lamp(-1.0, 5.5)];
        self.with_default_background()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEAPOT_AND_WALLS: u32 = 9_216 + 2 * 2 * 2 * HALF_SIDE_M * HEIGHT_M;
    const BALL: u32 = 2 * 64 * 31;

    fn triangles(scene: &Scene) -> Vec<u32> {
        scene.meshes[0].parts.iter().map(|part| part.index_count / 3).collect()
    }

    #[test]
    fn scenes_with_a_glossy_floor_have_the_triangles_that_they_promise() {
        assert_eq!(triangles(&teapot_floor()), [TEAPOT_AND_WALLS, 2]);
        assert_eq!(triangles(&teapot_spheres()), [TEAPOT_AND_WALLS, 2, 40 * BALL, 18 * BALL]);
    }

    /// The surfaces on a line along x, by the signs of areas in the plane across it.
    #[test]
    fn a_line_through_a_row_of_balls_meets_ten_layers() {
        let mesh = &teapot_spheres().meshes[0];
        let line = Vec3::new(0.0, BALL_M + 0.011, ROWS[0].1 + 0.007);
        let is_met = |corners: &[u32]| {
            let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(mesh.vertices[corners[i] as usize].position) - line);
            let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| from.cross(to).x > 0.0);
            sides == [true; 3] || sides == [false; 3]
        };
        let layers = mesh.indices.chunks_exact(3).filter(|corners| is_met(corners)).count();
        // The wall at the end is one more.
        assert_eq!(layers, 2 * 10 + 1);
    }
}
