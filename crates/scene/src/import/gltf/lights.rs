//! `KHR_lights_punctual`, and `MYRIORAMA_scene`, whose lamps take the place of those of nodes.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};
use std::ops::RangeInclusive;

use glam::{DAffine3, DVec3, Vec3};
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Spot, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use serde::Deserialize;

use super::super::SourceScene;
use super::json::chosen_scene;
use super::{Document, parsed};
use crate::light_rig::{SourceLight, color, color_mut, scaled};
use crate::{Environment, Fault, Illumination, Light, LightError};

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

/// The light of the node that `node` names in messages. `None` for a light of negative strength, and for one whose node has no
/// direction.
pub(super) fn placed(
    document: &Document,
    index: Index<JsonLight>,
    node: &str,
    source_from_node: DAffine3,
) -> Result<Option<SourceLight>, Fault> {
    let json = document.root.get(index).ok_or_else(|| Fault::malformed(node, "its light does not exist"))?;
    let element = format!("light {}", index.value());
    let left_out = |reason: &str| {
        let name = json.name.as_deref().unwrap_or("no name");
        document.warnings.count(format!("lights {reason} are left out"), format_args!("{element} ({name})"));
        Ok(None)
    };
    let Checked::Valid(kind) = json.type_ else {
        return Err(Fault::malformed(element, "unknown type"));
    };
    if json.intensity < 0.0 || json.color.iter().any(|channel| *channel < 0.0) {
        return left_out("of negative strength");
    }
    if !Vec3::from(json.color).is_finite() {
        return Err(Fault::light(&element, &LightError { field: "color", reason: "not finite" }));
    }
    // From lux and candela: a white surface reflects 1/π of them into each direction.
    let color = Vec3::from(json.color) * json.intensity * FRAC_1_PI;
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
        Type::Spot => {
            let default = Spot { inner_cone_angle: 0.0, outer_cone_angle: FRAC_PI_4 };
            let spot = json.spot.as_ref().unwrap_or(&default);
            Light::Spot {
                position_in_world: Vec3::ZERO,
                forward_in_world: -backwards,
                intensity_linear: color,
                inner_cone_rad: at_most_right_angle(spot.inner_cone_angle),
                outer_cone_rad: at_most_right_angle(spot.outer_cone_angle),
                radius_m: 0.0,
            }
        }
    };
    light.validate().map_err(|LightError { field, reason }| {
        let field = match field {
            "irradiance" => "intensity",
            "outer_cone" => "spot.outerConeAngle",
            "inner_cone" => "spot.innerConeAngle",
            other => other,
        };
        Fault::light(&element, &LightError { field, reason })
    })?;
    Ok(Some(SourceLight { light, position_in_source: source_from_node.translation }))
}

fn at_most_right_angle(angle_rad: f32) -> f32 {
    let is_rounded = (FRAC_PI_2..FRAC_PI_2 + ANGLE_ROUNDING_RAD).contains(&angle_rad);
    if is_rounded { FRAC_PI_2 } else { angle_rad }
}

/// Applies an exposure, which a file lacks; see [`super`].
pub(super) fn expose(scene: &mut SourceScene) {
    let bounds = scene.bounds_in_source();
    let diagonal = bounds.diagonal();
    let least = if diagonal > 0.0 { diagonal * LEAST_DISTANCE_IN_DIAGONALS } else { LEAST_DISTANCE_FROM_POINT };
    // Unoccluded irradiance, with spots aimed at the middle.
    let arriving = scene.lights.iter().map(|SourceLight { light, position_in_source }| {
        let color = color(*light).as_dvec3();
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

/// The name of an extension of a glTF scene for what glTF has no words for: lamps with a size, light from all around, the
/// background, and Phong's highlights. `myriorama-lab scene` writes it.
pub(super) const SCENE_EXTENSION: &str = "MYRIORAMA_scene";

#[derive(Deserialize)]
struct SceneExtension {
    illumination: Illumination,
    background: Environment,
    /// Strength and exponent of each of the file's materials.
    phong: Vec<[f32; 2]>,
}

/// Returns whether the scene has the extension.
pub(super) fn read_extension(root: &Root, scene: &mut SourceScene) -> Result<bool, Fault> {
    let json = chosen_scene(root).and_then(|number| root.get(number));
    let extensions = json.and_then(|json| json.extensions.as_ref());
    let Some(value) = extensions.and_then(|extensions| extensions.others.get(SCENE_EXTENSION)) else {
        return Ok(false);
    };
    let extension: SceneExtension = parsed(value, SCENE_EXTENSION)?;
    if extension.phong.len() != root.materials.len() {
        let reason = format!("phong is that of {} materials, of {}", extension.phong.len(), root.materials.len());
        return Err(Fault::malformed(SCENE_EXTENSION, reason));
    }
    scene.lights = extension.illumination.lights.into_iter().map(SourceLight::new).collect();
    scene.environment = extension.illumination.environment;
    scene.background = Some(extension.background);
    for (material, [strength, exponent]) in scene.materials.iter_mut().zip(extension.phong) {
        material.phong_specular = strength;
        material.phong_exponent = exponent;
    }
    Ok(true)
}
