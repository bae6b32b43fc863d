//! A texel of a sampled image.

use depth_image::SurfaceId;

#[derive(Debug, Clone, Copy)]
pub(super) struct Texel {
    pub inverse_depth_per_m: f32,
    pub normal_oct16: u32,
    pub id: SurfaceId,
    /// Planar depth of the nearest surface that was redundant before it, if any was.
    pub passed_m: Option<f32>,
}
