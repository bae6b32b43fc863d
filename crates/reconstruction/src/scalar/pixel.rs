//! The colour, depth and provenance of a pixel.

use depth_image::{Provenance, ProvenanceKind, srgb8_from_linear};
use glam::Vec3;

/// The colour, depth and provenance of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pixel {
    pub srgb8: [u8; 3],
    pub inverse_depth_per_m: f32,
    pub provenance: Provenance,
}

impl Pixel {
    pub fn without_surface(kind: ProvenanceKind, background_srgb8: [u8; 3]) -> Self {
        Self { srgb8: background_srgb8, inverse_depth_per_m: 0.0, provenance: Provenance::new(kind, 0) }
    }

    pub fn hit(color_linear: Vec3, t: f32, camera_mask: u32) -> Self {
        Self {
            srgb8: color_linear.to_array().map(srgb8_from_linear),
            inverse_depth_per_m: t.recip(),
            provenance: Provenance::new(ProvenanceKind::Hit, camera_mask),
        }
    }
}
