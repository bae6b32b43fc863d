//! A depth image: the samples of one sample camera. Holes are explicit.

use glam::{UVec2, Vec3};

use crate::{Camera, PinholeCamera, PixelDepth};

/// Marks a texel *without a sample*: its ray's surfaces are unknown.
pub const HOLE_INVERSE_DEPTH: f32 = -1.0;
/// Marks a texel whose ray meets no surface: free space all the way.
pub const BACKGROUND_INVERSE_DEPTH: f32 = 0.0;

/// The surface of a sample: the redundancy key of Xie §3.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SurfaceId {
    /// Index into the scene's instances.
    pub instance: u32,
    /// Triangle number, equal on every node, unique in the scene and shared by all instances of a mesh.
    pub primitive: u32,
}

/// Planes of one size, rows top-down. Colour and inverse depth are always there; the other planes exist where a
/// method requires them.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthImage {
    /// The sample camera; its size is the planes' size.
    pub camera: Camera,
    /// One over planar depth, or [`BACKGROUND_INVERSE_DEPTH`] or [`HOLE_INVERSE_DEPTH`].
    pub inverse_depth_per_m: Vec<f32>,
    /// Outgoing radiance, linear RGB9E5.
    pub color_rgb9e5: Vec<u32>,
    /// Octahedral unit normals in world space, two signed 16-bit numbers.
    pub normal_oct16: Option<Vec<u32>>,
    /// Surface keys; meaningless in texels without a sample.
    pub surface_id: Option<Vec<SurfaceId>>,
    /// Inputs of highlights, where a surface has any; requires `normal_oct16`.
    pub specular: Option<SpecularPlanes>,
    /// Marks texels whose ray passed omitted surfaces, which an earlier image holds, before the texel's own surface. No
    /// space before such a sample is proven free. `None` where no ray passed one.
    pub passed: Option<Vec<bool>>,
    /// Inverse depths at the corners of texels, with one column and one row more than the other planes. This is the
    /// image H of Xie's Algorithm 4, taken half a pixel up and to the left.
    pub corner_inverse_depth_per_m: Option<Vec<f32>>,
    /// The light that arrives at samples, in place of colour, which is then empty.
    pub light: Option<LightPlanes>,
}

/// Lamps with a share of their own in [`LightPlanes`].
pub const MAX_LAMP_SHARES: usize = 15;

/// The light that arrives at samples, in place of colour: for views that take surfaces from the scene.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LightPlanes {
    /// Octahedral normals of triangles in world space; [`DepthImage::normal_oct16`] has those of shading.
    pub triangle_normal_oct16: Vec<u32>,
    /// What a white surface reflects of lamps, linear RGB9E5.
    pub lamps_rgb9e5: Vec<u32>,
    /// What a white surface reflects of the environment, linear RGB9E5, without the material's occlusion texture.
    pub environment_rgb9e5: Vec<u32>,
    /// The arriving shares, 255 for all.
    pub share8: Vec<Vec<u32>>,
}

impl LightPlanes {
    /// Number of planes of [`LightPlanes::share8`] for `light_count` lights.
    #[must_use]
    pub const fn share_planes(light_count: usize) -> usize {
        let named = if light_count > MAX_LAMP_SHARES { MAX_LAMP_SHARES + 1 } else { light_count };
        (1 + named).div_ceil(4)
    }
}

/// Inputs from which a compositor computes view-dependent light.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SpecularPlanes {
    /// Reflectance at normal incidence (three bytes, sRGB-encoded) and perceptual roughness (the high byte);
    /// 0 where a surface has no highlight.
    pub reflectance_srgb8_roughness8: Vec<u32>,
    /// The arriving share of each light, 255 for all of it: first the environment's, then one byte a light in their
    /// order. Each plane has four bytes a texel, the first in the low byte. Empty without shadows.
    pub visibility8: Vec<Vec<u32>>,
}

impl SpecularPlanes {
    /// Number of planes of [`SpecularPlanes::visibility8`] for `light_count` lights.
    #[must_use]
    pub const fn visibility_planes(light_count: usize) -> usize {
        (light_count + 1).div_ceil(4)
    }
}

/// A plane of another size than the others.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("depth image plane {plane} has {len} texels, the camera {expected}")]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct DepthImageError {
    pub plane: &'static str,
    pub len: usize,
    pub expected: usize,
}

impl DepthImage {
    /// Checks that all planes have the camera's size.
    ///
    /// # Errors
    /// The first plane of another size.
    pub fn validate(&self) -> Result<(), DepthImageError> {
        let [texels, corners] = [self.size_px(), self.size_px() + 1].map(|size| size.element_product() as usize);
        let planes = [
            ("inverse_depth", Some(self.inverse_depth_per_m.len())),
            ("color", Some(self.color_rgb9e5.len())),
            ("normal", self.normal_oct16.as_ref().map(Vec::len)),
            ("surface_id", self.surface_id.as_ref().map(Vec::len)),
            ("reflectance", self.specular.as_ref().map(|s| s.reflectance_srgb8_roughness8.len())),
            ("passed", self.passed.as_ref().map(Vec::len)),
        ];
        let visibilities = self.specular.iter().flat_map(|s| &s.visibility8).map(|p| ("visibility", Some(p.len())));
        let planes = planes.into_iter().chain(visibilities).map(|(plane, len)| (plane, len, texels));
        let corner_plane = ("corner_inverse_depth", self.corner_inverse_depth_per_m.as_ref().map(Vec::len), corners);
        let mut wrong = planes.chain([corner_plane]).filter_map(|(plane, len, expected)| {
            len.filter(|&len| len != expected).map(|len| DepthImageError { plane, len, expected })
        });
        wrong.next().map_or(Ok(()), Err)
    }

    /// Returns whether the texel's ray passed an omitted surface: see [`DepthImage::passed`].
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
        self.camera.size_px()
    }

    /// The sample's point in world space; `None` without a sample.
    #[must_use]
    pub fn sample_in_world(&self, x: u32, y: u32) -> Option<Vec3> {
        let inverse = self.inverse_depth_per_m[(y * self.size_px().x + x) as usize];
        let pixel = UVec2::new(x, y).as_vec2() + 0.5;
        (inverse > 0.0).then(|| self.camera.unproject(PixelDepth { pixel, planar_depth_m: inverse.recip() }))
    }

    /// Least and greatest inverse depth of the samples; `None` without samples.
    #[must_use]
    pub fn inverse_depth_range(&self) -> Option<(f32, f32)> {
        let samples = self.inverse_depth_per_m.iter().copied().filter(|&d| d > 0.0);
        samples.fold(None, |range, d| {
            let (least, greatest) = range.unwrap_or((d, d));
            Some((d.min(least), d.max(greatest)))
        })
    }
}
