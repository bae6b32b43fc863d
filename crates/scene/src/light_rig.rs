//! Light for scenes that bring none, for scenes that want another, and for scenes that want none.

use glam::Vec3;

use crate::light_parts::{color, position_mut};
use crate::{Environment, Illumination, Light, Scene};

/// Angular radius of the suns that are made here: 2°. The real one's, 0.27°, blurs the edge of a shadow by a
/// hundredth of the way to what casts it, which in a view of a whole scene is a pixel or two; that shadows are
/// soft should be seen.
pub(crate) const SOFT_SUN_RAD: f32 = 2.0f32.to_radians();

/// A pale sky over warm, darker ground: `(0.20, 0.21, 0.23)` on what faces up.
const DEFAULT_ENVIRONMENT: Environment =
    Environment { zenith_linear: Vec3::new(0.216, 0.232, 0.260), nadir_linear: Vec3::new(0.12, 0.10, 0.08) };

impl Scene {
    /// Whether anything lights the scene, a light or the environment. Without, all but what glows or is unlit
    /// is black.
    #[must_use]
    pub fn has_light(&self) -> bool {
        let Illumination { lights, environment } = &self.illumination;
        *environment != Environment::default() || lights.iter().any(|light| color(light) != Vec3::ZERO)
    }

    /// This scene, with a sun over the viewer's left shoulder and a pale sky where the source gives no light
    /// at all; unchanged where it [has light](Self::has_light) or only unlit materials.
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

    /// This scene under other light: what is given takes the place of all that there was of its kind.
    /// Positions are in the coordinates of the source, and are moved by [`Scene::origin_in_source`] as
    /// everything else has been; that is done in `f64`, but a [`Light`] itself is in `f32`, a quarter of a metre
    /// at 4,000 km. Whether the lights can be used, [`Scene::validate`] says.
    #[must_use]
    pub fn lit_by(mut self, lights: Option<Vec<Light>>, environment: Option<Environment>) -> Self {
        if let Some(mut lights) = lights {
            for position in lights.iter_mut().filter_map(position_mut) {
                *position = (position.as_dvec3() - self.origin_in_source).as_vec3();
            }
            self.illumination.lights = lights;
        }
        self.illumination.environment = environment.unwrap_or(self.illumination.environment);
        self
    }

    /// This scene with every surface shown as it is, whatever the light: for scans whose vertex colours
    /// hold the light already.
    #[must_use]
    pub fn with_unlit_materials(mut self) -> Self {
        self.materials.iter_mut().for_each(|m| m.unlit = true);
        self
    }
}
