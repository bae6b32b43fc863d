//! The sizes of sample sets in memory, before they are allocated and afterwards.

use depth_image::{Camera, DepthImage, Illumination, SpecularPlanes};

/// Inverse depth, colour, a normal, a surface, reflectance and a mark, for one texel.
const MOST_TEXEL_BYTES: usize = 4 + 4 + 4 + 8 + 4 + 1;
/// The inverse depth of a texel's corner; an image has a column and a row of them more than of texels.
const CORNER_BYTES: usize = 4;
/// The least and the greatest depth of all levels of a pyramid, for one texel: 8 · 4/3.
const PYRAMID_TEXEL_BYTES: usize = 11;

/// The most bytes of sample images, unpacked, if an image has every plane.
#[must_use]
pub fn most_image_bytes(illumination: &Illumination, cameras: &[Camera]) -> usize {
    let visibility_bytes = 4 * SpecularPlanes::visibility_planes(illumination.lights.len());
    let bytes = |camera: &Camera| {
        let corners = (camera.size_px().x as usize + 1) * (camera.size_px().y as usize + 1);
        camera.pixel_count() * (MOST_TEXEL_BYTES + visibility_bytes) + corners * CORNER_BYTES
    };
    cameras.iter().map(bytes).sum()
}

/// The most bytes of a set on a device.
#[must_use]
pub fn most_set_bytes(illumination: &Illumination, cameras: &[Camera]) -> usize {
    let texels: usize = cameras.iter().map(Camera::pixel_count).sum();
    most_image_bytes(illumination, cameras) + texels * PYRAMID_TEXEL_BYTES
}

/// Bytes of images on a device, by the planes that they have.
#[must_use]
pub fn set_bytes(images: &[DepthImage]) -> usize {
    images.iter().map(image_bytes).sum()
}

fn image_bytes(image: &DepthImage) -> usize {
    let specular =
        |specular: &SpecularPlanes| specular.reflectance_srgb8_roughness8.len() * (1 + specular.visibility8.len());
    let texels = image.inverse_depth_per_m.len();
    let words = texels
        + image.color_rgb9e5.len()
        + image.normal_oct16.as_ref().map_or(0, Vec::len)
        + image.surface_id.as_ref().map_or(0, |ids| 2 * ids.len())
        + image.specular.as_ref().map_or(0, specular)
        + image.corner_inverse_depth_per_m.as_ref().map_or(0, Vec::len);
    4 * words + image.passed.as_ref().map_or(0, Vec::len) + PYRAMID_TEXEL_BYTES * texels
}

#[cfg(test)]
mod tests {
    use depth_image::PinholeCamera;
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::measure::tests::request;

    #[test]
    fn a_set_is_never_larger_than_its_cameras_told() {
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(16));
        let illumination = request(1).workload.illumination;
        let lights = illumination.lights.len();
        let plain = DepthImage {
            camera: Camera::Pinhole(camera),
            inverse_depth_per_m: vec![0.5; 256],
            color_rgb9e5: vec![0; 256],
            normal_oct16: None,
            surface_id: None,
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
        };
        assert_eq!(set_bytes(std::slice::from_ref(&plain)), 256 * (4 + 4 + 11));
        let specular = SpecularPlanes {
            reflectance_srgb8_roughness8: vec![0; 256],
            visibility8: vec![vec![0; 256]; SpecularPlanes::visibility_planes(lights)],
        };
        let full = DepthImage {
            normal_oct16: Some(vec![0; 256]),
            surface_id: Some(vec![depth_image::SurfaceId { instance: 0, primitive: 0 }; 256]),
            specular: Some(specular),
            passed: Some(vec![false; 256]),
            corner_inverse_depth_per_m: Some(vec![0.0; 17 * 17]),
            ..plain
        };
        full.validate().unwrap();
        assert_eq!(set_bytes(&[full.clone(), full]), most_set_bytes(&illumination, &[Camera::Pinhole(camera); 2]));
    }
}
