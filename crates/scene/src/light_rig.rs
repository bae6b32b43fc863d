//! Light for scenes that bring none, and scenes that want none.

use glam::Vec3;

use crate::{Light, Scene};

impl Scene {
    /// This scene, with a sun over the viewer's left shoulder and a grey sky where the source gives no
    /// light at all; unchanged where it has lights, ambient light or only unlit materials.
    #[must_use]
    pub fn with_default_lights(mut self) -> Self {
        let has_light = !self.lights.is_empty() || self.ambient_linear != Vec3::ZERO;
        if has_light || self.materials.iter().all(|m| m.unlit) {
            return self;
        }
        self.ambient_linear = Vec3::new(0.20, 0.21, 0.23);
        self.lights.push(Light::Directional {
            towards_light_in_world: Vec3::new(-3.0, 6.0, 4.0) / 61f32.sqrt(),
            irradiance_linear: Vec3::new(0.85, 0.82, 0.78),
        });
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
