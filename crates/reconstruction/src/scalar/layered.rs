//! Twin of `layered.wgsl`: every ray against the plane of every sample of a layered depth cube.

use depth_image::{CubeGrid, LayeredDepthImage, PinholeCamera, ProvenanceKind, Ray, View, linear_from_rgb9e5};
use glam::{IVec2, Vec2, Vec3};
use gpu::cube_walk::SQUARE_REACH;

use super::{pixel::Pixel, surface::bilinear_shares, view, view_ray::places};
use crate::cube::{CubeSamples, LEAST_NORMAL_ALONG_LINE, Links, links};
use crate::set_description::SetDescription;

/// A layered depth cube without any order in space.
pub struct CubeTwin {
    grid: CubeGrid,
    samples: CubeSamples,
    links: Vec<Links>,
}

/// Where a ray meets a sample's plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubeHit {
    /// The ray's parameter.
    pub t: f32,
    /// Among the samples of all axes.
    pub sample: usize,
    /// From the middle of the line's square, in spacings.
    pub place: Vec2,
}

impl CubeTwin {
    /// Of images along the grid's axes.
    #[must_use]
    pub fn new(grid: &CubeGrid, images: &[LayeredDepthImage; 3]) -> Self {
        let samples = CubeSamples::of(grid, images);
        Self { grid: *grid, links: links(&samples), samples }
    }

    /// The nearest surface on a ray, from `near` on.
    #[must_use]
    pub fn walk(&self, ray: Ray, near: f32) -> Option<CubeHit> {
        let cube_from_world = self.grid.world_from_cube.inverse();
        let origin = cube_from_world * (ray.origin_in_world - self.grid.corner_in_world) / self.grid.spacing_m;
        let direction = cube_from_world * ray.direction_in_world / self.grid.spacing_m;
        let hits = (0..self.samples.len()).filter_map(|sample| self.met(sample, origin, direction));
        hits.filter(|hit| hit.t >= near).min_by(|a, b| a.t.total_cmp(&b.t))
    }

    fn met(&self, sample: usize, origin: Vec3, direction: Vec3) -> Option<CubeHit> {
        let samples = &self.samples;
        let line = self.samples.line[sample];
        let axis = samples.axis_of(line);
        let at = samples.place_of(axis, line).as_vec2() + 0.5;
        let [along, next, last] = [0, 1, 2].map(|offset| (axis + offset) % 3);
        let mut point = Vec3::ZERO;
        (point[along], point[next], point[last]) = (samples.depth[sample], at.x, at.y);
        let normal = samples.normal[sample];
        let facing = normal.dot(direction);
        let t = normal.dot(point - origin) / facing;
        let off = origin + direction * t - point;
        let place = Vec2::new(off[next], off[last]);
        let is_within = place.abs().max_element() <= SQUARE_REACH && normal[along].abs() >= LEAST_NORMAL_ALONG_LINE;
        (facing < 0.0 && is_within).then_some(CubeHit { t, sample, place })
    }

    /// The colour between the four lines around a hit.
    #[must_use]
    pub fn color_linear(&self, hit: &CubeHit) -> Vec3 {
        let is_after = hit.place.cmpgt(Vec2::ZERO);
        let towards = IVec2::new(i32::from(is_after.x), 2 + i32::from(is_after.y));
        let beside = self.neighbour(hit.sample, towards.x);
        let around = [
            Some(hit.sample),
            beside,
            self.neighbour(hit.sample, towards.y),
            beside.and_then(|beside| self.neighbour(beside, towards.y)),
        ];
        let at = hit.place.abs().min(Vec2::splat(0.5));
        let mut sum = Vec3::ZERO;
        let mut shares = 0.0;
        for (sample, share) in around.into_iter().zip(bilinear_shares(at)) {
            let Some(sample) = sample else { continue };
            sum += linear_from_rgb9e5(self.samples.color_rgb9e5[sample]) * share;
            shares += share;
        }
        sum / shares
    }

    fn neighbour(&self, sample: usize, towards: i32) -> Option<usize> {
        let other = self.links[sample][towards as usize] as usize;
        (other != sample).then_some(other)
    }

    /// A view with depth and provenance.
    #[must_use]
    pub fn reconstruct(&self, set: &SetDescription<'_>, camera: &PinholeCamera) -> View {
        let pixels = places(camera.size_px).map(|place| {
            let Some(hit) = self.walk(camera.ray(place.as_vec2() + 0.5), camera.near_m) else {
                return Pixel::without_surface(ProvenanceKind::Empty);
            };
            let axis = self.samples.axis_of(self.samples.line[hit.sample]);
            Pixel::hit(self.color_linear(&hit), hit.t, 1 << axis)
        });
        view(&pixels.collect::<Vec<_>>(), set, camera)
    }
}
