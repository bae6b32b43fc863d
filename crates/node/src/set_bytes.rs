//! The sizes of sample sets in memory, before they are allocated and afterwards.

use depth_image::{CubeGrid, DepthImage, Illumination, LightPlanes, SampleCamera, SampleImages, SpecularPlanes};
use glam::UVec3;

/// Inverse depth, colour, a normal, a surface, reflectance and a mark, for one texel.
const MOST_TEXEL_BYTES: usize = 4 + 4 + 4 + 8 + 4 + 1;
/// Inverse depth, a normal of a triangle, a normal, a surface, lamps, environment and a mark, for one texel of an image with
/// light in place of colour.
const MOST_LIGHT_TEXEL_BYTES: usize = 4 + 4 + 4 + 8 + 4 + 4 + 1;
/// Words of a sample of light on a device beside its shares, in texels of a table.
const LIGHT_WORDS: usize = 5;
const TABLE_TEXEL_BYTES: usize = 16;
/// The inverse depth of a texel's corner; an image has a column and a row of them more than of texels.
const CORNER_BYTES: usize = 4;
/// The least and the greatest depth of all levels of a pyramid, for one texel: 8 · 4/3.
const PYRAMID_TEXEL_BYTES: usize = 11;
/// Depth, a normal of a triangle, colour, a normal and reflectance, for one sample of a layered image.
const MOST_SAMPLE_BYTES: usize = 4 + 2 + 4 + 4 + 4;
/// A sample's words, and its entry among those of its voxel, on a device.
const CUBE_SAMPLE_BYTES: usize = 16 + 16;
/// The side of a cell of a cube, in spacings. A table has one word for each cell.
const CELL_SIDE: u32 = 8;
/// Depth and radiance of a sample of a light field.
const LIGHT_SAMPLE_BYTES: usize = 4 + 4;
/// The number of a line's first sample.
const LINE_BYTES: usize = 4;
/// Samples of a line that are reserved for before they are known, on average over a cube: few scenes have more, and what a set
/// takes is counted when it is there.
const EXPECTED_LAYERS: usize = 2;

/// The most bytes of sample images, unpacked, if an image has every plane. Those of layered images are expected.
#[must_use]
pub fn most_image_bytes(illumination: &Illumination, cameras: &[SampleCamera]) -> usize {
    let visibility_bytes = 4 * SpecularPlanes::visibility_planes(illumination.lights.len());
    let share_bytes = 4 * LightPlanes::share_planes(illumination.lights.len());
    let bytes = cameras.iter().map(|camera| match camera {
        SampleCamera::Depth(camera) => {
            let corners = (camera.size_px().x as usize + 1) * (camera.size_px().y as usize + 1);
            let with_color = camera.pixel_count() * (MOST_TEXEL_BYTES + visibility_bytes) + corners * CORNER_BYTES;
            let with_light = camera.pixel_count() * (MOST_LIGHT_TEXEL_BYTES + share_bytes);
            with_color.max(with_light)
        }
        SampleCamera::Layered(camera) => {
            camera.pixel_count() * (LINE_BYTES + EXPECTED_LAYERS * (MOST_SAMPLE_BYTES + visibility_bytes))
        }
        SampleCamera::LightField(camera) => camera.line_count() * (LINE_BYTES + EXPECTED_LAYERS * LIGHT_SAMPLE_BYTES),
    });
    bytes.sum()
}

/// The most bytes of a set on a device; of a cube, as [`most_image_bytes`] expects them.
#[must_use]
pub fn most_set_bytes(illumination: &Illumination, cameras: &[SampleCamera]) -> usize {
    let search_bytes = cameras.iter().map(|camera| match camera {
        SampleCamera::Depth(camera) => camera.pixel_count() * PYRAMID_TEXEL_BYTES,
        SampleCamera::Layered(camera) => camera.pixel_count() * EXPECTED_LAYERS * CUBE_SAMPLE_BYTES,
        SampleCamera::LightField(camera) => camera.line_count() * LINE_BYTES,
    });
    let parallel: Vec<_> = cameras.iter().filter_map(SampleCamera::layered).copied().collect();
    let cells = CubeGrid::of_cameras(&parallel).map_or(0, |grid| cell_bytes(grid.size));
    most_image_bytes(illumination, cameras) + search_bytes.sum::<usize>() + cells
}

/// Bytes of images on a device, by the planes that they have.
#[must_use]
pub fn set_bytes(images: &SampleImages) -> usize {
    match images {
        SampleImages::Depth(images) => depth_images_bytes(images),
        SampleImages::Cube(cube) => {
            let images = cube.images.iter().map(|image| {
                let specular_words = image.specular.as_ref().map_or(0, specular_words);
                let words = image.normal_oct16.as_ref().map_or(0, Vec::len) + specular_words;
                image.sample_count() * CUBE_SAMPLE_BYTES + 4 * words
            });
            // The first sample of a line, and its end.
            let light = cube
                .light_field
                .as_ref()
                .map_or(0, |field| 2 * field.first.len() * LINE_BYTES + field.sample_count() * LIGHT_SAMPLE_BYTES);
            cell_bytes(cube.grid.size) + images.sum::<usize>() + light
        }
    }
}

