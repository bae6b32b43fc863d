//! The twin of `rays/glass.wgsl`, `reflections/look_through.wgsl` and `reflections/cross_glass.wgsl`: rays through glass, for
//! materials without textures.

use depth_image::Ray;
use glam::Vec3;

use super::rays::{Glass, Hit, Scene};
use super::reflections::bias_m;
use super::sequence::hashed;
use crate::reflections::MOST_INTERFACES;

/// Where light goes at an interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deflection {
    /// A unit vector.
    pub direction: Vec3,
    /// The share of the normal in it.
    pub steer: f32,
    /// All light is reflected.
    pub is_total: bool,
}

/// An eye's ray that has gone through all glass on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// The last part of the way; its direction is a unit vector.
    pub ray: Ray,
    /// The share of the light from its end that the eye sees.
    pub throughput_linear: Vec3,
    /// Where it ends; `None` where it leaves the scene.
    pub hit: Option<Hit>,
    /// Surfaces of glass on the way, those of total reflections counted each.
    pub interfaces: u32,
    /// The side of the pixel's footprint across the last part of the way, where that begins, and its growth in a metre.
    pub cone: [f32; 2],
    medium_per_m: Vec3,
}

/// The share of unpolarised light that an interface reflects. `eta` is the refractive index on the light's side over that beyond.
#[must_use]
pub fn fresnel(cosine: f32, eta: f32) -> f32 {
    let sine_squared = eta * eta * (1.0 - cosine * cosine);
    if sine_squared >= 1.0 {
        return 1.0;
    }
    let beyond = (1.0 - sine_squared).sqrt();
    let across = (eta * cosine - beyond) / (eta * cosine + beyond).max(1e-20);
    let along = (cosine - eta * beyond) / (cosine + eta * beyond).max(1e-20);
    0.5 * (across * across + along * along)
}

/// Snell's law for unit vectors against each other.
#[must_use]
pub fn deflected(direction: Vec3, normal: Vec3, eta: f32) -> Deflection {
    let cosine = (-direction.dot(normal)).clamp(0.0, 1.0);
    let sine_squared = eta * eta * (1.0 - cosine * cosine);
    let is_total = sine_squared >= 1.0;
    let steer = if is_total { 2.0 * cosine } else { eta * cosine - (1.0 - sine_squared).max(0.0).sqrt() };
    let deflected = direction * if is_total { 1.0 } else { eta } + normal * steer;
    Deflection { direction: deflected / deflected.length().max(1e-10), steer, is_total }
}

impl Scene {
    /// The way of a pixel's ray through the glass that it meets first, and through all further glass, for the pixel's seed.
    #[must_use]
    pub fn through_glass(&self, pixel_ray: &Ray, first: Hit, seed: u32) -> Passage {
        let way = pixel_ray.direction_in_world.length();
        let ray = Ray { direction_in_world: pixel_ray.direction_in_world / way, ..*pixel_ray };
        let mut passage = Passage {
            ray,
            throughput_linear: Vec3::ONE,
            hit: self.closest(&ray, first.t * way * (1.0 - 1e-3)),
            interfaces: 0,
            cone: [0.0, self.footprint / way],
            medium_per_m: Vec3::ZERO,
        };
        while let Some(hit) = passage.hit.filter(|_| passage.interfaces < MOST_INTERFACES) {
            let Some(glass) = self.glass(&hit) else { break };
            let is_first = passage.interfaces == 0;
            let enters = hit.front || glass.is_thin;
            let chance = (hashed(seed ^ hashed(passage.interfaces)) >> 8) as f32 / 16_777_216.0;
            if enters && !is_first && chance >= glass.transmission {
                break;
            }
            let share = if enters && is_first { glass.transmission } else { 1.0 };
            self.go_through(&mut passage, &hit, &glass, share);
        }
        if passage.interfaces == MOST_INTERFACES {
            passage.hit = None;
        }
        if let Some(hit) = passage.hit {
            passage.throughput_linear *= (-passage.medium_per_m * hit.t).exp();
        }
        passage
    }

    fn go_through(&self, passage: &mut Passage, hit: &Hit, glass: &Glass, share: f32) {
        let [first_side_m, growth] = passage.cone;
        let direction = passage.ray.direction_in_world;
        let signed_m = first_side_m + growth * hit.t;
        let side_m = signed_m.abs();
        let spread = if signed_m < 0.0 { -growth } else { growth };
        let enters = hit.front || glass.is_thin;
        let eta = if enters { 1.0 / glass.ior } else { glass.ior };
        let normal = self.normal_in_world(hit);
        let flat_normal = self.triangle_normal_in_world(hit);
        let mut deflection = deflected(direction, normal, eta);
        let leaves = deflection.direction.dot(flat_normal) > 0.0;
        if direction.dot(normal) >= 0.0 || leaves != deflection.is_total {
            deflection = deflected(direction, flat_normal, eta);
        }
        if glass.is_thin {
            deflection = Deflection { direction, steer: 0.0, is_total: false };
        }
        let reflectance = fresnel((-direction.dot(normal)).clamp(0.0, 1.0), eta);
        let passed_per_m = if enters { passage.medium_per_m } else { glass.absorption_per_m };
        let passes = if deflection.is_total { 1.0 } else { (1.0 - reflectance) * share };
        let tint_linear = if enters && !deflection.is_total { glass.tint_linear } else { Vec3::ONE };
        let offset = direction * hit.t;
        let bias_m = bias_m(passage.ray.origin_in_world, offset, side_m);
        let above = flat_normal * if deflection.is_total { bias_m } else { -bias_m };
        passage.throughput_linear *= tint_linear * (-passed_per_m * hit.t).exp() * passes;
        passage.ray = Ray {
            origin_in_world: passage.ray.origin_in_world + offset + above,
            direction_in_world: deflection.direction,
        };
        let scale = if glass.is_thin || deflection.is_total { 1.0 } else { eta };
        passage.cone = [side_m, spread * scale + deflection.steer * self.curvature_per_m(hit) * side_m];
        if !glass.is_thin {
            let is_inside = hit.front != deflection.is_total;
            passage.medium_per_m = if is_inside { glass.absorption_per_m } else { Vec3::ZERO };
        }
        passage.interfaces += 1;
        passage.hit = self.closest(&passage.ray, 0.0);
    }

