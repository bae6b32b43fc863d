//! The light that the samples of a set reflect towards a viewer, on the device.

use depth_image::{DepthImage, Highlight, Illumination, LayeredDepthImage, ROUGHEST_MIRROR, SpecularPlanes};
use gpu::{GpuError, Table, TablePool, Turn, illumination_bytes};
use wgpu::{BufferUsages, TextureFormat};

use crate::{error::ReconstructionError, set_description::SetDescription};

/// A normal and a reflector stand before the words of visibility.
const WORDS_BEFORE_VISIBILITY: usize = 2;
const ALL_VISIBLE: u32 = u32::MAX;

/// The reflectors of a set in which anything has a highlight.
pub(crate) struct Reflectors {
    pub highlight: Highlight,
    pub lights: usize,
    pub visibility_words: usize,
    /// Some sample is smooth enough to mirror the scene.
    pub has_mirrors: bool,
    pub samples: Table,
    pub illumination: wgpu::Buffer,
}

impl Reflectors {
    /// `None` where no highlights are asked for or nothing reflects.
    pub fn upload(
        tables: &TablePool,
        images: &[DepthImage],
        set: &SetDescription<'_>,
        turn: Turn,
    ) -> Result<Option<Self>, ReconstructionError> {
        let planes: Vec<Planes<'_>> = images.iter().map(Planes::of_image).collect();
        Self::of_planes(tables, &planes, None, set, turn)
    }

    /// The samples are in the order of `places` in their images, image after image, or as they are.
    fn of_planes(
        tables: &TablePool,
        planes: &[Planes<'_>],
        places: Option<&[u32]>,
        set: &SetDescription<'_>,
        turn: Turn,
    ) -> Result<Option<Self>, ReconstructionError> {
        check(planes, set.illumination)?;
        let Some(highlight) = set.highlight.filter(|_| planes.iter().any(Planes::reflects)) else { return Ok(None) };
        let gpu = &tables.gpu;
        let bytes = illumination_bytes(set.illumination);
        let limit = gpu.device.limits().max_uniform_buffer_binding_size;
        GpuError::check_limit("the scene's lights (bytes)", bytes.len() as u64, limit)?;
        let visible = planes.iter().filter_map(|image| image.specular).map(|planes| planes.visibility8.len());
        let visibility_words = visible.max().unwrap_or(0);
        let words = sample_words(planes, visibility_words);
        let words = if let Some(places) = places { ordered(&words, planes, places) } else { words };
        Ok(Some(Self {
            highlight,
            lights: set.illumination.lights.len(),
            visibility_words,
            has_mirrors: planes.iter().any(Planes::has_mirrors),
            samples: tables.upload("reflectors", TextureFormat::Rgba32Uint, &words, turn)?,
            illumination: gpu.buffer_with("illumination", &bytes, BufferUsages::UNIFORM),
        }))
    }

    /// As [`Reflectors::upload`], of a layered cube: its samples are in the order of `places` in their images, image after image.
    pub fn of_cube(
        tables: &TablePool,
        images: &[LayeredDepthImage; 3],
        places: &[u32],
        set: &SetDescription<'_>,
        turn: Turn,
    ) -> Result<Option<Self>, ReconstructionError> {
        let planes = images.each_ref().map(Planes::of_layers);
        Self::of_planes(tables, &planes, Some(places), set, turn)
    }
}

/// Texels that a sample's words take.
pub(crate) const fn sample_texels(visibility_words: usize) -> usize {
    (WORDS_BEFORE_VISIBILITY + visibility_words).div_ceil(4)
}

/// The planes of an image from which compositors compute highlights.
struct Planes<'i> {
    samples: usize,
    normal_oct16: Option<&'i [u32]>,
    specular: Option<&'i SpecularPlanes>,
}

impl<'i> Planes<'i> {
    fn of_image(image: &'i DepthImage) -> Self {
        let normal_oct16 = image.normal_oct16.as_deref();
        let specular = image.specular.as_ref();
        Self { samples: image.color_rgb9e5.len(), normal_oct16, specular }
    }

    fn of_layers(image: &'i LayeredDepthImage) -> Self {
        let normal_oct16 = image.normal_oct16.as_deref();
        let specular = image.specular.as_ref();
        Self { samples: image.sample_count(), normal_oct16, specular }
    }

    fn reflects(&self) -> bool {
        self.has_sample(|word| word != 0)
    }

    fn has_mirrors(&self) -> bool {
        self.has_sample(|word| word != 0 && ((word >> 24) as f32) < ROUGHEST_MIRROR * 255.0)
    }

    fn has_sample(&self, is_meant: impl Fn(u32) -> bool) -> bool {
        self.specular.is_some_and(|planes| planes.reflectance_srgb8_roughness8.iter().any(|&word| is_meant(word)))
    }
}

fn check(images: &[Planes<'_>], illumination: &Illumination) -> Result<(), ReconstructionError> {
    let expected = SpecularPlanes::visibility_planes(illumination.lights.len());
    for (index, image) in images.iter().enumerate() {
        let Some(planes) = image.specular else { continue };
        if image.normal_oct16.is_none() {
            return Err(ReconstructionError::sample(index, "a highlight needs normals"));
        }
        let found = planes.visibility8.len();
        if found != 0 && found != expected {
            let reason = format!("{found} planes of visibility, the lights need {expected} or none");
            return Err(ReconstructionError::sample(index, reason));
        }
    }
    Ok(())
}

/// The words of samples, image after image, in the order of `places` in their images.
fn ordered(words: &[u32], images: &[Planes<'_>], places: &[u32]) -> Vec<u32> {
    let stride = words.len() / places.len().max(1);
    let mut places = places.iter();
    let mut ordered = Vec::with_capacity(words.len());
    let mut first = 0;
    for image in images {
        for &place in places.by_ref().take(image.samples) {
            ordered.extend_from_slice(&words[(first + place as usize) * stride..][..stride]);
        }
        first += image.samples;
    }
    ordered
}

/// Sample after sample, image after image; those of images without highlights reflect nothing.
fn sample_words(images: &[Planes<'_>], visibility_words: usize) -> Vec<u32> {
    let stride = 4 * sample_texels(visibility_words);
    let mut words = Vec::with_capacity(images.iter().map(|image| image.samples).sum::<usize>() * stride);
    for image in images {
        let (Some(planes), Some(normals)) = (image.specular, image.normal_oct16) else {
            words.resize(words.len() + image.samples * stride, 0);
            continue;
        };
        for (index, (&normal, &reflector)) in normals.iter().zip(&planes.reflectance_srgb8_roughness8).enumerate() {
            let end = words.len() + stride;
            words.extend([normal, reflector]);
            let visibility = (0..visibility_words).map(|word| planes.visibility8.get(word));
            words.extend(visibility.map(|plane| plane.map_or(ALL_VISIBLE, |plane| plane[index])));
            words.resize(end, 0);
        }
    }
    words
}