/// Bytes of the table of a cube's cells.
fn cell_bytes(size: UVec3) -> usize {
    let [x, y, z] = size.to_array().map(|side| side.div_ceil(CELL_SIDE) as usize);
    4 * x * y * z
}

/// Bytes of depth images on a device, by the planes that they have.
#[must_use]
pub fn depth_images_bytes(images: &[DepthImage]) -> usize {
    images.iter().map(image_bytes).sum()
}

fn specular_words(specular: &SpecularPlanes) -> usize {
    specular.reflectance_srgb8_roughness8.len() * (1 + specular.visibility8.len())
}

fn image_bytes(image: &DepthImage) -> usize {
    let texels = image.inverse_depth_per_m.len();
    if let Some(light) = &image.light {
        // Whole texels of a table, and no pyramids.
        return texels * TABLE_TEXEL_BYTES * (LIGHT_WORDS + light.share8.len()).div_ceil(4);
    }
    let words = texels
        + image.color_rgb9e5.len()
        + image.normal_oct16.as_ref().map_or(0, Vec::len)
        + image.surface_id.as_ref().map_or(0, |ids| 2 * ids.len())
        + image.specular.as_ref().map_or(0, specular_words)
        + image.corner_inverse_depth_per_m.as_ref().map_or(0, Vec::len);
    4 * words + image.passed.as_ref().map_or(0, Vec::len) + PYRAMID_TEXEL_BYTES * texels
}

#[cfg(test)]
mod tests {
    use depth_image::{Aabb, CubeImages, LayeredDepthImage, PinholeCamera};
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::measure::tests::request;

    #[test]
    fn a_cube_of_two_samples_a_line_has_the_expected_bytes() {
        let grid = CubeGrid::around(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, 32).unwrap();
        let image = |axis| {
            let camera = grid.camera(axis);
            let samples = 2 * camera.pixel_count();
            LayeredDepthImage {
                first: (0..=camera.pixel_count() as u32).map(|line| 2 * line).collect(),
                planar_depth_m: vec![0.5; samples],
                plane_normal_oct8: vec![0; samples],
                color_rgb9e5: vec![0; samples],
                normal_oct16: None,
                specular: None,
                truncated: false,
                camera,
            }
        };
        let cameras = [0, 1, 2].map(|axis| grid.camera(axis).into());
        let images = [image(0), image(1), image(2)];
        let bytes = set_bytes(&SampleImages::Cube(Box::new(CubeImages { grid, images, light_field: None })));
        assert_eq!(bytes, 3 * 2 * 32 * 32 * 32 + 4 * 4 * 4 * 4);
        let most = most_set_bytes(&request(1).workload.illumination, &cameras);
        assert!(most > bytes && most < 3 * bytes, "{bytes} of {most}");
    }

    #[test]
    fn a_set_is_never_larger_than_its_cameras_told() {
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(16));
        let illumination = request(1).workload.illumination;
        let lights = illumination.lights.len();
        let plain = DepthImage {
            camera: camera.into(),
            inverse_depth_per_m: vec![0.5; 256],
            color_rgb9e5: vec![0; 256],
            normal_oct16: None,
            surface_id: None,
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
            light: None,
        };
        assert_eq!(set_bytes(&SampleImages::Depth(vec![plain.clone()])), 256 * (4 + 4 + 11));
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
            ..plain.clone()
        };
        full.validate().unwrap();
        let images = SampleImages::Depth(vec![full.clone(), full]);
        assert_eq!(set_bytes(&images), most_set_bytes(&illumination, &[camera.into(); 2]));
        let shares = LightPlanes::share_planes(lights);
        let lit = DepthImage {
            color_rgb9e5: Vec::new(),
            normal_oct16: Some(vec![0; 256]),
            surface_id: Some(vec![depth_image::SurfaceId { instance: 0, primitive: 0 }; 256]),
            passed: Some(vec![false; 256]),
            light: Some(LightPlanes {
                triangle_normal_oct16: vec![0; 256],
                lamps_rgb9e5: vec![0; 256],
                environment_rgb9e5: vec![0; 256],
                share8: vec![vec![0; 256]; shares],
            }),
            ..plain
        };
        lit.validate().unwrap();
        let lit_bytes = set_bytes(&SampleImages::Depth(vec![lit]));
        assert_eq!(lit_bytes, 256 * TABLE_TEXEL_BYTES * (LIGHT_WORDS + shares).div_ceil(4));
        assert!(lit_bytes <= most_set_bytes(&illumination, &[camera.into()]));
    }
}
