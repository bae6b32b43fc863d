//! The twin of `indirect.wgsl`, for materials without textures under lamps and a gradient from all around.

use depth_image::{
    Illumination, Incident, PinholeCamera, Ray, disc_from_square, oct16_from_unit, tangents_of, unit_from_oct16,
};
use glam::{UVec2, Vec2, Vec3};

use super::lobe::pixel_seed;
use super::rays::{Hit, Scene, pixel_ray};
use super::reflections::bias_m;
use super::sequence::{hashed, point_of};
use crate::layered::BIAS_ROUNDINGS;

/// A place from which rays of light begin.
struct Spot {
    point_in_world: Vec3,
    normal: Vec3,
    bias_m: f32,
    seed: u32,
}

impl Spot {
    fn origin(&self) -> Vec3 {
        self.point_in_world + self.normal * self.bias_m
    }
}

impl Scene {
    /// What a white surface in place of that of a pixel reflects of the environment and of light that surfaces send back, by `rays`
    /// rays; `None` where it shows no surface.
    #[must_use]
    pub fn indirect_light(
        &self,
        camera: &PinholeCamera,
        pixel: UVec2,
        illumination: &Illumination,
        rays: u32,
    ) -> Option<Vec3> {
        let ray = pixel_ray(camera, pixel);
        let spot = self.spot(camera, pixel, &ray, &self.closest(&ray, camera.near_m)?);
        Some((0..rays).map(|number| self.brought(&spot, number, illumination)).sum::<Vec3>() / rays as f32)
    }

    fn spot(&self, camera: &PinholeCamera, pixel: UVec2, ray: &Ray, hit: &Hit) -> Spot {
        let offset = ray.direction_in_world * hit.t;
        Spot {
            point_in_world: ray.origin_in_world + offset,
            // In the bits that a device has of it.
            normal: unit_from_oct16(oct16_from_unit(self.normal_in_world(hit))),
            bias_m: bias_m(ray.origin_in_world, offset, hit.t * self.footprint),
            seed: pixel_seed(camera, pixel),
        }
    }

    fn brought(&self, spot: &Spot, number: u32, illumination: &Illumination) -> Vec3 {
        let disc = disc_from_square(point_of(number, hashed(spot.seed.wrapping_add(0x5bd1_e995))));
        let [tangent, bitangent] = tangents_of(spot.normal);
        let up = (1.0 - disc.length_squared()).max(0.0).sqrt();
        let towards = tangent * disc.x + bitangent * disc.y + spot.normal * up;
        let ray = Ray { origin_in_world: spot.origin(), direction_in_world: towards };
        match self.closest(&ray, 0.0) {
            Some(hit) => self.sent_back(&ray, &hit, spot, number, illumination),
            None => illumination.environment.radiance_linear(towards),
        }
    }

    fn sent_back(&self, ray: &Ray, hit: &Hit, from: &Spot, number: u32, illumination: &Illumination) -> Vec3 {
        let look = self.look(hit);
        let offset = ray.direction_in_world * hit.t;
        let spot = Spot {
            point_in_world: ray.origin_in_world + offset,
            normal: self.normal_in_world(hit),
            bias_m: from.bias_m + BIAS_ROUNDINGS * (ray.origin_in_world.abs() + offset.abs()).max_element(),
            seed: from.seed,
        };
        let [place, at] = [0x68bc_21eb, 0x02e5_be93].map(|salt| point_of(number, hashed(from.seed.wrapping_add(salt))));
        look.emission_linear + look.albedo_linear * self.light_of_one_lamp(&spot, place, at.x, illumination)
    }

    /// The light of one lamp as if it were that of all.
    fn light_of_one_lamp(&self, spot: &Spot, place: Vec2, at: f32, illumination: &Illumination) -> Vec3 {
        // What each lamp would bring, and the luminance of that.
        let lamps = illumination.lights.iter().map(|light| {
            let incident = light.from_sample(spot.point_in_world, place);
            let brought = incident.irradiance_linear * spot.normal.dot(incident.towards_light_in_world).max(0.0);
            (incident, brought, brought.dot(Vec3::new(0.2126, 0.7152, 0.0722)))
        });
        let lamps: Vec<(Incident, Vec3, f32)> = lamps.collect();
        let sum: f32 = lamps.iter().map(|(_, _, weight)| weight).sum();
        let mut before = 0.0;
        let chosen = lamps.iter().find(|(_, _, weight)| {
            before += weight;
            before > at * sum
        });
        let Some((incident, brought, weight)) = chosen else { return Vec3::ZERO };
        let ray = Ray { origin_in_world: spot.origin(), direction_in_world: incident.towards_light_in_world };
        let is_blocked = self.is_blocked(&ray, incident.distance_m - spot.bias_m);
        if is_blocked { Vec3::ZERO } else { *brought * (sum / weight) }
    }
}
