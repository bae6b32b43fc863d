//! Scenes with mirrors: a teapot before a dented mirror, a ball between two plane mirrors, two mirror balls in a hall, and a box.

use depth_image::Light;
use glam::Vec3;

use super::geometry::{MeshBuilder, matt, vertex};
use super::random::Noise;
use super::teapot::{Teapot, teapot};
use crate::{Material, Scene};

const LIGHT_CHECK: Vec3 = Vec3::splat(214.0);
const DARK_CHECK: Vec3 = Vec3::new(54.0, 62.0, 74.0);
/// The colour of a matt back.
const BACK: Vec3 = Vec3::new(70.0, 66.0, 62.0);

/// The pebble: its mean radius, and its middle. The middle of the teapot is 4 m from its side.
const PEBBLE_M: f32 = 3.0;
const PEBBLE_MIDDLE: Vec3 = Vec3::new(0.0, 3.1, -4.5);
const PEBBLE_COLUMNS: u32 = 200;
const PEBBLE_ROWS: u32 = 100;
/// The depth of its dents in radii, and their size.
const DENT: f32 = 0.07;
const DENT_SIZE: f32 = 1.6;
const TEAPOT_FOOT: Vec3 = Vec3::new(0.0, 0.0, 2.5);
/// The step to either side from which a normal is computed, radians.
const STEP: f32 = 1e-3;

/// The half distance of the two mirrors, and their half width and height, metres.
const HALF_DISTANCE_M: f32 = 2.0;
const HALF_WIDTH_M: f32 = 3.0;
const HEIGHT_M: f32 = 3.0;

/// The half width of the box, its height, and the sides of its post.
const BOX_HALF_M: f32 = 2.0;
const BOX_HEIGHT_M: f32 = 3.0;
const POST_SIDES: u32 = 64;

const HALL_HALF_SIDE_M: u32 = 4;
const HALL_HEIGHT_M: u32 = 4;

/// Newell's teapot on a floor of 24 m with checks of 1 m, before a mirror of 39,600 triangles that is convex
/// with dents.
#[must_use]
pub fn teapot_mirror() -> Scene {
    let mut builder = MeshBuilder::default();
    checks(&mut builder, 12);
    teapot(&mut builder, Teapot { foot: TEAPOT_FOOT, scale: 1.0, squares: 16 });
    builder.finish_part(0);
    pebble(&mut builder);
    builder.finish_part(1);
    builder.into_scene_of("teapot-mirror", vec![matt("matt"), mirror(0.9)]).with_default_background()
}

/// A ball and a post on a floor with checks of 1 m, between two plane mirrors of 6 × 3 m that face each other 4 m apart.
#[must_use]
pub fn mirror_pair() -> Scene {
    let mut builder = MeshBuilder::default();
    checks(&mut builder, 4);
    ball(&mut builder, Vec3::new(-0.4, 0.9, 0.0), 0.6, Vec3::new(204.0, 92.0, 48.0));
    builder.cuboid(Vec3::new(0.7, 0.0, -1.1), Vec3::new(1.0, 1.9, -0.8), Vec3::new(64.0, 130.0, 190.0));
    let across = Vec3::Z * HALF_WIDTH_M;
    let up = Vec3::Y * (HEIGHT_M * 0.5);
    let place = |side: f32, behind_m: f32| Vec3::new(side * (HALF_DISTANCE_M + behind_m), HEIGHT_M * 0.5, 0.0);
    for side in [1.0, -1.0] {
        // The back.
        builder.rectangle(place(side, 0.05), across * -side, up, BACK);
    }
    builder.finish_part(0);
    for side in [1.0, -1.0] {
        builder.rectangle(place(side, 0.0), across * side, up, Vec3::splat(255.0));
    }
    builder.finish_part(1);
    builder.into_scene_of("mirror-pair", vec![matt("matt"), mirror(0.8)]).with_default_background()
}

