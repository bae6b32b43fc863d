//! The light of a scene: lamps with an extent, and an environment. The scalar reference of light.wgsl.
//!
//! The unit of intensity includes the reflectance's 1/π: a surface of albedo 1 that faces a light of irradiance 1 has
//! radiance 1.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// Lights of one scene: with the environment they fill 64 planes of visibility.
pub const MAX_LIGHTS: usize = 255;

/// All light of a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Illumination {
    /// Lamps. Their order is the order of the planes of visibility.
    pub lights: Vec<Light>,
    /// Light from all directions.
    pub environment: Environment,
}

/// A light source. Colours are linear RGB and finite, never negative.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Light {
    /// Parallel light, as from the sun.
    Directional {
        /// Unit vector from a surface towards the middle of the light.
        towards_light_in_world: Vec3,
        /// Irradiance on a surface that faces the light.
        irradiance_linear: Vec3,
        /// Half the angular diameter of the light; 0 casts hard shadows.
        angular_radius_rad: f32,
    },
    /// A lamp of equal intensity in all directions; irradiance falls with the square of the distance.
    Point {
        /// Centre of the lamp.
        position_in_world: Vec3,
        /// Irradiance at a distance of one metre.
        intensity_linear: Vec3,
        /// 0 casts hard shadows.
        radius_m: f32,
    },
    /// A point light that shines into a cone, as in `KHR_lights_punctual`.
    Spot {
        /// Centre of the lamp.
        position_in_world: Vec3,
        /// Unit vector along the cone's axis, away from the light.
        forward_in_world: Vec3,
        /// Irradiance on the axis at a distance of one metre.
        intensity_linear: Vec3,
        /// Angle from the axis at which light begins to fade.
        inner_cone_rad: f32,
        /// Angle from the axis at which light is gone.
        outer_cone_rad: f32,
        /// 0 casts hard shadows.
        radius_m: f32,
    },
    /// A rectangle that shines to the side of `half_edges[0] × half_edges[1]`, by Lambert's law.
    Rectangle {
        /// Centre of the rectangle.
        center_in_world: Vec3,
        /// Vectors from the centre to the middles of two neighbouring edges, perpendicular to each other.
        half_edges_in_world: [Vec3; 2],
        /// Emitted radiance, equal over the rectangle, as a camera sees it.
        radiance_linear: Vec3,
    },
}

/// Light from far away all around: a gradient from straight down to straight up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// Radiance from +Y.
    pub zenith_linear: Vec3,
    /// Radiance from −Y.
    pub nadir_linear: Vec3,
}

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

/// An unusable light.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct LightError {
    pub field: &'static str,
    pub reason: &'static str,
}

/// Irradiance stays constant below this distance, which avoids a division by zero.
const LEAST_DISTANCE_M: f32 = 1e-6;

impl Environment {
    /// The same radiance from all directions.
    #[must_use]
    pub const fn uniform(radiance_linear: Vec3) -> Self {
        Self { zenith_linear: radiance_linear, nadir_linear: radiance_linear }
    }

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

    /// Checks that both colours are finite and not negative.
    ///
    /// # Errors
    /// The first colour that is not.
    pub fn validate(&self) -> Result<(), LightError> {
        radiance("zenith", self.zenith_linear)?;
        radiance("nadir", self.nadir_linear)
    }
}

