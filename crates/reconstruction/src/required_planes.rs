//! Planes that a method needs beside colour and depth.

use depth_image::DepthImage;

/// Planes of sample images that a method needs beside colour and depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RequiredPlanes {
    /// Normals of the samples.
    pub normal: bool,
    /// Inverse depths at the corners of texels.
    pub corner_inverse_depth: bool,
}

impl RequiredPlanes {
    /// The first image that lacks a plane, and the plane's name in [`depth_image::DepthImageError`].
    pub(crate) fn missing(self, images: &[DepthImage]) -> Option<(usize, &'static str)> {
        let missing = |image: &DepthImage| {
            let normal = self.normal && image.normal_oct16.is_none();
            let corners = self.corner_inverse_depth && image.corner_inverse_depth_per_m.is_none();
            normal.then_some("normal").or(corners.then_some("corner_inverse_depth"))
        };
        images.iter().enumerate().find_map(|(index, image)| Some((index, missing(image)?)))
    }
}
