//! A sample set on the device.

use depth_image::{Aabb, Camera, DepthImage, PinholeCamera, srgb8_from_linear};
use glam::{Vec2, Vec3};
use gpu::Gpu;
use wgpu::BufferUsages;

use crate::{
    CodedDepth, Pyramid, ReconstructionError,
    layout::{GpuSampleCamera, GpuVolume},
};

/// A surface on the very face of the volume must still be entered, by all cameras, whose samples of a slope are
/// steps: in parts of the volume's longest edge.
pub(crate) const VOLUME_MARGIN: f32 = 0.005;

/// Shaders name each camera; more would make them too long.
pub const MAX_SAMPLE_CAMERAS: usize = 16;

/// One complete sample set: what views are reconstructed from.
pub struct SampleSet {
    pub(crate) cameras: Vec<GpuSampleCamera>,
    pub(crate) volume: GpuVolume,
    pub(crate) pyramids: wgpu::Buffer,
    pub(crate) colors: wgpu::Buffer,
}

impl SampleSet {
    /// Builds pyramids and uploads everything. `volume` holds all geometry.
    ///
    /// # Errors
    /// Too many images, planes or cameras that do not fit, or a set beyond the device's limits.
    pub(crate) fn upload(
        gpu: &Gpu,
        images: &[DepthImage],
        volume: &Aabb,
        background_linear: Vec3,
    ) -> Result<Self, ReconstructionError> {
        check(gpu, images, volume)?;
        let mut cameras = Vec::with_capacity(images.len());
        let mut words: Vec<u32> = Vec::new();
        let mut colors: Vec<u32> = Vec::new();
        for image in images {
            let depth = CodedDepth::of(image);
            let pyramid = Pyramid::of(&depth);
            let Camera::Pinhole(camera) = &image.camera;
            let wide = pyramid.wide_words();
            let first_word = words.len() as u32;
            cameras.push(GpuSampleCamera {
                first_wide_word: first_word + pyramid.words.len() as u32,
                mask: 1 << cameras.len(),
                ..sample_camera(camera, &depth, &pyramid, first_word, colors.len() as u32)
            });
            words.extend(pyramid.words);
            words.extend(wide);
            colors.extend(&image.color_rgb9e5);
        }
        Ok(Self {
            cameras,
            volume: gpu_volume(&searched_volume(volume, images), background_linear),
            pyramids: gpu.buffer_with("depth pyramids", &words, BufferUsages::STORAGE),
            colors: gpu.buffer_with("sample colours", &colors, BufferUsages::STORAGE),
        })
    }
}

fn check(gpu: &Gpu, images: &[DepthImage], volume: &Aabb) -> Result<(), ReconstructionError> {
    if images.is_empty() || images.len() > MAX_SAMPLE_CAMERAS {
        return Err(ReconstructionError::SampleCount(images.len()));
    }
    if volume.is_empty() || !volume.size().is_finite() {
        return Err(ReconstructionError::Volume);
    }
    for (index, image) in images.iter().enumerate() {
        let Camera::Pinhole(camera) = &image.camera;
        let wrong = |reason: String| ReconstructionError::Sample { index, reason };
        camera.validate().map_err(|error| wrong(error.to_string()))?;
        image.validate().map_err(|error| wrong(error.to_string()))?;
        if camera.size_px.min_element() < 2 {
            return Err(wrong("an image of one row or column has no surface between samples".to_owned()));
        }
    }
    let words: usize = images
        .iter()
        .map(|i| Pyramid::word_count(i.size_px().to_array().map(|side| side.next_power_of_two().ilog2())))
        .sum();
    gpu.check_storage_bytes("the sample set's pyramids (bytes)", words as u64 * 8)?;
    Ok(())
}

fn sample_camera(
    camera: &PinholeCamera,
    depth: &CodedDepth,
    pyramid: &Pyramid,
    first_word: u32,
    first_texel: u32,
) -> GpuSampleCamera {
    GpuSampleCamera {
        homogeneous_pixel_from_world: camera.homogeneous_pixel_from_world().map(|row| row.to_array()),
        eye_in_world: camera.eye_in_world.to_array(),
        code_scale: depth.scale,
        cells: (camera.size_px.as_vec2() - 1.0).to_array(),
        code_offset: depth.offset,
        focal_px: camera.focal_px.min_element(),
        log2_sides: pyramid.log2_sides,
        first_word,
        first_texel,
        width_px: camera.size_px.x,
        stretch: stretch(camera),
        mask: 0,
        first_wide_word: 0,
    }
}

/// `f √(1 + slope²)` at the corner farthest off the axis: a point that moves by r moves in the image by
/// at most this times r / depth.
pub(crate) fn stretch(camera: &PinholeCamera) -> f32 {
    let corners =
        [Vec2::ZERO, camera.size_px.as_vec2()].map(|corner| ((corner - camera.principal_px) / camera.focal_px).abs());
    let slope = corners[0].max(corners[1]);
    camera.focal_px.max_element() * (1.0 + slope.length_squared()).sqrt()
}

/// The volume with room for what samples do not know: a search must still be inside where it meets a surface
/// on the volume's very face.
pub(crate) fn searched_volume(volume: &Aabb, images: &[DepthImage]) -> Aabb {
    let depth_error_m = images.iter().map(CodedDepth::greatest_error_m).fold(0.0, f32::max);
    volume.padded(volume.size().max_element() * VOLUME_MARGIN + depth_error_m)
}

fn gpu_volume(searched: &Aabb, background_linear: Vec3) -> GpuVolume {
    let [r, g, b] = background_linear.to_array().map(srgb8_from_linear);
    GpuVolume {
        min_in_world: searched.min.to_array(),
        background_srgb8: u32::from_le_bytes([r, g, b, 255]),
        max_in_world: searched.max.to_array(),
        padding: 0,
    }
}
