//! The sun's shadow map of reliefs, as in the paper: reliefs cast shadows on what stands beside them, and receive them.

use depth_image::{PinholeCamera, Ray};
use glam::{UVec2, Vec3};
use rayon::prelude::*;

use super::placements::Placements;
use super::relief::Relief;
use crate::impostors::rays::unit_rays;

/// The way to the sun.
pub const SUN: Vec3 = Vec3::new(0.75, 0.6, -0.5);
const SIZE_PX: UVec2 = UVec2::splat(1024);
/// In reaches of the park: rays are nearly parallel.
const DISTANCE: f32 = 30.0;
/// Surfaces are in the shadow of what lies this many texels before them, and this far.
const BIAS_PX: f32 = 1.5;
const BIAS_M: f32 = 0.01;

/// How far the sun's rays come.
pub struct SunMap {
    camera: PinholeCamera,
    ways_m: Vec<f32>,
    texel_m: f32,
    pub seconds: f64,
}

impl SunMap {
    /// # Errors
    /// The device fails.
    pub fn draw(relief: &Relief<'_>, placements: &Placements, reach_m: f32) -> anyhow::Result<Self> {
        let eye = SUN.normalize_or_zero() * (DISTANCE * reach_m);
        let fov_y_rad = 2.0 * (1.0 / DISTANCE).asin();
        let camera = PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, fov_y_rad, SIZE_PX);
        let rays: Vec<Ray> = unit_rays(&camera).collect();
        let found = relief.draw(placements, &camera, &rays)?;
        let ways_m = found.hits.par_iter().map(|hit| hit.map_or(f32::INFINITY, |hit| hit.t));
        let texel_m = 2.0 * reach_m / SIZE_PX.y as f32;
        Ok(Self { camera, ways_m: ways_m.collect(), texel_m, seconds: found.seconds })
    }

    pub fn is_in_shadow(&self, point: Vec3) -> bool {
        let Some(at) = self.camera.project(point).filter(|at| self.camera.contains(at.pixel)) else { return false };
        let texel = at.pixel.as_uvec2().min(SIZE_PX - 1);
        let way_m = self.ways_m[(texel.y * SIZE_PX.x + texel.x) as usize];
        way_m < point.distance(self.camera.eye_in_world) - BIAS_PX * self.texel_m - BIAS_M
    }
}