    /// The share of a ray of light that arrives from `t_max`: 0 where it is blocked, or what glass on the straight way lets through.
    #[must_use]
    pub fn open_share(&self, ray: &Ray, t_max: f32) -> Vec3 {
        if self.is_blocked(ray, t_max) {
            return Vec3::ZERO;
        }
        let mut passed_linear = Vec3::ONE;
        let mut absorbed = Vec3::ZERO;
        for (hit, glass) in self.glass_before(ray, t_max) {
            let cosine = self.normal_in_world(&hit).dot(ray.direction_in_world).abs().min(1.0);
            if hit.front || glass.is_thin {
                passed_linear *= glass.tint_linear * glass.transmission;
            }
            passed_linear *= 1.0 - fresnel(cosine, 1.0 / glass.ior);
            absorbed += glass.absorption_per_m * if hit.front { -hit.t } else { hit.t };
        }
        passed_linear * (-absorbed.max(Vec3::ZERO)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The angles of a table of incidence, up to grazing, and refractive indices.
    fn cases() -> impl Iterator<Item = (f32, f32)> {
        let angles = (0..=895).map(|tenths| (tenths as f32 * 0.1).to_radians());
        angles.flat_map(|angle| [1.0, 1.05, 1.33, 1.5, 2.4, 4.0].map(|ior| (angle, ior)))
    }

    #[test]
    fn an_interface_reflects_what_fresnel_says() {
        for ior in [1.0, 1.33, 1.5, 2.4, 4.0_f32] {
            let normal = ((ior - 1.0) / (ior + 1.0)).powi(2);
            assert!((fresnel(1.0, 1.0 / ior) - normal).abs() < 1e-6 && (fresnel(1.0, ior) - normal).abs() < 1e-6);
            assert!(fresnel(1e-6, 1.0 / ior) > 0.99 || ior == 1.0);
            // Brewster's angle: of the light in the plane nothing is reflected.
            let brewster = ior.atan();
            let across = (ior * ior - 1.0) / (ior * ior + 1.0);
            let expected = 0.5 * across * across;
            assert!((fresnel(brewster.cos(), 1.0 / ior) - expected).abs() < 1e-5, "{ior}");
        }
        // There and back the same share passes.
        for (angle, ior) in cases().filter(|(_, ior)| *ior > 1.0) {
            let inner = (angle.sin() / ior).asin();
            let there = fresnel(angle.cos(), 1.0 / ior);
            let back = fresnel(inner.cos(), ior);
            assert!((there - back).abs() < 2e-3, "{angle} {ior}: {there} {back}");
        }
    }

    #[test]
    fn directions_obey_snell_and_total_reflection_begins_at_the_critical_angle() {
        for (angle, ior) in cases() {
            let direction = Vec3::new(angle.sin(), -angle.cos(), 0.0);
            let inside = deflected(direction, Vec3::Y, 1.0 / ior);
            assert!(!inside.is_total || ior == 1.0 && angle > 1.56);
            assert!(
                (inside.direction.x - angle.sin() / ior).abs() < 1e-6 && inside.direction.y <= 0.0,
                "{angle} {ior}"
            );
            let outside = deflected(direction, Vec3::Y, ior);
            let critical = (1.0 / ior).asin();
            if (angle - critical).abs() > 1e-3 {
                assert_eq!(outside.is_total, angle > critical, "{angle} {ior}");
            }
            let expected = if outside.is_total { angle.sin() } else { angle.sin() * ior };
            assert!((outside.direction.x - expected).abs() < 1e-3, "{angle} {ior}: {}", outside.direction);
            assert!((outside.direction.y > 0.0) == outside.is_total || outside.direction.y.abs() < 1e-3);
        }
    }

    #[test]
    fn no_direction_and_no_share_is_nan() {
        for eta in [0.25, 2.0 / 3.0, 1.0, 1.5, 4.0] {
            for cosine in [-1.0, -1e-30, 0.0, 1e-30, 1e-8, 1.0 - f32::EPSILON, 1.0, 1.0 + f32::EPSILON] {
                assert!((0.0..=1.0).contains(&fresnel(cosine.clamp(0.0, 1.0), eta)), "{eta} {cosine}");
                let sine = (1.0_f32 - cosine * cosine).max(0.0).sqrt();
                let deflection = deflected(Vec3::new(sine, -cosine, 0.0), Vec3::Y, eta);
                assert!(deflection.direction.is_finite() && deflection.steer.is_finite(), "{eta} {cosine}");
            }
        }
    }
}
