//! Common parts of all kinds of lights.

use depth_image::Light;
use glam::Vec3;

/// The strength of a light, in the unit of its kind.
pub(crate) fn color_mut(light: &mut Light) -> &mut Vec3 {
    match light {
        Light::Directional { irradiance_linear: color, .. }
        | Light::Point { intensity_linear: color, .. }
        | Light::Spot { intensity_linear: color, .. }
        | Light::Rectangle { radiance_linear: color, .. } => color,
    }
}

/// See [`color_mut`].
pub(crate) fn color(light: &Light) -> Vec3 {
    let mut light = *light;
    *color_mut(&mut light)
}

/// Position of a light; `None` for parallel light.
pub(crate) fn position_mut(light: &mut Light) -> Option<&mut Vec3> {
    match light {
        Light::Directional { .. } => None,
        Light::Point { position_in_world: position, .. }
        | Light::Spot { position_in_world: position, .. }
        | Light::Rectangle { center_in_world: position, .. } => Some(position),
    }
}
