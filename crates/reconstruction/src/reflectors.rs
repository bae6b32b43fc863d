//! The light that the samples of a set reflect towards a viewer, on the device.

use depth_image::{
    DepthImage, Highlight, Illumination, LayeredDepthImage, MAX_MIRROR_CELLS, ROUGHEST_MIRROR, SpecularPlanes,
};
use gpu::{Binding, GpuError, Table, TablePool, Turn, highlight_name, illumination_bytes, light_slots};
use minijinja::{Value, context};
use wgpu::{BufferUsages, TextureFormat};

use crate::{error::ReconstructionError, set_description::SetDescription, view_work::SetVariant};

/// A normal and a reflector stand before the words of visibility.
const WORDS_BEFORE_VISIBILITY: usize = 2;
const ALL_VISIBLE: u32 = u32::MAX;
/// Lists of rays: one for each mirror cell, and one for a base.
const MAX_RAY_LISTS: usize = MAX_MIRROR_CELLS + 1;

/// The reflectors of a set in which anything has a highlight.
pub(crate) struct Reflectors {
    pub highlight: Highlight,
    pub lights: usize,
    pub visibility_words: usize,
    /// Some sample is smooth enough to mirror the scene.
    pub has_mirrors: bool,
    samples: Table,
    pub illumination: wgpu::Buffer,
}

impl Reflectors {
    /// `None` where no highlights are asked for or nothing reflects. The samples are in the order of `places` in their images, image
    /// after image, or as they are.
    pub fn upload(
        tables: &TablePool,
        planes: &[ReflectingPlanes<'_>],
        places: Option<&[u32]>,
        set: &SetDescription<'_>,
        turn: Turn,
    ) -> Result<Option<Self>, ReconstructionError> {
        check(planes, set.illumination)?;
        let Some(highlight) = set.highlight.filter(|_| planes.iter().any(|image| image.has_sample(|word| word != 0)))
        else {
            return Ok(None);
        };
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
            has_mirrors: planes.iter().any(|image| image.has_sample(is_mirror)),
            samples: tables.upload("reflectors", TextureFormat::Rgba32Uint, &words, turn)?,
            illumination: gpu.buffer_with("illumination", &bytes, BufferUsages::UNIFORM),
        }))
    }

    /// What samples reflect, and of which light.
    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::texture("samples", &self.samples), Binding::buffer("illumination", &self.illumination)]
    }
}

/// Texels that a sample's words take.
const fn sample_texels(visibility_words: usize) -> usize {
    (WORDS_BEFORE_VISIBILITY + visibility_words).div_ceil(4)
}

/// How a surface's lobe is lit, beside the rays off mirrors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LobeLight {
    /// What smooth surfaces mirror is gathered in a light field.
    GatheredMirrors,
    /// What no ray off a mirror brings is gathered.
    GatheredRest,
    /// All is gathered.
    Gathered,
    /// Rays are sent for what no ray off a mirror brings.
    SentRest,
    /// Rays are sent for all.
    Sent,
}

impl LobeLight {
    pub const ALL: [Self; 5] = [Self::GatheredMirrors, Self::GatheredRest, Self::Gathered, Self::SentRest, Self::Sent];

    /// For the surfaces that pixels show. `followed` of `mirrors` are followed; rough surfaces may be glossy.
    pub fn of_pixels(followed: u32, mirrors: u32, glossy: bool, has_light_field: bool) -> Option<Self> {
        match (followed < mirrors && followed == 0, glossy, has_light_field) {
            (true, true, _) => Some(Self::Gathered),
            (true, false, _) => Some(Self::GatheredMirrors),
            (false, true, true) => Some(if mirrors > 0 { Self::GatheredRest } else { Self::Gathered }),
            (false, true, false) => Some(Self::sent(mirrors > 0)),
            (false, false, _) => None,
        }
    }

    /// By rays, beside those off mirrors where these are followed.
    pub fn sent(beside_mirrors: bool) -> Self {
        if beside_mirrors { Self::SentRest } else { Self::Sent }
    }

    pub fn is_sent(self) -> bool {
        matches!(self, Self::SentRest | Self::Sent)
    }

    /// The part of a mirror's lobe, as a WGSL expression.
    pub fn share(self) -> &'static str {
        match self {
            Self::GatheredMirrors => "mirror_share(mirror.reflector.roughness)",
            Self::GatheredRest | Self::SentRest => "1.0 - mirror_share(mirror.reflector.roughness)",
            Self::Gathered | Self::Sent => "1.0",
        }
    }
}

/// The switches of shaders that show what samples reflect: `highlight.wgsl`, `gathered.wgsl`, and those that list the rays off
/// mirrors and the rough surfaces that send rays.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Reflection {
    /// The formula of highlights, where samples have any.
    pub highlight: Option<Highlight>,
    pub lights: usize,
    /// The words that say which lights a sample sees; 0 where all samples see all.
    pub visibility_words: usize,
    /// The environment is a map.
    pub environment_map: bool,
    /// Mirrors list the rays off them; the number of lists.
    pub mirror_cells: Option<usize>,
    /// The light of lobes, beside the rays off mirrors.
    pub lobe: Option<LobeLight>,
}

