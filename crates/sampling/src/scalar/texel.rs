//! A texel of a sampled image.

use depth_image::SurfaceId;

#[derive(Debug, Clone, Copy)]
pub(super) struct Texel {
    pub inverse_depth_per_m: f32,
    pub normal_oct16: u32,
    pub id: SurfaceId,
    /// Whether a surface before it was redundant.
    pub has_passed: bool,
}

impl Texel {
    /// A texel without a sample: background or a hole.
    pub fn empty(inverse_depth_per_m: f32, has_passed: bool) -> Self {
        let id = SurfaceId { instance: 0, primitive: 0 };
        Self { inverse_depth_per_m, normal_oct16: 0, id, has_passed }
    }
}
