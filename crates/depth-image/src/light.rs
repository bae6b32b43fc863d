//! The light of a scene: lamps with an extent, and an environment.
//!
//! The unit of intensity includes the reflectance's 1/π: a surface of albedo 1 that faces a light of irradiance 1 has
//! radiance 1.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::MAX_LAMP_SHARES;

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
#[allow(missing_docs, reason = "self-naming fields")]
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
        position_in_world: Vec3,
        /// Irradiance at a distance of one metre.
        intensity_linear: Vec3,
        /// 0 casts hard shadows.
        radius_m: f32,
    },
    /// A point light that shines into a cone, as in `KHR_lights_punctual`.
    Spot {
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
        center_in_world: Vec3,
        /// Vectors from the centre to the middles of two neighbouring edges, perpendicular to each other.
        half_edges_in_world: [Vec3; 2],
        /// Emitted radiance, equal over the rectangle, as a camera sees it.
        radiance_linear: Vec3,
    },
}

/// Light from far away all around: a gradient from straight down to straight up, or a map.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// Radiance from +Y.
    pub zenith_linear: Vec3,
    /// Radiance from −Y.
    pub nadir_linear: Vec3,
    /// The scene's [`EnvironmentMap`](crate::EnvironmentMap) takes the place of the gradient, which is black, and of the
    /// background.
    pub is_mapped: bool,
}

/// An unusable light.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct LightError {
    pub field: &'static str,
    pub reason: &'static str,
}

impl Illumination {
    /// The lamps with a share of their own in [`LightPlanes`](crate::LightPlanes), by rising number: those of most power
    /// where there are more than [`MAX_LAMP_SHARES`]. All nodes choose the same.
    #[must_use]
    pub fn lamps_with_shares(&self) -> Vec<u32> {
        let mut lamps: Vec<u32> = (0..self.lights.len() as u32).collect();
        let powers: Vec<f32> = self.lights.iter().map(Light::power).collect();
        lamps.sort_by(|&a, &b| powers[b as usize].total_cmp(&powers[a as usize]).then(a.cmp(&b)));
        lamps.truncate(MAX_LAMP_SHARES);
        lamps.sort_unstable();
        lamps
    }
}

impl Environment {
    /// The same radiance from all directions.
    #[must_use]
    pub const fn uniform(radiance_linear: Vec3) -> Self {
        Self::gradient(radiance_linear, radiance_linear)
    }

    /// The radiance from +Y, from −Y, and evenly between.
    #[must_use]
    pub const fn gradient(zenith_linear: Vec3, nadir_linear: Vec3) -> Self {
        Self { zenith_linear, nadir_linear, is_mapped: false }
    }

    /// The radiance of the scene's map.
    #[must_use]
    pub const fn mapped() -> Self {
        Self { zenith_linear: Vec3::ZERO, nadir_linear: Vec3::ZERO, is_mapped: true }
    }

    /// Checks that both colours are finite and not negative, and black beside a map.
    ///
    /// # Errors
    /// The first colour that is not.
    pub fn validate(&self) -> Result<(), LightError> {
        radiance("zenith", self.zenith_linear)?;
        radiance("nadir", self.nadir_linear)?;
        check(!self.is_mapped || *self == Self::mapped(), "zenith", "a gradient beside a map")
    }
}

impl Light {
    /// The sum of the light's channels in all directions; without bound for parallel light, which reaches the whole scene.
    fn power(&self) -> f32 {
        match *self {
            Self::Directional { irradiance_linear, .. } => irradiance_linear.element_sum() * 1e9,
            Self::Point { intensity_linear, .. } => 4.0 * PI * intensity_linear.element_sum(),
            Self::Spot { intensity_linear, outer_cone_rad, .. } => {
                2.0 * PI * (1.0 - outer_cone_rad.cos()) * intensity_linear.element_sum()
            }
            Self::Rectangle { half_edges_in_world: [u, v], radiance_linear, .. } => {
                4.0 * u.cross(v).length() * radiance_linear.element_sum()
            }
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
                check(area > 0.0 && area.is_finite(), "half_edges", "no area, or too much")?;
                let is_upright = u.dot(v).abs() <= 1e-3 * u.length() * v.length();
                check(is_upright, "half_edges", "not perpendicular to each other")
            }
        }
    }
}

fn check(holds: bool, field: &'static str, reason: &'static str) -> Result<(), LightError> {
    if holds { Ok(()) } else { Err(LightError { field, reason }) }
}

fn finite(field: &'static str, v: Vec3) -> Result<(), LightError> {
    check(v.is_finite(), field, "not finite")
}

fn unit(field: &'static str, v: Vec3) -> Result<(), LightError> {
    check((v.length_squared() - 1.0).abs() < 1e-3, field, "not a unit vector")
}

fn radiance(field: &'static str, v: Vec3) -> Result<(), LightError> {
    check(v.is_finite() && v.min_element() >= 0.0, field, "negative or not finite")
}

fn within(field: &'static str, v: f32, most: f32, reason: &'static str) -> Result<(), LightError> {
    check((0.0..=most).contains(&v), field, reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strongest_lamps_have_shares_of_their_own() {
        let lamp = |strength: f32| Light::Point {
            position_in_world: Vec3::ZERO,
            intensity_linear: Vec3::splat(strength),
            radius_m: 0.1,
        };
        let lit = |strengths: &[f32]| Illumination {
            lights: strengths.iter().map(|&strength| lamp(strength)).collect(),
            environment: Environment::default(),
        };
        assert_eq!(lit(&[3.0, 1.0, 2.0]).lamps_with_shares(), [0, 1, 2]);
        let mut strengths = vec![1.0; 20];
        strengths[19] = 2.0;
        strengths[3] = 0.5;
        let expected: Vec<u32> = (0..15).filter(|&lamp| lamp != 3).chain([19]).collect();
        assert_eq!(lit(&strengths).lamps_with_shares(), expected, "of equal lamps the first ones");
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
}
