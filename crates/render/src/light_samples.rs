//! Samples of light on a device, for views whose surfaces come from the scene.

use bytemuck::{Pod, Zeroable};
use depth_image::{Camera, DepthImage, LightCacheQuality, PinholeCamera};
use glam::{DVec3, Vec2, Vec3};
use gpu::{Gpu, Table, TablePool, Turn};
use wgpu::{Buffer, BufferUsages, TextureFormat};

use crate::lamp_shares::GpuLampShares;
use crate::{GpuScene, RenderError, pixel_camera::PixelCamera};

/// Sample images of a set of light.
pub(crate) const MAX_CACHE_CAMERAS: u32 = 16;
/// Values of stored inverse depth; a step between two of them is the range over one fewer.
pub(crate) const DEPTH_CODES: f32 = 65_534.0;

/// The distance of a point from the plane of a texel's triangle up to which both are on one surface (`fast`, `balanced`, coverage).
pub const PLANE_FOOTPRINTS: f32 = 0.25;
/// The angle between their normals up to which they are.
pub const TURNED_DEG: f32 = 23.0;

/// Samples of light on a device.
pub struct LightCache {
    pub(crate) samples: Table,
    pub(crate) images: Vec<CachedImage>,
    /// Words of packed shares of each sample.
    pub(crate) share_words: usize,
}

/// A sample image of a [`LightCache`].
pub(crate) struct CachedImage {
    camera: PinholeCamera,
    /// What is the same for all views.
    uniform: GpuCacheCamera,
}

/// Samples of light for the views of a batch, and when they know the light of a point.
#[derive(Clone, Copy)]
pub(crate) struct CachedLight<'a> {
    pub cache: &'a LightCache,
    pub tests: LookUpTests,
}

/// The surfaces of a set, whose images omit what those before them cover.
#[derive(Clone, Copy)]
pub(crate) struct CoveredBy<'a> {
    /// The surfaces of the images, without light.
    pub surfaces: &'a LightCache,
    /// Places in the set of the images to be drawn, and which of them is the batch's first.
    pub numbers: &'a [u32],
    pub first: usize,
}

impl CoveredBy<'_> {
    /// The place in its set of an image of the batch.
    pub fn number(&self, place: usize) -> usize {
        self.numbers[self.first + place] as usize
    }
}

/// `LookUpTests` of the shader, those of one quality: when samples know the light of a point.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct LookUpTests {
    pub least_coverage: f32,
    pub plane_footprints: f32,
    pub least_cosine: f32,
    pub most_difference: f32,
}

/// `CacheCamera` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuCacheCamera {
    pub homogeneous_texel_from_offset: [[f32; 4]; 3],
    pub eye_offset: [f32; 3],
    pub footprint: f32,
    pub column_in_world: [f32; 3],
    pub first_sample: u32,
    pub row_in_world: [f32; 3],
    pub half_step_per_m: f32,
    pub corner_in_world: [f32; 3],
    pub near_m: f32,
    pub size_px: [u32; 2],
    pub padding: [u32; 2],
}

/// `Cache` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuCache {
    pub shares: GpuLampShares,
    pub tests: LookUpTests,
    pub camera_count: u32,
    pub padding: [u32; 3],
    pub cameras: [GpuCacheCamera; MAX_CACHE_CAMERAS as usize],
}

impl LookUpTests {
    /// Those of `fast`: a point is known among texels of its surface.
    pub fn surrounded() -> Self {
        Self {
            least_coverage: 0.75,
            plane_footprints: PLANE_FOOTPRINTS,
            least_cosine: TURNED_DEG.to_radians().cos(),
            most_difference: f32::MAX,
        }
    }

    /// `None` where no sample is asked.
    pub fn new(quality: LightCacheQuality) -> Option<Self> {
        let any = Self {
            least_coverage: f32::MIN_POSITIVE,
            plane_footprints: 1.0,
            least_cosine: 30_f32.to_radians().cos(),
            most_difference: f32::MAX,
        };
        let surrounded = Self::surrounded();
        match quality {
            LightCacheQuality::Draft => Some(any),
            LightCacheQuality::Fast => Some(surrounded),
            LightCacheQuality::Balanced => Some(Self { most_difference: 0.5, ..surrounded }),
            LightCacheQuality::Fine => Some(Self {
                // Four weights do not sum up to 1 to the bit.
                least_coverage: 0.999,
                plane_footprints: 0.1,
                most_difference: 0.35,
                ..surrounded
            }),
            LightCacheQuality::Exact => None,
        }
    }
}

/// Texels of the table that a sample takes.
pub(crate) fn sample_texels(share_words: usize) -> usize {
    (5 + share_words).div_ceil(4)
}

