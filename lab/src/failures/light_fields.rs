//! Layered light fields of shapes in closed form, sampled by the host alone.

use depth_image::{Aabb, LayeredLightField, LightDirections, LightFieldCamera, Ray, rgb9e5_from_linear};
use glam::{Vec2, Vec3};

/// A surface on a line that faces back along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lit {
    /// The line's parameter.
    pub t: f32,
    /// Grey, linear.
    pub light: f32,
}

/// The light field of all that lines meet.
pub fn light_field(
    bounds: Aabb,
    (directions, side_px): (LightDirections, u32),
    met: impl Fn(Ray) -> Vec<Lit>,
) -> LayeredLightField {
    let camera = LightFieldCamera::around(bounds, directions, side_px);
    let (mut first, mut samples) = (vec![0], Vec::new());
    for direction in directions.all() {
        let lines = camera.lines(direction.towards);
        for place in (0..side_px).flat_map(|y| (0..side_px).map(move |x| Vec2::new(x as f32, y as f32))) {
            let mut line = met(lines.ray(place + 0.5));
            line.retain(|lit| (0.0..=lines.range_m).contains(&lit.t));
            line.sort_by(|a, b| a.t.total_cmp(&b.t));
            samples.extend(line);
            first.push(samples.len() as u32);
        }
    }
    LayeredLightField {
        camera,
        first,
        planar_depth_m: samples.iter().map(|lit| lit.t).collect(),
        radiance_rgb9e5: samples.iter().map(|lit| rgb9e5_from_linear(Vec3::splat(lit.light))).collect(),
    }
}
