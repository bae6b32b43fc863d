//! The light that the samples of a set reflect towards a viewer, on the device.

use depth_image::{DepthImage, Highlight, Illumination, SpecularPlanes};
use gpu::{GpuError, Table, TablePool, Turn, illumination_bytes};
use wgpu::{BufferUsages, TextureFormat};

use crate::error::ReconstructionError;

/// A normal and a reflector stand before the words of visibility.
const WORDS_BEFORE_VISIBILITY: usize = 2;
const ALL_VISIBLE: u32 = u32::MAX;

/// The reflectors of a set in which anything has a highlight.
pub(crate) struct Reflectors {
    pub highlight: Highlight,
    pub lights: usize,
    pub visibility_words: usize,
    pub samples: Table,
    pub illumination: wgpu::Buffer,
}

impl Reflectors {
    /// `None` where no highlights are asked for or nothing reflects.
    pub fn upload(
        tables: &TablePool,
        images: &[DepthImage],
        illumination: &Illumination,
        highlight: Option<Highlight>,
        turn: Turn,
    ) -> Result<Option<Self>, ReconstructionError> {
        check(images, illumination)?;
        let Some(highlight) = highlight.filter(|_| images.iter().any(reflects)) else { return Ok(None) };
        let (gpu, bytes) = (&tables.gpu, illumination_bytes(illumination));
        let limit = gpu.device.limits().max_uniform_buffer_binding_size;
        GpuError::check_limit("the scene's lights (bytes)", bytes.len() as u64, limit)?;
        let visibility_words = visibility_words(images);
        Ok(Some(Self {
            highlight,
            lights: illumination.lights.len(),
            visibility_words,
            samples: tables.upload(
                "reflectors",
                TextureFormat::Rgba32Uint,
                &sample_words(images, visibility_words),
                turn,
            )?,
            illumination: gpu.buffer_with("illumination", &bytes, BufferUsages::UNIFORM),
        }))
    }
}

/// Texels that a sample's words take.
pub(crate) const fn sample_texels(visibility_words: usize) -> usize {
    (WORDS_BEFORE_VISIBILITY + visibility_words).div_ceil(4)
}

fn reflects(image: &DepthImage) -> bool {
    image.specular.as_ref().is_some_and(|planes| planes.reflectance_srgb8_roughness8.iter().any(|&word| word != 0))
}

fn check(images: &[DepthImage], illumination: &Illumination) -> Result<(), ReconstructionError> {
    let expected = SpecularPlanes::visibility_planes(illumination.lights.len());
    for (index, image) in images.iter().enumerate() {
        let wrong = |reason: String| Err(ReconstructionError::Sample { index, reason });
        let Some(planes) = &image.specular else { continue };
        if image.normal_oct16.is_none() {
            return wrong("a highlight needs normals".to_owned());
        }
        let found = planes.visibility8.len();
        if found != 0 && found != expected {
            return wrong(format!("{found} planes of visibility, the lights need {expected} or none"));
        }
    }
    Ok(())
}

fn visibility_words(images: &[DepthImage]) -> usize {
    images.iter().filter_map(|image| image.specular.as_ref()).map(|planes| planes.visibility8.len()).max().unwrap_or(0)
}

/// Sample after sample, image after image; those of images without highlights reflect nothing.
fn sample_words(images: &[DepthImage], visibility_words: usize) -> Vec<u32> {
    let stride = 4 * sample_texels(visibility_words);
    let samples = |image: &DepthImage| image.color_rgb9e5.len();
    let mut words = Vec::with_capacity(images.iter().map(samples).sum::<usize>() * stride);
    for image in images {
        let (Some(planes), Some(normals)) = (&image.specular, &image.normal_oct16) else {
            words.resize(words.len() + samples(image) * stride, 0);
            continue;
        };
        for (index, (&normal, &reflector)) in normals.iter().zip(&planes.reflectance_srgb8_roughness8).enumerate() {
            let end = words.len() + stride;
            words.extend([normal, reflector]);
            let visible = |word: usize| planes.visibility8.get(word).map_or(ALL_VISIBLE, |plane| plane[index]);
            words.extend((0..visibility_words).map(visible));
            words.resize(end, 0);
        }
    }
    words
}
