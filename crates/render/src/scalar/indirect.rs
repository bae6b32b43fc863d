//! The twin of `indirect.wgsl`, for materials without textures under lamps and a gradient from all around.

use depth_image::{
    Illumination, Incident, PinholeCamera, Ray, disc_from_square, oct16_from_unit, tangents_of, unit_from_oct16,
};
use glam::{UVec2, Vec2, Vec3};

use super::lobe::pixel_seed;
use super::rays::{Hit, Scene, pixel_ray};
use super::reflections::{BIAS_ROUNDINGS, bias_m};
use super::sequence::{hashed, point_of};

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
        let (hit, _) = self.closest(&ray, camera.near_m);
        let spot = self.spot(camera, pixel, &ray, &hit?);
        let brought = |number| self.brought(&spot, number, illumination);
        Some((0..rays).map(brought).sum::<Vec3>() / rays as f32)
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
            (Some(hit), _) => self.sent_back(&ray, &hit, spot, number, illumination),
            (None, _) => illumination.environment.radiance_linear(towards),
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
        let point_of = |salt| point_of(number, hashed(from.seed.wrapping_add(salt)));
        let place = point_of(0x68bc_21eb);
        let at = point_of(0x02e5_be93).x;
        look.emission_linear + look.albedo_linear * self.light_of_one_lamp(&spot, place, at, illumination)
    }

    /// The light of one lamp as if it were that of all.
    fn light_of_one_lamp(&self, spot: &Spot, place: Vec2, at: f32, illumination: &Illumination) -> Vec3 {
        let brings = |incident: &Incident| {
            incident.irradiance_linear * spot.normal.dot(incident.towards_light_in_world).max(0.0)
        };
        let weight = |incident: &Incident| brings(incident).dot(Vec3::new(0.2126, 0.7152, 0.0722));
        let all: Vec<Incident> =
            illumination.lights.iter().map(|light| light.from_sample(spot.point_in_world, place)).collect();
        let sum: f32 = all.iter().map(weight).sum();
        let mut before = 0.0;
        let chosen = all.iter().find(|incident| {
            before += weight(incident);
            before > at * sum
        });
        let Some(incident) = chosen else { return Vec3::ZERO };
        let ray = Ray { origin_in_world: spot.origin(), direction_in_world: incident.towards_light_in_world };
        let (is_blocked, _) = self.is_blocked(&ray, incident.distance_m - spot.bias_m);
        if is_blocked { Vec3::ZERO } else { brings(incident) * (sum / weight(incident)) }
    }
}
