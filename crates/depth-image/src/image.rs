//! A depth image: what one sample camera saw. Holes are explicit.

use glam::{UVec2, Vec3};

use crate::{Camera, PinholeCamera, PixelDepth, linear_from_rgb9e5};

/// Marks a texel that has *no sample*: it says nothing about what its ray meets.
pub const HOLE_INVERSE_DEPTH: f32 = -1.0;
/// Marks a texel whose ray was seen to meet nothing: free space all the way.
pub const BACKGROUND_INVERSE_DEPTH: f32 = 0.0;

/// Which surface a sample lies on: the redundancy key of Xie §3.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SurfaceId {
    /// Into the scene's instances.
    pub instance: u32,
    /// Triangle number, the same on every node: unique in the scene, shared by all instances of a mesh.
    pub primitive: u32,
}

/// What one texel holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Texel {
    /// No sample: nothing is known.
    Hole,
    /// The ray meets no surface.
    Background,
    /// A surface.
    Sample {
        /// Along the forward axis.
        planar_depth_m: f32,
        /// Outgoing radiance, linear RGB.
        color_linear: Vec3,
    },
}

/// Planes of one size, rows top-down. Colour and inverse depth are always there; the others when a
/// method asked for them.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthImage {
    /// What it was taken with; its size is the planes' size.
    pub camera: Camera,
    /// Per metre of planar depth; [`BACKGROUND_INVERSE_DEPTH`] or [`HOLE_INVERSE_DEPTH`] otherwise.
    pub inverse_depth_per_m: Vec<f32>,
    /// RGB9E5, linear.
    pub color_rgb9e5: Vec<u32>,
    /// Octahedral unit normals in world space, two signed 16-bit numbers.
    pub normal_oct16: Option<Vec<u32>>,
    /// Surface keys; meaningless where there is no sample.
    pub surface_id: Option<Vec<SurfaceId>>,
    /// What highlights need, where a surface has any: needs `normal_oct16`.
    pub specular: Option<SpecularPlanes>,
    /// Whether a texel's ray went through surfaces that were left out, because an earlier image holds them, before
    /// it reached what the texel shows. Nothing before such a sample is proven free. `None` where no ray did.
    pub passed: Option<Vec<bool>>,
    /// Inverse depths at the corners of texels, one column and one row more than the other planes: the image H of
    /// Xie's Algorithm 4, taken half a pixel up and to the left.
    pub corner_inverse_depth_per_m: Option<Vec<f32>>,
}

/// What a compositor needs to add light that depends on the viewer.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SpecularPlanes {
    /// Reflectance at normal incidence (three bytes, sRGB-encoded) and perceptual roughness (the high byte);
    /// 0 where a surface has no highlight.
    pub reflectance_srgb8_roughness8: Vec<u32>,
    /// What share of each light arrives, 255 for all of it; the environment's is the first, then one byte a
    /// light in their order. Each plane has four bytes a texel, the first in the low byte. Empty where nothing
    /// casts shadows.
    pub visibility8: Vec<Vec<u32>>,
}

impl SpecularPlanes {
    /// Planes of [`SpecularPlanes::visibility8`] for so many lights.
    #[must_use]
    pub const fn visibility_planes(light_count: usize) -> usize {
        (light_count + 1).div_ceil(4)
    }
}

/// Why planes do not make a depth image.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DepthImageError {
    /// A plane's length is not width times height.
    #[error("depth image plane {plane} has {len} texels, the camera {expected}")]
    PlaneSize {
        /// Which.
        plane: &'static str,
        /// Texels given.
        len: usize,
        /// Texels of the camera.
        expected: usize,
    },
}

impl DepthImage {
    /// Checks that all planes have the camera's size.
    ///
    /// # Errors
    /// Names the first plane that has not.
    pub fn validate(&self) -> Result<(), DepthImageError> {
        let expected = self.size_px().element_product() as usize;
        let planes = [
            ("inverse_depth", Some(self.inverse_depth_per_m.len())),
            ("color", Some(self.color_rgb9e5.len())),
            ("normal", self.normal_oct16.as_ref().map(Vec::len)),
            ("surface_id", self.surface_id.as_ref().map(Vec::len)),
            ("reflectance", self.specular.as_ref().map(|s| s.reflectance_srgb8_roughness8.len())),
            ("passed", self.passed.as_ref().map(Vec::len)),
        ];
        let visibilities = self.specular.iter().flat_map(|s| &s.visibility8).map(|p| ("visibility", Some(p.len())));
        match planes
            .into_iter()
            .chain(visibilities)
            .find_map(|(plane, len)| len.filter(|&len| len != expected).map(|len| (plane, len)))
        {
            Some((plane, len)) => Err(DepthImageError::PlaneSize { plane, len, expected }),
            None => self.validate_corners(),
        }
    }

    fn validate_corners(&self) -> Result<(), DepthImageError> {
        let expected = (self.size_px() + 1).element_product() as usize;
        let len = self.corner_inverse_depth_per_m.as_ref().map_or(expected, Vec::len);
        let wrong = DepthImageError::PlaneSize { plane: "corner_inverse_depth", len, expected };
        if len == expected { Ok(()) } else { Err(wrong) }
    }

    /// Whether the texel's ray passed a surface that other images hold: see [`DepthImage::passed`].
    #[must_use]
    pub fn has_passed(&self, index: usize) -> bool {
        self.passed.as_ref().is_some_and(|passed| passed[index])
    }

    /// The camera of [`DepthImage::corner_inverse_depth_per_m`]: its texel centres are this one's corners.
    #[must_use]
    pub fn corner_camera(camera: &PinholeCamera) -> PinholeCamera {
        PinholeCamera { size_px: camera.size_px + 1, principal_px: camera.principal_px + 0.5, ..*camera }
    }

    /// Columns and rows.
    #[must_use]
    pub fn size_px(&self) -> UVec2 {
        match &self.camera {
            Camera::Pinhole(camera) => camera.size_px,
        }
    }

    /// What the texel at column `x`, row `y` holds.
    #[must_use]
    pub fn texel(&self, x: u32, y: u32) -> Texel {
        let index = (y * self.size_px().x + x) as usize;
        match self.inverse_depth_per_m[index] {
            inverse if inverse > 0.0 => Texel::Sample {
                planar_depth_m: inverse.recip(),
                color_linear: linear_from_rgb9e5(self.color_rgb9e5[index]),
            },
            BACKGROUND_INVERSE_DEPTH => Texel::Background,
            _ => Texel::Hole,
        }
    }

    /// The point in the world that a texel's sample lies at.
    #[must_use]
    pub fn sample_in_world(&self, x: u32, y: u32) -> Option<Vec3> {
        let Texel::Sample { planar_depth_m, .. } = self.texel(x, y) else { return None };
        let pixel = UVec2::new(x, y).as_vec2() + 0.5;
        Some(self.camera.unproject(PixelDepth { pixel, planar_depth_m }))
    }

    /// Finite, positive inverse depths: least and greatest; `None` where no texel has a sample.
    #[must_use]
    pub fn inverse_depth_range(&self) -> Option<(f32, f32)> {
        let samples = self.inverse_depth_per_m.iter().copied().filter(|&d| d > 0.0);
        samples.fold(None, |range, d| {
            let (least, greatest) = range.unwrap_or((d, d));
            Some((d.min(least), d.max(greatest)))
        })
    }
}
