//! View-dependent light: its models, and what surfaces have of it.

use glam::Vec3;

use crate::srgb8_from_linear;

/// The reflection model of surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Highlight {
    /// Blinn-Phong: the reflectance is its strength, the roughness gives its exponent. Lamps only.
    BlinnPhong,
    /// Microfacets of Trowbridge-Reitz (GGX), for lamps and the environment.
    #[default]
    Ggx,
}

/// The highlight parameters of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflector {
    /// Reflectance at normal incidence, linear RGB from 0 to 1.
    pub reflectance_linear: Vec3,
    /// Perceptual roughness: the square root of the microfacets' alpha, from 0 to 1.
    pub roughness: f32,
}

/// Most mirrors that a ray meets, one after the other.
pub const MAX_REFLECTIONS: u32 = 8;
/// Mirror cells of a view.
pub const MAX_MIRROR_CELLS: usize = 8;
/// Perceptual roughness: smoother surfaces show the scene, the smoother the more of it. The shader has the same number.
pub const ROUGHEST_MIRROR: f32 = 0.2;

/// Range of the exponents of Blinn-Phong lobes.
pub(crate) const EXPONENTS: [f32; 2] = [1.0, 1024.0];

impl Reflector {
    /// The word of [`crate::SpecularPlanes::reflectance_srgb8_roughness8`]; 0 without reflectance.
    #[must_use]
    pub fn pack(self) -> u32 {
        let [r, g, b] = self.reflectance_linear.to_array().map(srgb8_from_linear);
        let roughness = (self.roughness.clamp(0.0, 1.0) * 255.0).round() as u8;
        if [r, g, b] == [0; 3] { 0 } else { u32::from_le_bytes([r, g, b, roughness]) }
    }

    /// The roughness whose lobe is as wide as a Blinn-Phong lobe (Walter et al. 2007).
    #[must_use]
    pub fn roughness_of_exponent(exponent: f32) -> f32 {
        (2.0 / (exponent.clamp(EXPONENTS[0], EXPONENTS[1]) + 2.0)).sqrt().sqrt()
    }
}
