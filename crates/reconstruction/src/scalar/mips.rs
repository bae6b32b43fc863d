//! Twin of `bounce/mips.wgsl`: colours of rays that cover several texels, from an image's coarser levels.

use depth_image::{DepthImage, linear_from_rgb9e5};
use glam::{UVec2, Vec2, Vec3};

use crate::bounce::mips::mips;
use crate::view_work::CELL_MARGIN_PX;

/// The coarser levels of an image's colours.
#[derive(Debug)]
pub struct ColorMips(Vec<(UVec2, Vec<u32>)>);

impl ColorMips {
    /// All levels of an image.
    #[must_use]
    pub fn of(image: &DepthImage) -> Self {
        Self(mips(image))
    }

    /// The colour that a ray shows where it ends, at a place in the image. The ray is `width_texels` wide there. `color_linear` is what
    /// a ray without width shows.
    #[must_use]
    pub fn filtered(&self, color_linear: Vec3, place_px: Vec2, width_texels: f32) -> Vec3 {
        let level = (0.5 * width_texels).max(1.0).log2().min(self.0.len() as f32);
        let [below, above] = [level.floor(), level.ceil()].map(|whole| match whole as usize {
            0 => color_linear,
            level => self.color(level, place_px),
        });
        below.lerp(above, level.fract())
    }

    /// Bilinear.
    fn color(&self, level: usize, place_px: Vec2) -> Vec3 {
        let (size_px, colors) = &self.0[level - 1];
        let most = size_px.as_vec2() - 1.0 - CELL_MARGIN_PX;
        let uv = (place_px / (level as f32).exp2() - 0.5).clamp(Vec2::ZERO, most);
        let cell = uv.as_uvec2();
        let share = uv.fract();
        let [upper, lower] = [0, 1].map(|y| {
            let [left, right] =
                [0, 1].map(|x| linear_from_rgb9e5(colors[((cell.y + y) * size_px.x + cell.x + x) as usize]));
            left.lerp(right, share.x)
        });
        upper.lerp(lower, share.y)
    }
}
