//! The twin of `reflections/lobe.wgsl`: rays into the lobe of what a pixel shows, and where they end.

use std::f32::consts::TAU;

use depth_image::{PinholeCamera, Ray, environment_reflectance_linear, tangents_of};
use glam::{UVec2, Vec2, Vec3};

use super::rays::{Scene, pixel_ray};
use super::reflections::{Bounce, bias_m};
use super::sequence::{hashed, point_of};
use crate::pixel_camera::PixelCamera;

/// Of `highlight.wgsl`.
const LEAST_ROUGHNESS: f32 = 0.045;
const LEAST_COSINE: f32 = 1e-4;

/// A direction of a lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LobeRay {
    /// A unit vector.
    pub direction_in_world: Vec3,
    /// Smith's G2 over G1; 0 below the surface.
    pub weight: f32,
}

/// The direction of a place in the unit square. The normal and the direction towards the eye are unit vectors.
#[must_use]
pub fn lobe_ray([normal, towards_eye]: [Vec3; 2], roughness: f32, place: Vec2) -> LobeRay {
    let alpha = roughness.max(LEAST_ROUGHNESS).powi(2);
    let [tangent, bitangent] = tangents_of(normal);
    let n_v = normal.dot(towards_eye).max(LEAST_COSINE);
    let eye = Vec3::new(tangent.dot(towards_eye), bitangent.dot(towards_eye), n_v);
    let stretched = Vec3::new(alpha * eye.x, alpha * eye.y, eye.z).normalize_or_zero();
    let up = (1.0 - place.y) * (1.0 + stretched.z) - stretched.z;
    let across = (1.0 - up * up).clamp(0.0, 1.0).sqrt();
    let (sin, cos) = f32::sin_cos(TAU * place.x);
    let cap = Vec3::new(cos * across, sin * across, up) + stretched;
    let facet = Vec3::new(alpha * cap.x, alpha * cap.y, cap.z).normalize_or_zero();
    let towards = (-eye).reflect(facet);
    let direction = tangent * towards.x + bitangent * towards.y + normal * towards.z;
    LobeRay { direction_in_world: direction.normalize_or_zero(), weight: weight(towards.z.max(0.0), n_v, alpha) }
}

/// Height-correlated masking and shadowing over masking alone.
fn weight(n_l: f32, n_v: f32, alpha: f32) -> f32 {
    let [spread_l, spread_v] =
        [n_l, n_v].map(|cosine| (cosine * cosine * (1.0 - alpha * alpha) + alpha * alpha).sqrt());
    let masking = 2.0 * n_v / (n_v + spread_v);
    let both = 2.0 * n_l * n_v / (n_v * spread_l + n_l * spread_v);
    both / masking
}

impl Scene {
    /// All rays into the lobe of what a pixel shows, where no mirrored ray shows a part of the light. None where it shows no reflector.
    #[must_use]
    pub fn lobe(&self, camera: &PinholeCamera, pixel: UVec2, rays: u32) -> Vec<Bounce> {
        let ray = pixel_ray(camera, pixel);
        let found = self.closest(&ray, camera.near_m).and_then(|hit| Some((hit, self.look(&hit).reflector?)));
        let Some((hit, reflector)) = found else { return Vec::new() };
        let normal = self.normal_in_world(&hit);
        let towards_eye = -ray.direction_in_world.normalize_or_zero();
        let seed = hashed(pixel_seed(camera, pixel).wrapping_add(0x2545_f491));
        let lobe = (0..rays).map(|n| lobe_ray([normal, towards_eye], reflector.roughness, point_of(n, seed)));
        let mut lobe: Vec<LobeRay> = lobe.collect();
        let mut sum: f32 = lobe.iter().map(|ray| ray.weight).sum();
        if sum <= 0.0 {
            lobe.truncate(1);
            lobe.fill(LobeRay { direction_in_world: (-towards_eye).reflect(normal), weight: 1.0 });
            sum = 1.0;
        }
        let reflectance = environment_reflectance_linear(normal, towards_eye, &reflector);
        let side_m = hit.t * self.footprint;
        let bias_m = bias_m(ray.origin_in_world, ray.direction_in_world * hit.t, side_m);
        let origin_in_world = ray.at(hit.t) + normal * bias_m;
        let bounces = lobe.into_iter().map(|LobeRay { direction_in_world, weight }| {
            let ray = Ray { origin_in_world, direction_in_world };
            let hit = self.closest(&ray, side_m);
            Bounce { ray, throughput_linear: reflectance * (weight / sum), hit, side_m }
        });
        bounces.filter(|bounce| bounce.throughput_linear != Vec3::ZERO).collect()
    }
}

/// Of `spot.wgsl`.
pub(super) fn pixel_seed(camera: &PinholeCamera, pixel: UVec2) -> u32 {
    let PixelCamera { seed, first_from_axis: [x, y], .. } = PixelCamera::of(&(*camera).into(), Vec2::ZERO);
    let x = pixel.x.wrapping_add(x);
    let y = pixel.y.wrapping_add(y);
    hashed(seed ^ hashed((x & 0xffff) | (y << 16)))
}
