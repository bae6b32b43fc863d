//! What several scenes are made of: checks, balls, other closed surfaces, and mirrors.

use glam::Vec3;

use super::geometry::{MeshBuilder, vertex};
use crate::Material;

const LIGHT_CHECK: Vec3 = Vec3::splat(214.0);
const DARK_CHECK: Vec3 = Vec3::new(54.0, 62.0, 74.0);
/// The step to either side from which a normal is computed, radians.
const STEP: f32 = 1e-3;

/// A metal without roughness.
pub fn mirror(reflectance: f32) -> Material {
    let base_color_linear = [reflectance, reflectance, reflectance, 1.0];
    Material { name: "mirror".into(), base_color_linear, metallic: 1.0, roughness: 0.0, ..Material::default() }
}

/// A floor of 1 m checks at the origin.
pub fn checks(builder: &mut MeshBuilder, half_side_m: u32) {
    let corner = Vec3::new(-1.0, 0.0, -1.0) * half_side_m as f32;
    checked(builder, corner, [Vec3::Z, Vec3::X], [2 * half_side_m; 2]);
}

/// Checks of 1 m from a corner on, to the right and up.
pub fn checked(builder: &mut MeshBuilder, corner: Vec3, [right, up]: [Vec3; 2], [columns, rows]: [u32; 2]) {
    for row in 0..rows {
        for column in 0..columns {
            let middle = corner + right * (column as f32 + 0.5) + up * (row as f32 + 0.5);
            let color_srgb = if (row + column).is_multiple_of(2) { LIGHT_CHECK } else { DARK_CHECK };
            builder.rectangle(middle, right * 0.5, up * 0.5, color_srgb);
        }
    }
}

/// A ball of 3,968 triangles.
pub fn ball(builder: &mut MeshBuilder, middle: Vec3, radius_m: f32, color_srgb: Vec3) {
    star(builder, [64, 32], color_srgb, |out| middle + out * radius_m);
}

/// A closed surface with a point for each direction from its middle, and the normals of the smooth surface.
pub fn star(builder: &mut MeshBuilder, segments: [u32; 2], color_srgb: Vec3, point: impl Fn(Vec3) -> Vec3) {
    builder.closed(segments, |out| vertex(point(out), normal_of(&point, out), color_srgb));
}

/// From differences to two sides.
fn normal_of(point: &impl Fn(Vec3) -> Vec3, out: Vec3) -> Vec3 {
    let right = out.any_orthonormal_vector();
    let up = out.cross(right);
    let [to_right, upwards] = [right, up].map(|aside| {
        let [ahead, behind] = [aside, -aside].map(|step| point((out + step * STEP).normalize_or(out)));
        ahead - behind
    });
    to_right.cross(upwards).normalize_or(out)
}