impl Reflection {
    /// Mirrors and lobes are those of GGX surfaces; Blinn-Phong surfaces mirror lamps only.
    pub fn of(
        reflectors: Option<&Reflectors>,
        mirror_cells: Option<usize>,
        lobe: Option<LobeLight>,
        has_map: bool,
    ) -> Self {
        let Some(Reflectors { highlight, lights, visibility_words, .. }) = reflectors else { return Self::default() };
        let without_mirrors = Self {
            highlight: Some(*highlight),
            lights: *lights,
            visibility_words: *visibility_words,
            ..Self::default()
        };
        match highlight {
            Highlight::BlinnPhong => without_mirrors,
            Highlight::Ggx => Self { environment_map: has_map, mirror_cells, lobe, ..without_mirrors },
        }
    }

    pub fn context(self, set: SetVariant) -> Value {
        context! {
            reflects => self.highlight.is_some(),
            highlight => highlight_name(self.highlight.unwrap_or(Highlight::Ggx)),
            light_slots => light_slots(self.lights),
            visibility_words => self.visibility_words,
            sample_texels => sample_texels(self.visibility_words),
            environment_map => self.environment_map,
            mirrors => self.mirror_cells.is_some() || self.lobe.is_some(),
            spawns => self.mirror_cells.is_some(),
            mirror_cells => self.mirror_cells.unwrap_or(0),
            gathers => self.lobe.is_some_and(|lobe| !lobe.is_sent()),
            lists_glossy => self.lobe.is_some_and(LobeLight::is_sent),
            lobe_share => self.lobe.map_or("0.0", LobeLight::share),
            glossy => self.lobe.is_some_and(|lobe| lobe != LobeLight::GatheredMirrors),
            ..set.context()
        }
    }

    /// The variants that stand for all, without lobes.
    pub fn all() -> Vec<Self> {
        let mut all = [false, true].map(|environment_map| Self { environment_map, ..Self::default() }).to_vec();
        for (lights, visibility_words) in [(0, 0), (3, 0), (3, 1), (255, 64)] {
            let plain = Self { lights, visibility_words, ..Self::default() };
            all.push(Self { highlight: Some(Highlight::BlinnPhong), ..plain });
            for environment_map in [false, true] {
                let ggx = Self { highlight: Some(Highlight::Ggx), environment_map, ..plain };
                all.extend([None, Some(1), Some(MAX_RAY_LISTS)].map(|mirror_cells| Self { mirror_cells, ..ggx }));
            }
        }
        all
    }

    /// The variant itself and, where surfaces may have lobes, one for each way to light them.
    pub fn with_lobes(self, lobes: &[LobeLight]) -> Vec<Self> {
        let lobes = if self.highlight == Some(Highlight::Ggx) { lobes } else { &[] };
        std::iter::once(None).chain(lobes.iter().copied().map(Some)).map(|lobe| Self { lobe, ..self }).collect()
    }
}

/// The planes of an image from which compositors compute highlights.
pub(crate) struct ReflectingPlanes<'i> {
    samples: usize,
    normal_oct16: Option<&'i [u32]>,
    specular: Option<&'i SpecularPlanes>,
}

impl<'i> From<&'i DepthImage> for ReflectingPlanes<'i> {
    fn from(image: &'i DepthImage) -> Self {
        let normal_oct16 = image.normal_oct16.as_deref();
        Self { samples: image.color_rgb9e5.len(), normal_oct16, specular: image.specular.as_ref() }
    }
}

impl<'i> From<&'i LayeredDepthImage> for ReflectingPlanes<'i> {
    fn from(image: &'i LayeredDepthImage) -> Self {
        let normal_oct16 = image.normal_oct16.as_deref();
        Self { samples: image.sample_count(), normal_oct16, specular: image.specular.as_ref() }
    }
}

impl ReflectingPlanes<'_> {
    fn has_sample(&self, is_meant: impl Fn(u32) -> bool) -> bool {
        self.specular.is_some_and(|planes| planes.reflectance_srgb8_roughness8.iter().any(|&word| is_meant(word)))
    }
}

fn is_mirror(reflectance_srgb8_roughness8: u32) -> bool {
    let is_smooth = ((reflectance_srgb8_roughness8 >> 24) as f32) < ROUGHEST_MIRROR * 255.0;
    reflectance_srgb8_roughness8 != 0 && is_smooth
}

fn check(images: &[ReflectingPlanes<'_>], illumination: &Illumination) -> Result<(), ReconstructionError> {
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
fn ordered(words: &[u32], images: &[ReflectingPlanes<'_>], places: &[u32]) -> Vec<u32> {
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
fn sample_words(images: &[ReflectingPlanes<'_>], visibility_words: usize) -> Vec<u32> {
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
