//! Light that arrives at a point: the scalar reference of light.wgsl.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glam::{Vec2, Vec3};

use crate::{Environment, Light};

/// Unoccluded light that arrives at a point from one point of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Incident {
    /// Unit vector from the point to the light.
    pub towards_light_in_world: Vec3,
    /// Distance to the light; infinite for parallel light.
    pub distance_m: f32,
    /// Irradiance on a surface that faces the light.
    pub irradiance_linear: Vec3,
}

/// Irradiance stays constant below this distance, which avoids a division by zero.
const LEAST_DISTANCE_M: f32 = 1e-6;

impl Environment {
    /// Radiance that arrives from a direction, a unit vector.
    #[must_use]
    pub fn radiance_linear(&self, towards_in_world: Vec3) -> Vec3 {
        self.nadir_linear.lerp(self.zenith_linear, 0.5 + 0.5 * towards_in_world.y)
    }

    /// Radiance of an unoccluded white surface: the gradient under a cosine lobe.
    #[must_use]
    pub fn diffuse_linear(&self, normal_in_world: Vec3) -> Vec3 {
        self.nadir_linear.lerp(self.zenith_linear, 0.5 + normal_in_world.y / 3.0)
    }
}

impl Light {
    /// Unoccluded light from the light's centre.
    #[must_use]
    pub fn from_middle(&self, point_in_world: Vec3) -> Incident {
        self.from_sample(point_in_world, Vec2::splat(0.5))
    }

    /// Returns whether the light casts soft shadows.
    #[must_use]
    pub fn has_extent(&self) -> bool {
        match *self {
            Self::Directional { angular_radius_rad: extent, .. }
            | Self::Point { radius_m: extent, .. }
            | Self::Spot { radius_m: extent, .. } => extent > 0.0,
            Self::Rectangle { .. } => true,
        }
    }

    /// Unoccluded light from one point of the light. Its mean over `place` in the unit square is the whole light's.
    #[must_use]
    pub fn from_sample(&self, point_in_world: Vec3, place: Vec2) -> Incident {
        match *self {
            Self::Directional { towards_light_in_world: towards, irradiance_linear, angular_radius_rad } => {
                let offset = disc_offset(towards, place) * angular_radius_rad.tan();
                let towards_light_in_world = (towards + offset).normalize_or(towards);
                Incident { towards_light_in_world, distance_m: f32::INFINITY, irradiance_linear }
            }
            Self::Point { position_in_world, intensity_linear, radius_m } => {
                round_lamp(position_in_world, radius_m, intensity_linear, point_in_world, place)
            }
            Self::Spot {
                position_in_world,
                forward_in_world,
                intensity_linear,
                inner_cone_rad,
                outer_cone_rad,
                radius_m,
            } => {
                let axis_cosine = forward_in_world.dot((point_in_world - position_in_world).normalize_or(Vec3::ZERO));
                let intensity = intensity_linear * spot_share(axis_cosine, inner_cone_rad, outer_cone_rad);
                round_lamp(position_in_world, radius_m, intensity, point_in_world, place)
            }
            Self::Rectangle { center_in_world, half_edges_in_world: [u, v], radiance_linear } => {
                let at = center_in_world + u * (2.0 * place.x - 1.0) + v * (2.0 * place.y - 1.0);
                let area_normal = u.cross(v);
                let incident = towards(at, point_in_world);
                let cosine = -area_normal.normalize_or(Vec3::ZERO).dot(incident.towards_light_in_world);
                let share = 4.0 * area_normal.length() * cosine.max(0.0) / PI;
                Incident { irradiance_linear: radiance_linear * share * incident.irradiance_linear, ..incident }
            }
        }
    }
}

/// Two unit vectors perpendicular to `unit` and each other (Duff et al. 2017).
#[must_use]
pub fn tangents_of(unit: Vec3) -> [Vec3; 2] {
    let sign = if unit.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + unit.z);
    let b = unit.x * unit.y * a;
    [
        Vec3::new(1.0 + sign * unit.x * unit.x * a, sign * b, -sign * unit.x),
        Vec3::new(b, sign + unit.y * unit.y * a, -unit.y),
    ]
}

/// The map from the unit square to the unit disc that keeps areas and neighbours (Shirley and Chiu 1997).
#[must_use]
pub fn disc_from_square(place: Vec2) -> Vec2 {
    let p = place * 2.0 - 1.0;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) =
        if p.x.abs() > p.y.abs() { (p.x, FRAC_PI_4 * p.y / p.x) } else { (p.y, FRAC_PI_2 - FRAC_PI_4 * p.x / p.y) };
    Vec2::from_angle(angle) * radius
}

fn disc_offset(axis: Vec3, place: Vec2) -> Vec3 {
    let ([tangent, bitangent], disc) = (tangents_of(axis), disc_from_square(place));
    tangent * disc.x + bitangent * disc.y
}