impl Light {
    /// Unoccluded light from the light's centre.
    #[must_use]
    pub fn from_middle(&self, point_in_world: Vec3) -> Incident {
        self.from_sample(point_in_world, Vec2::splat(0.5))
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

    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is out of range or not finite.
    pub fn validate(&self) -> Result<(), LightError> {
        match *self {
            Self::Directional { towards_light_in_world, irradiance_linear, angular_radius_rad } => {
                unit("towards_light", towards_light_in_world)?;
                radiance("irradiance", irradiance_linear)?;
                within("angular_radius", angular_radius_rad, FRAC_PI_4, "not from 0 to 45 degrees")
            }
            Self::Point { position_in_world, intensity_linear, radius_m } => {
                finite("position", position_in_world)?;
                radiance("intensity", intensity_linear)?;
                within("radius", radius_m, f32::MAX, "negative or not finite")
            }
            Self::Spot {
                position_in_world,
                forward_in_world,
                intensity_linear,
                inner_cone_rad,
                outer_cone_rad,
                radius_m,
            } => {
                finite("position", position_in_world)?;
                unit("forward", forward_in_world)?;
                radiance("intensity", intensity_linear)?;
                within("outer_cone", outer_cone_rad, FRAC_PI_2, "not from 0 to 90 degrees")?;
                within("inner_cone", inner_cone_rad, outer_cone_rad, "not from 0 to the outer cone's")?;
                within("radius", radius_m, f32::MAX, "negative or not finite")
            }
            Self::Rectangle { center_in_world, half_edges_in_world: [u, v], radiance_linear } => {
                finite("center", center_in_world)?;
                finite("half_edges", u)?;
                finite("half_edges", v)?;
                radiance("radiance", radiance_linear)?;
                let area = u.cross(v).length();
                let upright = u.dot(v).abs() <= 1e-3 * u.length() * v.length();
                let error = |reason| Err(LightError { field: "half_edges", reason });
                match (area > 0.0 && area.is_finite(), upright) {
                    (false, _) => error("no area, or too much"),
                    (_, false) => error("not perpendicular to each other"),
                    _ => Ok(()),
                }
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
    let (inner, outer) = (inner_cone_rad.cos(), outer_cone_rad.cos());
    let share = ((axis_cosine - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
    share * share
}

fn finite(field: &'static str, v: Vec3) -> Result<(), LightError> {
    if v.is_finite() { Ok(()) } else { Err(LightError { field, reason: "not finite" }) }
}

fn unit(field: &'static str, v: Vec3) -> Result<(), LightError> {
    let holds = (v.length_squared() - 1.0).abs() < 1e-3;
    if holds { Ok(()) } else { Err(LightError { field, reason: "not a unit vector" }) }
}

fn radiance(field: &'static str, v: Vec3) -> Result<(), LightError> {
    let holds = v.is_finite() && v.min_element() >= 0.0;
    if holds { Ok(()) } else { Err(LightError { field, reason: "negative or not finite" }) }
}

fn within(field: &'static str, v: f32, most: f32, reason: &'static str) -> Result<(), LightError> {
    if (0.0..=most).contains(&v) { Ok(()) } else { Err(LightError { field, reason }) }
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
        let (a, h) = (1.5f32, 2.0f32);
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
        let (point, normal) = (Vec3::new(0.3, 0.0, 0.1), Vec3::Y);
        let (small, hard) = (mean_irradiance(&lamp(1e-3), point, normal), mean_irradiance(&lamp(0.0), point, normal));
        assert!((small - hard).abs() < 1e-3, "{small} {hard}");
        assert!((hard - 1.1f32.powf(-1.5)).abs() < 1e-4, "{hard}");
    }

    #[test]
    fn the_gradient_under_a_cosine_lobe_equals_its_closed_form() {
        let environment = Environment { zenith_linear: Vec3::ONE, nadir_linear: Vec3::ZERO };
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
    fn an_invalid_light_is_refused_with_its_field() {
        let point =
            |intensity_linear, radius_m| Light::Point { position_in_world: Vec3::ZERO, intensity_linear, radius_m };
        assert_eq!(point(Vec3::ONE, 0.1).validate(), Ok(()));
        for bad in [Vec3::NAN, Vec3::NEG_X, Vec3::INFINITY] {
            assert_eq!(point(bad, 0.1).validate().map_err(|e| e.field), Err("intensity"));
        }
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(point(Vec3::ONE, bad).validate().map_err(|e| e.field), Err("radius"));
        }
        let skewed = Light::Rectangle {
            center_in_world: Vec3::ZERO,
            half_edges_in_world: [Vec3::X, Vec3::X],
            radiance_linear: Vec3::ONE,
        };
        assert_eq!(skewed.validate().map_err(|e| e.field), Err("half_edges"));
    }

    #[test]
    fn light_is_finite_inside_a_lamp() {
        let lamp = Light::Point { position_in_world: Vec3::ZERO, intensity_linear: Vec3::ONE, radius_m: 0.0 };
        let incident = lamp.from_middle(Vec3::ZERO);
        assert!(incident.irradiance_linear.is_finite() && incident.towards_light_in_world.is_finite());
    }
}
