//! The twin of `reflections/{spawn,follow}.wgsl`: rays off mirrors, and where they end.

use depth_image::{Ray, environment_reflectance_linear};
use glam::Vec3;

use super::rays::{Hit, Scene};
use crate::layered::{BIAS_FOOTPRINTS, BIAS_ROUNDINGS};

/// A ray off a mirror.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// From above the mirror; its direction is a unit vector.
    pub ray: Ray,
    /// The share of the light from its end that the first ray brings.
    pub throughput_linear: Vec3,
    /// Where it ends; `None` where it leaves the scene.
    pub hit: Option<Hit>,
    /// The side of the pixel's footprint across the ray where it ends, metres.
    pub side_m: f32,
}

/// A place on the way, and the footprint there.
struct Place {
    hit: Hit,
    point_in_world: Vec3,
    direction: Vec3,
    bias_m: f32,
    side_m: f32,
    spread: f32,
}

impl Scene {
    /// The mirrored rays after a pixel's ray has hit a surface: one for each mirror on the way, up to `mirrors`.
    #[must_use]
    pub fn bounces(&self, ray: &Ray, hit: Hit, mirrors: u32) -> Vec<Bounce> {
        let side_m = hit.t * self.footprint;
        let near_m = side_m;
        let mut place = Place {
            hit,
            point_in_world: ray.at(hit.t),
            direction: ray.direction_in_world.normalize_or_zero(),
            bias_m: bias_m(ray.origin_in_world, ray.direction_in_world * hit.t, side_m),
            side_m,
            spread: self.footprint / ray.direction_in_world.length(),
        };
        let mut throughput_linear = Vec3::ONE;
        let mut bounces = Vec::new();
        while bounces.len() < mirrors as usize {
            let Some(share) = self.mirrored_share(&place) else { break };
            throughput_linear *= share;
            let normal = self.normal_in_world(&place.hit);
            let spread = place.spread + 2.0 * self.curvature_per_m(&place.hit) * place.side_m;
            let origin_in_world = place.point_in_world + normal * place.bias_m;
            let ray = Ray { origin_in_world, direction_in_world: place.direction.reflect(normal) };
            let hit = self.closest(&ray, near_m);
            let along_m = hit.map_or(0.0, |hit| hit.t);
            // A cone that narrows to a focus grows behind it.
            let signed_m = place.side_m + spread * along_m;
            let side_m = signed_m.abs();
            let spread = if signed_m < 0.0 { -spread } else { spread };
            bounces.push(Bounce { ray, throughput_linear, hit, side_m });
            let Some(hit) = hit else { break };
            place = Place {
                hit,
                point_in_world: ray.at(along_m),
                direction: ray.direction_in_world,
                bias_m: bias_m(origin_in_world, ray.direction_in_world * along_m, side_m),
                side_m,
                spread,
            };
        }
        bounces
    }

    /// `None` where the surface is no mirror.
    fn mirrored_share(&self, place: &Place) -> Option<Vec3> {
        let reflector = self.look(&place.hit).reflector.filter(|reflector| reflector.mirror_share() > 0.0)?;
        let normal = self.normal_in_world(&place.hit);
        Some(environment_reflectance_linear(normal, -place.direction, &reflector) * reflector.mirror_share())
    }
}

pub(super) fn bias_m(origin: Vec3, offset: Vec3, side_m: f32) -> f32 {
    BIAS_FOOTPRINTS * side_m + BIAS_ROUNDINGS * (origin.abs() + offset.abs()).max_element()
}