/// Two mirror balls of radius 1.5 m and a teapot of half its size in a hall of 8 × 4 × 8 m with checks of 1 m, open to the sky.
#[must_use]
pub fn mirror_hall() -> Scene {
    let mut builder = MeshBuilder::default();
    checks(&mut builder, HALL_HALF_SIDE_M);
    let half_side_m = HALL_HALF_SIDE_M as f32;
    for inwards in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        let right = Vec3::Y.cross(inwards);
        let corner = -half_side_m * (inwards + right);
        checked(&mut builder, corner, [right, Vec3::Y], [2 * HALL_HALF_SIDE_M, HALL_HEIGHT_M]);
    }
    teapot(&mut builder, Teapot { foot: Vec3::new(0.0, 0.0, 0.8), scale: 0.5, squares: 16 });
    builder.finish_part(0);
    for side in [-1.0, 1.0] {
        ball(&mut builder, Vec3::new(2.0 * side, 1.5, -1.8), 1.5, Vec3::splat(255.0));
    }
    builder.finish_part(1);
    builder.into_scene_of("mirror-hall", vec![matt("matt"), mirror(0.8)]).with_default_background()
}

/// A ball and a post that mirror, in a box of 4 × 3 × 4 m without a front and a ceiling, with coloured walls, a glossy floor and four
/// lamps: after the first scene of Lischinski and Rappoport.
#[must_use]
pub fn mirror_box() -> Scene {
    let mut builder = MeshBuilder::default();
    let [right, up, back] = [Vec3::X * BOX_HALF_M, Vec3::Y * (BOX_HEIGHT_M * 0.5), Vec3::NEG_Z * BOX_HALF_M];
    builder.rectangle(up + back, right, up, Vec3::new(206.0, 200.0, 188.0));
    builder.rectangle(up - right, back, up, Vec3::new(188.0, 66.0, 52.0));
    builder.rectangle(up + right, -back, up, Vec3::new(58.0, 96.0, 176.0));
    builder.finish_part(0);
    checked(&mut builder, back - right, [Vec3::Z, Vec3::X], [2 * BOX_HALF_M as u32; 2]);
    builder.finish_part(1);
    star(&mut builder, [128, 64], Vec3::splat(255.0), |out| Vec3::new(-0.75, 0.8, 0.3) + out * 0.8);
    post(&mut builder, Vec3::new(0.95, 0.0, -0.75), 0.55, 1.9);
    builder.finish_part(2);
    let floor = Material { roughness: 0.4, ..matt("floor") };
    let mut scene =
        builder.into_scene_of("mirror-box", vec![matt("matt"), floor, mirror(0.85)]).with_default_background();
    let lamp = |x: f32, z: f32| Light::Point {
        position_in_world: Vec3::new(x, BOX_HEIGHT_M + 0.6, z),
        intensity_linear: Vec3::splat(3.0),
        radius_m: 0.1,
    };
    scene.illumination.lights = vec![lamp(-1.2, -1.2), lamp(1.2, -1.2), lamp(-1.2, 1.2), lamp(1.2, 1.2)];
    scene
}

/// An upright cylinder with a lid, whose sides are smooth.
fn post(builder: &mut MeshBuilder, foot: Vec3, radius_m: f32, height_m: f32) {
    let white = Vec3::splat(255.0);
    let out = |number: u32| {
        let (sin, cos) = (std::f32::consts::TAU * number as f32 / POST_SIDES as f32).sin_cos();
        Vec3::new(cos, 0.0, -sin)
    };
    let at = |number: u32, up_m: f32| foot + out(number) * radius_m + Vec3::Y * up_m;
    for number in 0..POST_SIDES {
        let places = [(number, 0.0), (number + 1, 0.0), (number + 1, height_m), (number, height_m)];
        let corners = places.map(|(number, up_m)| builder.push(vertex(at(number, up_m), out(number), white)));
        builder.quad(corners);
    }
    for first in (0..POST_SIDES).step_by(2) {
        let middle = foot + Vec3::Y * height_m;
        builder.facet([middle, at(first, height_m), at(first + 1, height_m), at(first + 2, height_m)], white);
    }
}

/// A metal without roughness.
pub(super) fn mirror(reflectance: f32) -> Material {
    let base_color_linear = [reflectance, reflectance, reflectance, 1.0];
    Material { name: "mirror".into(), base_color_linear, metallic: 1.0, roughness: 0.0, ..Material::default() }
}

/// A floor of 1 m checks at the origin.
fn checks(builder: &mut MeshBuilder, half_side_m: u32) {
    let corner = Vec3::new(-1.0, 0.0, -1.0) * half_side_m as f32;
    checked(builder, corner, [Vec3::Z, Vec3::X], [2 * half_side_m; 2]);
}