impl LightCache {
    /// Puts samples on a device, which have this many planes of shares.
    ///
    /// # Errors
    /// Names the image that has no light, or whose planes do not fit, or is no pinhole's; too many images for the device.
    pub(crate) fn upload(
        tables: &TablePool,
        images: &[DepthImage],
        share_words: usize,
        turn: Turn,
    ) -> Result<Self, RenderError> {
        if images.is_empty() || images.len() > MAX_CACHE_CAMERAS as usize {
            let reason = format!("a set of light has 1 to {MAX_CACHE_CAMERAS} images");
            return Err(RenderError::Samples { index: images.len(), reason });
        }
        let mut cached = Vec::new();
        let mut first_sample = 0_usize;
        for (index, image) in images.iter().enumerate() {
            let camera = checked(image, share_words).map_err(|reason| RenderError::Samples { index, reason })?;
            let range = image.inverse_depth_range().map_or(0.0, |(least, greatest)| greatest - least);
            let rays = PixelCamera::of(&camera.into(), Vec2::ZERO);
            let uniform = GpuCacheCamera {
                footprint: rays.footprint,
                column_in_world: rays.column_in_world,
                first_sample: first_sample as u32,
                row_in_world: rays.row_in_world,
                half_step_per_m: 0.5 * range / DEPTH_CODES,
                corner_in_world: rays.corner_in_world,
                near_m: rays.near_m,
                size_px: rays.size_px,
                ..GpuCacheCamera::zeroed()
            };
            cached.push(CachedImage { camera, uniform });
            first_sample += camera.pixel_count();
        }
        let texels = sample_texels(share_words);
        tables.gpu.check_table("samples of light", first_sample * texels)?;
        let words: Vec<[u32; 4]> = images.iter().flat_map(|image| packed(image, texels)).collect();
        let samples = tables.upload("samples of light", TextureFormat::Rgba32Uint, &words, turn)?;
        Ok(Self { samples, images: cached, share_words })
    }

    /// The cameras of the images.
    pub(crate) fn cameras(&self) -> Vec<PinholeCamera> {
        self.images.iter().map(|image| image.camera).collect()
    }

    /// The uniform of a view that consults the first `count` images.
    pub(crate) fn uniform(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        tests: LookUpTests,
        count: usize,
        view: &Camera,
    ) -> Buffer {
        let mut cameras = [GpuCacheCamera::zeroed(); MAX_CACHE_CAMERAS as usize];
        for (camera, image) in cameras.iter_mut().zip(&self.images[..count]) {
            *camera = image.seen_from(view.reference().eye_in_world);
        }
        let shares = scene.lamp_shares;
        let cache = GpuCache { shares, tests, camera_count: count as u32, padding: [0; 3], cameras };
        gpu.buffer_with("light cache", &[cache], BufferUsages::UNIFORM)
    }
}

/// The camera of an image that can be used, or the reason against it.
fn checked(image: &DepthImage, share_words: usize) -> Result<PinholeCamera, String> {
    image.validate().map_err(|error| error.to_string())?;
    let light = image.light.as_ref().ok_or("colour where light is needed")?;
    let given = light.share8.len();
    if given != share_words {
        return Err(format!("{given} planes of shares of light, the scene's lamps and lighting need {share_words}"));
    }
    let camera = image.camera.pinhole().ok_or_else(|| format!("a {}, must be a pinhole", image.camera.model_name()))?;
    Ok(*camera)
}

/// The words of all samples of an image, in whole texels.
fn packed(image: &DepthImage, texels: usize) -> Vec<[u32; 4]> {
    let (Some(light), Some(normals)) = (&image.light, &image.normal_oct16) else { return Vec::new() };
    let mut words = Vec::with_capacity(texels * normals.len());
    for (place, &normal) in normals.iter().enumerate() {
        let inverse_depth = image.inverse_depth_per_m[place].to_bits();
        words.push([inverse_depth, light.triangle_normal_oct16[place], normal, light.lamps_rgb9e5[place]]);
        let [a, b, c, d, e] = std::array::from_fn(|word| light.share8.get(word).map_or(0, |plane| plane[place]));
        words.push([light.environment_rgb9e5[place], a, b, c]);
        if texels > 2 {
            words.push([d, e, 0, 0]);
        }
    }
    words
}

impl CachedImage {
    /// The numbers of the image's camera for a view from `eye_in_world`. In double precision: both may be far from the origin.
    fn seen_from(&self, eye_in_world: Vec3) -> GpuCacheCamera {
        let eye_offset: DVec3 = self.camera.eye_in_world.as_dvec3() - eye_in_world.as_dvec3();
        let homogeneous_texel_from_offset = self.camera.homogeneous_pixel_from_world().map(|row| {
            let axis = row.truncate();
            axis.extend(-axis.as_dvec3().dot(eye_offset) as f32).to_array()
        });
        let eye_offset = eye_offset.as_vec3().to_array();
        GpuCacheCamera { homogeneous_texel_from_offset, eye_offset, ..self.uniform }
    }
}
