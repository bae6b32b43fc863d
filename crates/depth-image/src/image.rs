//! A depth image: the samples of one sample camera. Holes are explicit.

use glam::{UVec2, Vec3};

use crate::{Camera, PinholeCamera, PixelDepth, SampleImageError};

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

/// Planes of one size, rows top-down. Inverse depth is always there, and either colour or light; the other planes exist
/// where a method requires them.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthImage {
    /// The sample camera; its size is the planes' size.
    pub camera: Camera,
    /// One over planar depth, or [`BACKGROUND_INVERSE_DEPTH`] or [`HOLE_INVERSE_DEPTH`].
    pub inverse_depth_per_m: Vec<f32>,
    /// Outgoing radiance, linear RGB9E5; empty in an image with light.
    pub color_rgb9e5: Vec<u32>,
    /// Octahedral unit normals in world space, two signed 16-bit numbers. An image with light has them.
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
    /// Light in place of colour. An image with light has neither inputs of highlights nor corners.
    pub light: Option<LightPlanes>,
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

/// Lamps with a share of their own in [`LightPlanes::share8`].
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
    /// The arriving shares, 255 for all: the environment's first, then one byte for each of at most [`MAX_LAMP_SHARES`] lamps,
    /// then one for all other lamps where there are more. Each plane has four bytes a texel, the first in the low byte. Empty
    /// without shadows.
    pub share8: Vec<Vec<u32>>,
}

impl LightPlanes {
    /// Number of planes of [`LightPlanes::share8`] for `light_count` lamps.
    #[must_use]
    pub const fn share_planes(light_count: usize) -> usize {
        if light_count > MAX_LAMP_SHARES { (MAX_LAMP_SHARES + 2).div_ceil(4) } else { (light_count + 1).div_ceil(4) }
    }
}

impl DepthImage {
    /// Checks that all planes have the camera's size, and that an image has either colour or light.
    ///
    /// # Errors
    /// The first plane that is missing, unexpected or of another size.
    pub fn validate(&self) -> Result<(), SampleImageError> {
        let [texels, corners] = [self.size_px(), self.size_px() + 1].map(|size| size.element_product() as usize);
        let planes = [
            ("inverse_depth", Some(self.inverse_depth_per_m.len())),
            ("normal", self.normal_oct16.as_ref().map(Vec::len)),
            ("surface_id", self.surface_id.as_ref().map(Vec::len)),
            ("passed", self.passed.as_ref().map(Vec::len)),
        ];
        for (plane, len) in planes {
            check_size(plane, len.unwrap_or(texels), texels)?;
        }
        match &self.light {
            Some(light) => self.validate_light(light, texels),
            None => self.validate_color(texels, corners),
        }
    }

    fn validate_color(&self, texels: usize, corners: usize) -> Result<(), SampleImageError> {
        check_size("color", self.color_rgb9e5.len(), texels)?;
        if let Some(specular) = &self.specular {
            check_size("reflectance", specular.reflectance_srgb8_roughness8.len(), texels)?;
            specular.visibility8.iter().try_for_each(|plane| check_size("visibility", plane.len(), texels))?;
        }
        let corner_plane = self.corner_inverse_depth_per_m.as_ref();
        check_size("corner_inverse_depth", corner_plane.map_or(corners, Vec::len), corners)
    }

    fn validate_light(&self, light: &LightPlanes, texels: usize) -> Result<(), SampleImageError> {
        let of_color = [
            ("color", !self.color_rgb9e5.is_empty()),
            ("reflectance", self.specular.is_some()),
            ("corner_inverse_depth", self.corner_inverse_depth_per_m.is_some()),
        ];
        if let Some((plane, _)) = of_color.into_iter().find(|(_, is_present)| *is_present) {
            return Err(SampleImageError::BesideLight { plane });
        }
        check_size("normal", self.normal_oct16.as_ref().map_or(0, Vec::len), texels)?;
        check_size("triangle_normal", light.triangle_normal_oct16.len(), texels)?;
        check_size("lamps", light.lamps_rgb9e5.len(), texels)?;
        check_size("environment", light.environment_rgb9e5.len(), texels)?;
        light.share8.iter().try_for_each(|plane| check_size("share", plane.len(), texels))
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

fn check_size(plane: &'static str, len: usize, expected: usize) -> Result<(), SampleImageError> {
    if len == expected { Ok(()) } else { Err(SampleImageError::Size { plane, len, expected }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lit() -> DepthImage {
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::new(4, 3));
        DepthImage {
            camera: camera.into(),
            inverse_depth_per_m: vec![0.5; 12],
            color_rgb9e5: Vec::new(),
            normal_oct16: Some(vec![1; 12]),
            surface_id: None,
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
            light: Some(LightPlanes {
                triangle_normal_oct16: vec![2; 12],
                lamps_rgb9e5: vec![3; 12],
                environment_rgb9e5: vec![4; 12],
                share8: vec![vec![5; 12]; 2],
            }),
        }
    }

    #[test]
    fn wrong_planes_of_light_are_refused_by_name() {
        assert_eq!(lit().validate(), Ok(()));
        type Damage = fn(&mut LightPlanes);
        let cases: [(&str, Damage); 4] = [
            ("triangle_normal", |light| light.triangle_normal_oct16.truncate(11)),
            ("lamps", |light| light.lamps_rgb9e5.truncate(11)),
            ("environment", |light| light.environment_rgb9e5.truncate(11)),
            ("share", |light| light.share8[1].truncate(11)),
        ];
        for (plane, damage) in cases {
            let mut bad = lit();
            damage(bad.light.as_mut().unwrap());
            assert_eq!(bad.validate(), Err(SampleImageError::Size { plane, len: 11, expected: 12 }));
        }
        let without_normals = DepthImage { normal_oct16: None, ..lit() };
        let missing = SampleImageError::Size { plane: "normal", len: 0, expected: 12 };
        assert_eq!(without_normals.validate(), Err(missing));
    }

    #[test]
    fn an_image_has_either_colour_or_light() {
        let beside = |plane| Err(SampleImageError::BesideLight { plane });
        assert_eq!(DepthImage { color_rgb9e5: vec![0; 12], ..lit() }.validate(), beside("color"));
        let specular = Some(SpecularPlanes::default());
        assert_eq!(DepthImage { specular, ..lit() }.validate(), beside("reflectance"));
        let corner_inverse_depth_per_m = Some(vec![0.0; 20]);
        assert_eq!(DepthImage { corner_inverse_depth_per_m, ..lit() }.validate(), beside("corner_inverse_depth"));
        let neither = DepthImage { light: None, ..lit() };
        assert_eq!(neither.validate(), Err(SampleImageError::Size { plane: "color", len: 0, expected: 12 }));
    }

    #[test]
    fn planes_of_shares_have_a_byte_for_the_environment_for_fifteen_lamps_and_for_all_others() {
        let counts = [(0, 1), (3, 1), (4, 2), (7, 2), (8, 3), (15, 4), (16, 5), (crate::MAX_LIGHTS, 5)];
        for (lights, planes) in counts {
            assert_eq!(LightPlanes::share_planes(lights), planes, "{lights} lamps");
        }
    }
}