/// Checks of 1 m from a corner on, to the right and up.
pub(super) fn checked(builder: &mut MeshBuilder, corner: Vec3, [right, up]: [Vec3; 2], [columns, rows]: [u32; 2]) {
    for row in 0..rows {
        for column in 0..columns {
            let middle = corner + right * (column as f32 + 0.5) + up * (row as f32 + 0.5);
            let color_srgb = if (row + column).is_multiple_of(2) { LIGHT_CHECK } else { DARK_CHECK };
            builder.rectangle(middle, right * 0.5, up * 0.5, color_srgb);
        }
    }
}

pub(super) fn ball(builder: &mut MeshBuilder, middle: Vec3, radius_m: f32, color_srgb: Vec3) {
    star(builder, [64, 32], color_srgb, |out| middle + out * radius_m);
}

fn pebble(builder: &mut MeshBuilder) {
    let noise = Noise::new(14);
    let radius_m = |out: Vec3| PEBBLE_M * (1.0 + DENT * noise.in_space(out * DENT_SIZE + 3.3));
    star(builder, [PEBBLE_COLUMNS, PEBBLE_ROWS], Vec3::splat(255.0), |out| PEBBLE_MIDDLE + out * radius_m(out));
}

/// A closed surface with a point for each direction from its middle, and the normals of the smooth surface.
pub(super) fn star(builder: &mut MeshBuilder, segments: [u32; 2], color_srgb: Vec3, point: impl Fn(Vec3) -> Vec3) {
    builder.closed(segments, |out| vertex(point(out), normal_of(&point, out), color_srgb));
}

/// From differences to two sides.
fn normal_of(point: &impl Fn(Vec3) -> Vec3, out: Vec3) -> Vec3 {
    let right = out.any_orthonormal_vector();
    let up = out.cross(right);
    let beside = |aside: Vec3| point((out + aside * STEP).normalize_or(out));
    let slope = |aside: Vec3| beside(aside) - beside(-aside);
    slope(right).cross(slope(up)).normalize_or(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_with_mirrors_have_the_triangles_that_they_promise() {
        let triangles =
            |scene: &Scene| -> Vec<u32> { scene.meshes[0].parts.iter().map(|part| part.index_count / 3).collect() };
        assert_eq!(triangles(&teapot_mirror()), [2 * 24 * 24 + 16_384, 39_600]);
        assert_eq!(triangles(&mirror_pair()), [2 * 8 * 8 + 2 * 64 * 31 + 12 + 4, 4]);
        assert_eq!(triangles(&mirror_box()), [6, 2 * 4 * 4, 2 * 128 * 63 + 2 * 64 + 64]);
        assert_eq!(triangles(&mirror_hall()), [2 * 8 * (8 + 4 * 4) + 16_384, 2 * 2 * 64 * 31]);
    }

    /// Every wall's front is towards the middle of the hall.
    #[test]
    fn the_hall_is_seen_from_within() {
        let mesh = &mirror_hall().meshes[0];
        let walls = mesh.indices.as_chunks::<3>().0.iter().take(2 * 8 * (8 + 4 * 4));
        for corners in walls {
            let [a, b, c] = corners.map(|corner| Vec3::from(mesh.vertices[corner as usize].position));
            assert!((b - a).cross(c - a).dot(Vec3::Y * 2.0 - a) > 0.0, "{a}");
        }
    }

    #[test]
    fn the_pebble_is_concave_in_places_and_its_normals_are_those_of_its_facets() {
        let mesh = &teapot_mirror().meshes[0];
        let part = &mesh.parts[1];
        let at = |index: u32| mesh.vertices[index as usize];
        let (mut least, mut concave) = (1.0_f32, 0);
        for corners in mesh.indices[part.first_index as usize..].chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(at(corners[i]).position));
            let [m, n, o] = [0, 1, 2].map(|i| Vec3::from(at(corners[i]).normal));
            let out = (b - a).cross(c - a).normalize_or((m + n + o).normalize_or(Vec3::Y));
            least = least.min(out.dot(m)).min(out.dot(n)).min(out.dot(o));
            concave += u32::from((n - m).dot(b - a) < 0.0 && (o - m).dot(c - a) < 0.0);
        }
        assert!(least > 0.95, "{least}");
        assert!((200..12_000).contains(&concave), "{concave} of 39,600 triangles are concave");
    }
}
