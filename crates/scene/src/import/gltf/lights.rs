//! `KHR_lights_punctual`.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};
use std::ops::RangeInclusive;

use depth_image::LightError;
use glam::{DVec3, Vec3};
use gltf::json::Index;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Spot, Type};
use gltf::json::validation::Checked;

use super::super::source_scene::{SourceLight, SourceScene};
use super::document::Document;
use super::nodes::Place;
use crate::Light;
use crate::error::Fault;
use crate::light_rig::{color as color_of, color_mut, scaled};

/// Range of the largest channel of irradiance at the middle of a scene that is not exposed: two stops to either side of
/// white.
const UNEXPOSED: RangeInclusive<f64> = 0.25..=4.0;

/// Least distance of a light from the middle, as a share of the bounds' diagonal: a lamp in the middle of a room lights
/// its walls.
const LEAST_DISTANCE_IN_DIAGONALS: f64 = 0.25;
/// Least distance of a light from the middle of a scene in one point, in the file's unit.
const LEAST_DISTANCE_FROM_POINT: f64 = 1e-3;

/// Angles over 90° by less than this, radians, are 90°.
const ANGLE_ROUNDING_RAD: f32 = 1e-3;

/// The light of a node. `None` for a light of negative strength, and for one whose node has no
/// direction.
pub(super) fn placed(
    document: &Document,
    index: Index<JsonLight>,
    place: &Place,
) -> Result<Option<SourceLight>, Fault> {
    let source_from_node = place.source_from_node;
    let json = document.root.get(index).ok_or_else(|| Fault::malformed(&place.element, "its light does not exist"))?;
    let element = format!("light {}", index.value());
    let left_out = |reason: &str| {
        let name = json.name.as_deref().unwrap_or("no name");
        document.warnings.count(format!("lights {reason} are left out"), format_args!("{element} ({name})"));
        Ok(None)
    };
    let Checked::Valid(kind) = json.type_ else {
        return Err(Fault::malformed(element, "unknown type"));
    };
    let wrong = |e| Fault::light(&element, &e);
    if json.intensity < 0.0 || json.color.iter().any(|channel| *channel < 0.0) {
        return left_out("of negative strength");
    }
    let color = color(json).map_err(wrong)?;
    let backwards = (source_from_node.matrix3 * DVec3::Z).try_normalize().map(|v| v.as_vec3());
    if backwards.is_none() && kind != Type::Point {
        return left_out("whose node's transform leaves no direction");
    }
    let backwards = backwards.unwrap_or(Vec3::Z);
    let light = match kind {
        Type::Directional => {
            Light::Directional { towards_light_in_world: backwards, irradiance_linear: color, angular_radius_rad: 0.0 }
        }
        Type::Point => Light::Point { position_in_world: Vec3::ZERO, intensity_linear: color, radius_m: 0.0 },
        Type::Spot => spot(json, color, -backwards).map_err(wrong)?,
    };
    light.validate().map_err(wrong)?;
    Ok(Some(SourceLight { light, position_in_source: source_from_node.translation }))
}

/// Conversion from lux and candela: a white surface reflects 1/π of them into each direction.
fn color(light: &JsonLight) -> Result<Vec3, LightError> {
    let color = Vec3::from(light.color);
    require(color.min_element() >= 0.0 && color.is_finite(), "color", "negative or not finite")?;
    require(light.intensity >= 0.0 && light.intensity.is_finite(), "intensity", "negative or not finite")?;
    Ok(color * light.intensity * FRAC_1_PI)
}

fn spot(light: &JsonLight, intensity_linear: Vec3, forward_in_world: Vec3) -> Result<Light, LightError> {
    let default = Spot { inner_cone_angle: 0.0, outer_cone_angle: std::f32::consts::FRAC_PI_4 };
    let Spot { inner_cone_angle: inner, outer_cone_angle: outer } = *light.spot.as_ref().unwrap_or(&default);
    let is_outer_valid = (0.0..FRAC_PI_2 + ANGLE_ROUNDING_RAD).contains(&outer);
    require(is_outer_valid, "spot.outerConeAngle", "not from 0 to 90 degrees")?;
    require((0.0..=outer).contains(&inner), "spot.innerConeAngle", "not from 0 to the outer cone's")?;
    Ok(Light::Spot {
        position_in_world: Vec3::ZERO,
        forward_in_world,
        intensity_linear,
        inner_cone_rad: inner.min(FRAC_PI_2),
        outer_cone_rad: outer.min(FRAC_PI_2),
        radius_m: 0.0,
    })
}

fn require(holds: bool, field: &'static str, reason: &'static str) -> Result<(), LightError> {
    if holds { Ok(()) } else { Err(LightError { field, reason }) }
}

/// Applies an exposure, which a file lacks; see [`super`].
pub(super) fn expose(scene: &mut SourceScene) {
    let bounds = scene.bounds_in_source();
    let diagonal = bounds.diagonal();
    let least = if diagonal > 0.0 { diagonal * LEAST_DISTANCE_IN_DIAGONALS } else { LEAST_DISTANCE_FROM_POINT };
    // Unoccluded irradiance, with spots aimed at the middle.
    let arriving = scene.lights.iter().map(|SourceLight { light, position_in_source }| {
        let color = color_of(*light).as_dvec3();
        let distance = position_in_source.distance(bounds.center()).max(least);
        if matches!(light, Light::Directional { .. }) { color } else { color / (distance * distance) }
    });
    let arriving: DVec3 = arriving.sum();
    let most = arriving.max_element();
    if most > 0.0 && most.is_finite() && !UNEXPOSED.contains(&most) {
        for light in &mut scene.lights {
            let color = color_mut(&mut light.light);
            *color = scaled(*color, most.recip());
        }
    }
}
