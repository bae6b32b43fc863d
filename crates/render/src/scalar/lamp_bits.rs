//! The twin of `lamp_bits.wgsl`.

use depth_image::{Light, PinholeCamera};
use glam::Vec3;

pub use crate::grid::grid_place;

/// As the shader's constants.
const BIAS_TEXELS: f32 = 0.5;
const BIAS_TEXELS_A_SLOPE: f32 = 0.75;
const MOST_SLOPE: f32 = 8.0;

/// A surface that light falls on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct LitPoint {
    pub point_in_world: Vec3,
    pub normal_in_world: Vec3,
}

/// The bits of a pixel and lamp among those of [`Renderer::draw_lamp_bits`](crate::Renderer::draw_lamp_bits), in the order of rays:
/// [`grid_place`] tells their places.
pub fn bits_of_lamp(
    words: &[u32],
    grid_side: u32,
    light_count: usize,
    lamp: usize,
    pixel: usize,
) -> impl Iterator<Item = bool> {
    let count = grid_side * grid_side;
    let first = (pixel * light_count + lamp) * count.div_ceil(32) as usize;
    (0..count).map(move |bit| words[first + bit as usize / 32] >> (bit % 32) & 1 != 0)
}

/// Whether a point faces a place of a lamp, on the side to which that shines.
#[must_use]
pub fn faces(light: &Light, lit: LitPoint, place_in_world: Vec3) -> bool {
    let &Light::Rectangle { half_edges_in_world: [u, v], .. } = light else { return false };
    let towards = place_in_world - lit.point_in_world;
    lit.normal_in_world.dot(towards) > 0.0 && u.cross(v).dot(towards) < 0.0
}

/// Whether a point is seen from the eye of a map of inverse depths; `None` where the map does not hold it.
#[must_use]
pub fn seen_in_map(camera: &PinholeCamera, inverse_depth_per_m: &[f32], lit: LitPoint) -> Option<bool> {
    let from_eye = lit.point_in_world - camera.eye_in_world;
    let at = camera.project(lit.point_in_world).filter(|at| at.planar_depth_m > camera.near_m)?;
    if !camera.contains(at.pixel) {
        return None;
    }
    let texel = at.pixel.as_uvec2();
    let nearest = inverse_depth_per_m[(texel.y * camera.size_px.x + texel.x) as usize];
    let cosine = lit.normal_in_world.dot(-from_eye.normalize_or_zero());
    let slope = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine.max(1e-6);
    let texels = BIAS_TEXELS + BIAS_TEXELS_A_SLOPE * slope.min(MOST_SLOPE);
    let texel_m = at.planar_depth_m / camera.focal_px.min_element();
    Some(nearest * (at.planar_depth_m - texels * texel_m) <= 1.0)
}