/// Light of a sphere, as of a disc that faces the point.
fn round_lamp(position: Vec3, radius_m: f32, intensity_linear: Vec3, point: Vec3, place: Vec2) -> Incident {
    let axis = (position - point).normalize_or(Vec3::Y);
    let incident = towards(position + disc_offset(axis, place) * radius_m, point);
    Incident { irradiance_linear: intensity_linear * incident.irradiance_linear, ..incident }
}

/// Light of a lamp of unit intensity.
fn towards(at_in_world: Vec3, point_in_world: Vec3) -> Incident {
    let offset = at_in_world - point_in_world;
    let distance_m = offset.length().max(LEAST_DISTANCE_M);
    Incident {
        towards_light_in_world: offset / distance_m,
        distance_m,
        irradiance_linear: Vec3::splat((distance_m * distance_m).recip()),
    }
}

/// The share of a spot's intensity at an angle from its axis, as in `KHR_lights_punctual`.
fn spot_share(axis_cosine: f32, inner_cone_rad: f32, outer_cone_rad: f32) -> f32 {
    let inner = inner_cone_rad.cos();
    let outer = outer_cone_rad.cos();
    let share = ((axis_cosine - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
    share * share
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean_irradiance(light: &Light, point: Vec3, normal: Vec3) -> f32 {
        const SIDE: usize = 64;
        let places = (0..SIDE * SIDE).map(|i| (Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32);
        let sum: f32 = places
            .map(|place| {
                let incident = light.from_sample(point, place);
                incident.irradiance_linear.x * normal.dot(incident.towards_light_in_world).max(0.0)
            })
            .sum();
        sum / (SIDE * SIDE) as f32
    }

    #[test]
    fn a_rectangles_irradiance_equals_its_form_factor() {
        let a = 1.5f32;
        let h = 2.0f32;
        let light = Light::Rectangle {
            center_in_world: Vec3::Y * h,
            half_edges_in_world: [Vec3::X * a, Vec3::Z * a],
            radiance_linear: Vec3::ONE,
        };
        // x × z = −y: the rectangle shines down. The sum is four times the form factor of a quarter, from its corner.
        let x = a / h;
        let quarter = 2.0 * x / (1.0 + x * x).sqrt() * (x / (1.0 + x * x).sqrt()).atan() / (2.0 * PI);
        let measured = mean_irradiance(&light, Vec3::ZERO, Vec3::Y);
        assert!((measured - 4.0 * quarter).abs() < 2e-3, "{measured} {}", 4.0 * quarter);
        assert_eq!(mean_irradiance(&light, Vec3::Y * 4.0, Vec3::NEG_Y), 0.0, "it shines to one side");
    }

    #[test]
    fn a_small_round_lamp_equals_a_point_light() {
        let lamp = |radius_m| Light::Point { position_in_world: Vec3::Y, intensity_linear: Vec3::ONE, radius_m };
        let point = Vec3::new(0.3, 0.0, 0.1);
        let normal = Vec3::Y;
        let small = mean_irradiance(&lamp(1e-3), point, normal);
        let hard = mean_irradiance(&lamp(0.0), point, normal);
        assert!((small - hard).abs() < 1e-3, "{small} {hard}");
        assert!((hard - 1.1f32.powf(-1.5)).abs() < 1e-4, "{hard}");
    }

    #[test]
    fn the_gradient_under_a_cosine_lobe_equals_its_closed_form() {
        let environment = Environment::gradient(Vec3::ONE, Vec3::ZERO);
        let normal = Vec3::new(0.6, 0.64, 0.48);
        let [tangent, bitangent] = tangents_of(normal);
        let count = 20_000;
        let sum: f32 = (0..count)
            .map(|i| {
                let disc = disc_from_square(Vec2::new(i as f32 / count as f32, (i as f32 * 0.618_034).fract()));
                let up = (1.0 - disc.length_squared()).max(0.0).sqrt();
                environment.radiance_linear(tangent * disc.x + bitangent * disc.y + normal * up).x
            })
            .sum();
        assert!((sum / count as f32 - environment.diffuse_linear(normal).x).abs() < 1e-3);
    }

    #[test]
    fn a_spot_fades_between_its_cones() {
        let spot = Light::Spot {
            position_in_world: Vec3::Y,
            forward_in_world: Vec3::NEG_Y,
            intensity_linear: Vec3::ONE,
            inner_cone_rad: 0.3,
            outer_cone_rad: 0.6,
            radius_m: 0.0,
        };
        let at = |angle: f32| {
            let incident = spot.from_middle(Vec3::new(angle.tan(), 0.0, 0.0));
            incident.irradiance_linear.x * incident.distance_m * incident.distance_m
        };
        assert!((at(0.2) - 1.0).abs() < 1e-5 && at(0.7) == 0.0);
        assert!(at(0.4) > at(0.5) && at(0.5) > 0.0);
    }

    #[test]
    fn light_is_finite_inside_a_lamp() {
        let lamp = Light::Point { position_in_world: Vec3::ZERO, intensity_linear: Vec3::ONE, radius_m: 0.0 };
        let incident = lamp.from_middle(Vec3::ZERO);
        assert!(incident.irradiance_linear.is_finite() && incident.towards_light_in_world.is_finite());
    }
}
