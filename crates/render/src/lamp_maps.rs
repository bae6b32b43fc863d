//! Shadow maps from places of a rectangle: what is nearest to each of them, of the scene or of samples of it.

use depth_image::PinholeCamera;
use gpu::{DrawPass, Frame, cube_walk::CubeBricks};
use wgpu::TextureView;

use crate::{RenderError, layers::LayerKind};

/// The most maps that are drawn and read together.
pub(crate) const MAPS_AT_ONCE: u32 = 16;
/// Their most bytes, unless one alone has more: sixteen of 1024².
const MOST_BYTES: u64 = 64 << 20;
/// The sides of shadow maps.
pub(crate) const DEFAULT_SIDE_PX: u32 = 1024;

/// Draws shadow maps from samples of what lamps see.
pub trait LampMapSource: Sync {
    /// Records what each camera on a lamp, by its number, sees of the samples into its depth target.
    ///
    /// # Errors
    /// The lamp has no samples, or the device.
    fn record(
        &self,
        frame: &mut Frame<'_>,
        lamp: usize,
        cameras: &[PinholeCamera],
        reversed_depths: &[TextureView],
    ) -> Result<(), RenderError>;
}

/// The shadow maps of rectangles, and the cube, for light that asks them.
#[derive(Clone, Copy)]
pub struct LampMaps<'a> {
    /// Width and height of maps.
    pub side_px: u32,
    /// Where maps come from that are not of the scene itself.
    pub samples: Option<&'a dyn LampMapSource>,
    /// The scene's layered cube.
    pub cube: Option<&'a CubeBricks>,
}

impl Default for LampMaps<'_> {
    fn default() -> Self {
        Self { side_px: DEFAULT_SIDE_PX, samples: None, cube: None }
    }
}

/// The texture of maps of a side, with a layer for each that is drawn together with others.
pub(crate) fn kind(side_px: u32) -> LayerKind {
    ([side_px, side_px, layers(side_px)], DrawPass::DEPTH_FORMAT)
}

fn map_bytes(side_px: u32) -> u64 {
    4 * u64::from(side_px).pow(2)
}

fn layers(side_px: u32) -> u32 {
    (MOST_BYTES / map_bytes(side_px).max(1)).clamp(1, MAPS_AT_ONCE.into()) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_that_are_drawn_together_take_64_mib_at_most() {
        let bytes = |side_px| map_bytes(side_px) * u64::from(layers(side_px));
        assert_eq!([64, 1024, 2048, 4096].map(layers), [16, 16, 4, 1]);
        assert!([64, 1000, 1024, 1500, 4096].into_iter().all(|side_px| bytes(side_px) <= MOST_BYTES));
    }
}
