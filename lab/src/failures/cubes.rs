//! Layered depth cubes of shapes in closed form, sampled and walked by the host alone.

use depth_image::{Aabb, CubeGrid, LayeredDepthImage, Ray, oct8_from_unit};
use glam::{Vec2, Vec3};
use reconstruction::scalar::CubeTwin;

use super::measures::share;

/// Samples of a cube are those whose normal has this share of its greatest component along the axis.
const DOMINANT: f32 = 0.9;
/// Rays begin so far away: outside of all cubes here.
const DISTANCE_M: f32 = 60.0;
/// A ray has met another surface where it ends so far from the true one, in spacings.
const ANOTHER: f32 = 0.5;

/// Where a ray crosses a surface, and the normal on the side that is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The ray's parameter.
    pub t: f32,
    pub normal_in_world: Vec3,
}

/// Lines 1 m apart, `side` along each edge, at whole metres from 0 on.
///
/// # Errors
/// A side that no cube has.
pub fn grid(side: u32) -> anyhow::Result<CubeGrid> {
    Ok(CubeGrid::around(&Aabb { min: Vec3::ZERO, max: Vec3::splat((side - 1) as f32) }, side)?)
}

/// The image along an axis.
pub fn image(grid: &CubeGrid, axis: usize, crossings: impl Fn(Ray) -> Vec<Crossing>) -> LayeredDepthImage {
    let camera = grid.camera(axis);
    let mut first = vec![0];
    let mut samples = Vec::new();
    for place in (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| Vec2::new(x as f32, y as f32))) {
        let mut line = crossings(camera.ray(place + 0.5));
        line.retain(|crossing| {
            let normal = (grid.world_from_cube.inverse() * crossing.normal_in_world).abs();
            normal[axis] >= DOMINANT * normal.max_element() && (0.0..=camera.range_m).contains(&crossing.t)
        });
        line.sort_by(|a, b| a.t.total_cmp(&b.t));
        samples.extend(line);
        first.push(samples.len() as u32);
    }
    LayeredDepthImage {
        camera,
        first,
        planar_depth_m: samples.iter().map(|crossing| crossing.t).collect(),
        plane_normal_oct8: samples.iter().map(|crossing| oct8_from_unit(crossing.normal_in_world)).collect(),
        color_rgb9e5: vec![0; samples.len()],
        normal_oct16: None,
        specular: None,
        truncated: false,
    }
}

/// The three images of a cube, ready for rays.
pub fn cube(grid: &CubeGrid, crossings: impl Fn(Ray) -> Vec<Crossing>) -> CubeTwin {
    CubeTwin::new(grid, &[0, 1, 2].map(|axis| image(grid, axis, &crossings)))
}

/// The first surface that faces a ray.
pub fn nearest(ray: Ray, crossings: impl Fn(Ray) -> Vec<Crossing>) -> Option<f32> {
    let facing = crossings(ray)
        .into_iter()
        .filter(|crossing| crossing.t >= 0.0 && crossing.normal_in_world.dot(ray.direction_in_world) < 0.0);
    facing.map(|crossing| crossing.t).min_by(f32::total_cmp)
}

/// A ray of unit direction to a point, from a direction.
pub fn ray_to(point_in_world: Vec3, from: Vec3) -> Ray {
    let back = from.normalize_or(Vec3::Y);
    Ray { origin_in_world: point_in_world + back * DISTANCE_M, direction_in_world: -back }
}

/// Rays from all around to points within a ball.
pub fn rays_around(middle: Vec3, radius_m: f32, count: u32) -> impl Iterator<Item = Ray> {
    (0..count).map(move |seed| {
        let [a, b, c, d, e] = noise(seed);
        ray_to(middle + unit([a, b]) * radius_m * c.cbrt(), unit([d, e]))
    })
}

/// Where a ray of unit direction ends, in truth and in a cube.
pub fn both(twin: &CubeTwin, crossings: impl Fn(Ray) -> Vec<Crossing>, ray: Ray) -> (Option<f32>, Option<f32>) {
    (nearest(ray, crossings), twin.walk(ray, 0.0).map(|hit| hit.t))
}

/// The share of rays to surfaces that meet nothing, or another surface behind.
pub fn missed(of: impl IntoIterator<Item = (Option<f32>, Option<f32>)>) -> f64 {
    let to_surfaces = of.into_iter().filter_map(|(truth, met)| Some((truth?, met)));
    share(to_surfaces.map(|(truth, met)| met.is_none_or(|met| met > truth + ANOTHER)))
}

/// The share of rays that meet something where nothing is, or before the first surface.
pub fn met_wrongly(of: impl IntoIterator<Item = (Option<f32>, Option<f32>)>) -> f64 {
    let met = of.into_iter();
    share(met.map(|(truth, met)| met.is_some_and(|met| truth.is_none_or(|truth| met < truth - ANOTHER))))
}

/// From 0 to 1, without order; others for each seed.
pub fn noise<const N: usize>(seed: u32) -> [f32; N] {
    std::array::from_fn(|part| {
        // PCG's output function (Jarzynski, Olano 2020).
        let state = (seed * N as u32 + part as u32).wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        ((word >> 22) ^ word) as f32 / u32::MAX as f32
    })
}

/// A unit vector of two numbers from 0 to 1.
pub fn unit([a, b]: [f32; 2]) -> Vec3 {
    let up = 2.0 * a - 1.0;
    (Vec2::from_angle(std::f32::consts::TAU * b) * (1.0 - up * up).max(0.0).sqrt()).extend(up)
}
