//! Default lights, replaced lights, and the common parts of all kinds of lights.

use glam::{DVec3, Vec3};

use crate::{Environment, EnvironmentMap, Illumination, Light, Scene, SourceSpace};

/// Angular radius of default suns: 2°, so that soft shadows are visible. The real sun's 0.27° blurs a shadow's edge by
/// a hundredth of the distance to its caster, a pixel or two in a view of a whole scene.
pub(crate) const SOFT_SUN_RAD: f32 = 2.0f32.to_radians();

/// A pale sky over warm, darker ground: `(0.20, 0.21, 0.23)` on upward surfaces.
const DEFAULT_ENVIRONMENT: Environment =
    Environment::gradient(Vec3::new(0.216, 0.232, 0.260), Vec3::new(0.12, 0.10, 0.08));

/// A quiet grey from above to below, which no colour of a model is mistaken for.
pub(crate) const DEFAULT_BACKGROUND: Environment =
    Environment::gradient(Vec3::new(0.56, 0.60, 0.66), Vec3::new(0.06, 0.065, 0.075));

impl Scene {
    /// Adds a quiet gradient behind a scene without a background.
    #[must_use]
    pub fn with_default_background(mut self) -> Self {
        if self.background == Environment::default() {
            self.background = DEFAULT_BACKGROUND;
        }
        self
    }

    /// Returns whether a lamp or the environment lights the scene. Otherwise only emissive and unlit surfaces are
    /// visible.
    #[must_use]
    pub fn has_light(&self) -> bool {
        let Illumination { lights, environment } = &self.illumination;
        *environment != Environment::default() || lights.iter().any(|light| color(*light) != Vec3::ZERO)
    }

    /// Adds a sun over the viewer's left shoulder and a pale sky to a scene without light. A scene that [has
    /// light](Self::has_light) or only unlit materials stays unchanged.
    #[must_use]
    pub fn with_default_lights(mut self) -> Self {
        if self.has_light() || self.materials.iter().all(|m| m.unlit) {
            return self;
        }
        let sun = Light::Directional {
            towards_light_in_world: Vec3::new(-3.0, 6.0, 4.0) / 61f32.sqrt(),
            irradiance_linear: Vec3::new(0.85, 0.82, 0.78),
            angular_radius_rad: SOFT_SUN_RAD,
        };
        self.illumination = Illumination { lights: vec![sun], environment: DEFAULT_ENVIRONMENT };
        self
    }

    /// Replaces the scene's lamps, environment or both. Positions, lengths and intensities are in the coordinates of the
    /// source, and are converted by [`Scene::source_space`] in `f64`. A [`Light`] itself is in `f32`, a quarter of a metre at 4,000 km.
    /// [`Scene::validate`] checks the lights.
    #[must_use]
    pub fn lit_by(mut self, lights: Option<Vec<Light>>, environment: Option<Environment>) -> Self {
        if let Some(lights) = lights {
            let lights = lights.into_iter().map(|light| SourceLight::new(light).placed_in(self.source_space));
            self.illumination.lights = lights.collect();
        }
        if let Some(environment) = environment {
            (self.illumination.environment, self.environment_map) = (environment, None);
        }
        self
    }

    /// Replaces the scene's environment and background by a map.
    #[must_use]
    pub fn surrounded_by(self, map: EnvironmentMap) -> Self {
        let illumination = Illumination { environment: Environment::mapped(), ..self.illumination };
        Self { illumination, environment_map: Some(map), ..self }
    }
}

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
pub(crate) fn color(mut light: Light) -> Vec3 {
    *color_mut(&mut light)
}

/// A light in the coordinates of a source, whose position counts in double precision.
pub(crate) struct SourceLight {
    pub light: Light,
    pub position_in_source: DVec3,
}

impl SourceLight {
    pub(crate) fn new(mut light: Light) -> Self {
        let position_in_source = position_mut(&mut light).map_or(DVec3::ZERO, |position| position.as_dvec3());
        Self { light, position_in_source }
    }

    /// The light in the world: lengths are scaled, and with them the intensity, which is that at a distance of one unit.
    pub(crate) fn placed_in(mut self, space: SourceSpace) -> Light {
        if let Some(position) = position_mut(&mut self.light) {
            *position = space.world_from_source(self.position_in_source);
        }
        let metres_per_unit = space.metres_per_unit;
        match &mut self.light {
            Light::Directional { .. } => {}
            Light::Point { intensity_linear, radius_m, .. } | Light::Spot { intensity_linear, radius_m, .. } => {
                *intensity_linear = scaled(*intensity_linear, metres_per_unit * metres_per_unit);
                *radius_m = (f64::from(*radius_m) * metres_per_unit) as f32;
            }
            Light::Rectangle { half_edges_in_world, .. } => {
                *half_edges_in_world = half_edges_in_world.map(|edge| scaled(edge, metres_per_unit));
            }
        }
        self.light
    }
}

/// Scales in double precision: a factor may be too small for `f32` where the result is not.
pub(crate) fn scaled(v: Vec3, factor: f64) -> Vec3 {
    (v.as_dvec3() * factor).as_vec3()
}

/// Position of a light; `None` for parallel light.
fn position_mut(light: &mut Light) -> Option<&mut Vec3> {
    match light {
        Light::Directional { .. } => None,
        Light::Point { position_in_world: position, .. }
        | Light::Spot { position_in_world: position, .. }
        | Light::Rectangle { center_in_world: position, .. } => Some(position),
    }
}
