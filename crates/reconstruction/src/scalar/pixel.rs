//! The colour, depth and provenance of a pixel.

use depth_image::{Provenance, ProvenanceKind};
use glam::Vec3;

/// The colour, depth and provenance of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pixel {
    /// Of a surface: the background is added last.
    pub color_linear: Vec3,
    pub inverse_depth_per_m: f32,
    pub provenance: Provenance,
    /// See [`super::surface::Blend`].
    pub lowest_share: Option<f32>,
}

impl Pixel {
    pub fn without_surface(kind: ProvenanceKind) -> Self {
        Self {
            color_linear: Vec3::ZERO,
            inverse_depth_per_m: 0.0,
            provenance: Provenance::new(kind, 0),
            lowest_share: None,
        }
    }

    pub fn hit(color_linear: Vec3, t: f32, camera_mask: u32) -> Self {
        Self {
            color_linear,
            inverse_depth_per_m: t.recip(),
            provenance: Provenance::new(ProvenanceKind::Hit, camera_mask),
            lowest_share: None,
        }
    }
}
