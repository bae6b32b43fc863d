//! Texels as their planes describe them.

use glam::Vec3;

use crate::{BACKGROUND_INVERSE_DEPTH, DepthImage, linear_from_rgb9e5};

/// The content of one texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Texel {
    /// No sample: the surface is unknown.
    Hole,
    /// The ray meets no surface.
    Background,
    /// A sample of a surface.
    Sample {
        /// Depth along the forward axis.
        planar_depth_m: f32,
        /// Outgoing radiance, linear RGB; `None` in an image with light.
        color_linear: Option<Vec3>,
    },
}

impl DepthImage {
    /// The content of the texel at column `x`, row `y`.
    #[must_use]
    pub fn texel(&self, x: u32, y: u32) -> Texel {
        let index = (y * self.size_px().x + x) as usize;
        match self.inverse_depth_per_m[index] {
            inverse if inverse > 0.0 => Texel::Sample {
                planar_depth_m: inverse.recip(),
                color_linear: self.color_rgb9e5.get(index).copied().map(linear_from_rgb9e5),
            },
            BACKGROUND_INVERSE_DEPTH => Texel::Background,
            _ => Texel::Hole,
        }
    }
}
