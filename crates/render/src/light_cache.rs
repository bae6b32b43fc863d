//! Light of samples on a device, and its look-up at the surfaces of views.

use bytemuck::{Pod, Zeroable};
use depth_image::{
    Antialias, Camera, DepthImage, Illumination, LightCacheQuality, LightPlanes, MAX_LAMP_SHARES, PinholeCamera,
    ProvenanceKind,
};
use glam::{DVec3, Vec3};
use gpu::{
    Binding, DispatchSize, Gpu, GpuEnvironment, ResourceTraits, ShaderVariant, Table, TablePool, Turn, WorkKind,
    light_slots, switches,
};
use minijinja::{Value, context, value::merge_maps};
use wgpu::{Buffer, BufferUsages, TextureFormat};

use crate::batch::{Batch, Recording};
use crate::finish::Planes;
use crate::pixel_camera::CAMERA_TRAITS;
use crate::pixel_list::PixelList;
use crate::{GpuScene, RenderError, sums::SumPlanes, surfaces::Surfaces};

/// Sample images of a set of light.
pub(crate) const MAX_CACHE_CAMERAS: u32 = 16;
/// Values of stored inverse depth; a step between two of them is the range over one fewer.
pub(crate) const DEPTH_CODES: f32 = 65_534.0;

/// Codes of [`ProvenanceKind`].
pub(crate) const PROVENANCE_EMPTY: u32 = ProvenanceKind::Empty as u32;
pub(crate) const PROVENANCE_HIT: u32 = ProvenanceKind::Hit as u32;
pub(crate) const PROVENANCE_LIT_HERE: u32 = ProvenanceKind::LitHere as u32;

/// Samples of light on a device.
pub struct LightCache {
    samples: Table,
    images: Vec<CachedImage>,
    /// Words of packed shares of each sample.
    share_words: usize,
}

/// A sample image of a [`LightCache`].
struct CachedImage {
    camera: PinholeCamera,
    first_sample: u32,
    half_step_per_m: f32,
}

/// Samples of light for the views of a batch, and when they know the light of a point.
#[derive(Clone, Copy)]
pub(crate) struct CachedLight<'a> {
    pub cache: &'a LightCache,
    pub tests: LookUpTests,
}

/// The tests of one quality: when samples know the light of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LookUpTests {
    pub least_coverage: f32,
    pub plane_footprints: f32,
    pub least_cosine: f32,
    pub most_difference: f32,
}

/// `LampShares` of `lamp_shares.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLampShares {
    pub lamps: [[u32; 4]; 4],
    pub lamp_count: u32,
    pub padding: [u32; 3],
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
    pub least_coverage: f32,
    pub plane_footprints: f32,
    pub least_cosine: f32,
    pub most_difference: f32,
    pub cameras: [GpuCacheCamera; MAX_CACHE_CAMERAS as usize],
}

#[derive(Debug)]
pub(crate) struct LookUp {
    by_rays: bool,
    environment_map: bool,
    /// Bright texels of the map are lamps, and no part of the environment.
    bright_traced: bool,
    sums: SumPlanes,
    share_words: usize,
    /// Sample images: their numbers are constants, whose values the software device reads once for all lanes.
    camera_count: usize,
    positions: Positions,
    /// Planes of the picture, by which a pixel's place is found.
    plane_count: usize,
    provenance_plane: Option<usize>,
}

/// The position within the pixels whose light is looked up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Positions {
    /// There is one.
    Only,
    /// The light of later ones may be that of this one.
    First,
    Later,
}

impl LookUpTests {
    /// `None` where no sample is asked.
    pub fn new(quality: LightCacheQuality) -> Option<Self> {
        let any = Self {
            least_coverage: f32::MIN_POSITIVE,
            plane_footprints: 1.0,
            least_cosine: 30_f32.to_radians().cos(),
            most_difference: f32::INFINITY,
        };
        let surrounded =
            Self { least_coverage: 0.75, plane_footprints: 0.25, least_cosine: 23_f32.to_radians().cos(), ..any };
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

impl GpuLampShares {
    /// The lamps of a scene that have a share.
    pub fn new(illumination: &Illumination) -> Self {
        let mut lamps = [[0; 4]; 4];
        for (place, lamp) in illumination.lamps_with_shares().into_iter().enumerate() {
            lamps[place / 4][place % 4] = lamp;
        }
        Self { lamps, lamp_count: shares_of_lamps(illumination.lights.len()) as u32, padding: [0; 3] }
    }
}

/// Shares of lamps: one for each, or else one for each of the strongest and one for all others.
fn shares_of_lamps(light_count: usize) -> usize {
    light_count.min(MAX_LAMP_SHARES + 1)
}

/// Texels of the table that a sample takes.
fn sample_texels(share_words: usize) -> usize {
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
        let refused = |index: usize, reason: String| RenderError::Samples { index, reason };
        if images.is_empty() || images.len() > MAX_CACHE_CAMERAS as usize {
            return Err(refused(images.len(), format!("a set of light has 1 to {MAX_CACHE_CAMERAS} images")));
        }
        let mut cached = Vec::new();
        let mut first_sample = 0;
        for (index, image) in images.iter().enumerate() {
            let camera = checked(image, share_words).map_err(|reason| refused(index, reason))?;
            let range = image.inverse_depth_range().map_or(0.0, |(least, greatest)| greatest - least);
            cached.push(CachedImage { camera, first_sample, half_step_per_m: 0.5 * range / DEPTH_CODES });
            first_sample += camera.pixel_count() as u32;
        }
        let texels = sample_texels(share_words);
        tables.gpu.check_table("samples of light", first_sample as usize * texels)?;
        let words: Vec<[u32; 4]> = images.iter().flat_map(|image| packed(image, texels)).collect();
        let samples = tables.upload("samples of light", TextureFormat::Rgba32Uint, &words, turn)?;
        Ok(Self { samples, images: cached, share_words })
    }

    /// The uniform of a view.
    fn uniform(&self, gpu: &Gpu, scene: &GpuScene, tests: LookUpTests, view: &Camera) -> Buffer {
        let mut cameras = [GpuCacheCamera::zeroed(); MAX_CACHE_CAMERAS as usize];
        for (camera, image) in cameras.iter_mut().zip(&self.images) {
            *camera = image.seen_from(view.reference().eye_in_world);
        }
        let LookUpTests { least_coverage, plane_footprints, least_cosine, most_difference } = tests;
        let cache = GpuCache {
            shares: scene.lamp_shares,
            least_coverage,
            plane_footprints,
            least_cosine,
            most_difference: most_difference.min(f32::MAX),
            cameras,
        };
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
        let share = |word: usize| light.share8.get(word).map_or(0, |plane| plane[place]);
        words.push([light.environment_rgb9e5[place], share(0), share(1), share(2)]);
        if texels > 2 {
            words.push([share(3), share(4), 0, 0]);
        }
    }
    words
}

impl CachedImage {
    /// The numbers of the image's camera for a view from `eye_in_world`. In double precision: both may be far from the origin.
    fn seen_from(&self, eye_in_world: Vec3) -> GpuCacheCamera {
        let camera = &self.camera;
        let eye_offset: DVec3 = camera.eye_in_world.as_dvec3() - eye_in_world.as_dvec3();
        let rows = camera.homogeneous_pixel_from_world().map(|row| {
            let axis = row.truncate();
            axis.extend(-axis.as_dvec3().dot(eye_offset) as f32).to_array()
        });
        let column = camera.world_from_camera * Vec3::X / camera.focal_px.x;
        let row = camera.world_from_camera * Vec3::NEG_Y / camera.focal_px.y;
        let corner = camera.forward_in_world() - column * camera.principal_px.x - row * camera.principal_px.y;
        GpuCacheCamera {
            homogeneous_texel_from_offset: rows,
            eye_offset: eye_offset.as_vec3().to_array(),
            footprint: camera.focal_px.min_element().recip(),
            column_in_world: column.to_array(),
            first_sample: self.first_sample,
            row_in_world: row.to_array(),
            half_step_per_m: self.half_step_per_m,
            corner_in_world: corner.to_array(),
            near_m: camera.near_m,
            size_px: camera.size_px.to_array(),
            padding: [0; 2],
        }
    }
}

impl LookUp {
    fn new(batch: &Batch<'_>, cache: &LightCache) -> Self {
        let Batch { work, output, .. } = batch;
        let environment_map = work.scene.environment.is_some();
        Self {
            by_rays: batch.by_rays,
            environment_map,
            bright_traced: environment_map && work.lighting.shadow_rays() > 0,
            sums: output.sums,
            share_words: cache.share_words,
            camera_count: cache.images.len(),
            positions: match batch.position.number {
                _ if output.antialias == Antialias::NONE => Positions::Only,
                0 => Positions::First,
                _ => Positions::Later,
            },
            plane_count: output.layout().count,
            provenance_plane: output.layout().provenance,
        }
    }
}

impl ShaderVariant for LookUp {
    const TEMPLATE: &'static str = "light_cache.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        let light_count = self.sums.light_count;
        let lamps_with_shares = shares_of_lamps(light_count);
        let own = context! {
            by_rays => self.by_rays,
            single_pole => false,
            environment_map => self.environment_map,
            bright_traced => self.bright_traced,
            provenance_plane => self.provenance_plane,
            max_lamp_shares => MAX_LAMP_SHARES,
            lamp_vectors => lamps_with_shares + usize::from(self.bright_traced),
            sample_texels => sample_texels(self.share_words),
            light_slots => light_slots(light_count),
            share_words => self.share_words,
            camera_count => self.camera_count,
            positions => match self.positions {
                Positions::Only => "only",
                Positions::First => "first",
                Positions::Later => "later",
            },
            plane_count => self.plane_count,
            lamps_with_shares,
        };
        merge_maps([own, self.sums.context()])
    }

    fn all() -> Vec<Self> {
        let mut variants = Vec::new();
        for light_count in [0, 1, 9, 40] {
            for [by_rays, environment_map, traced, visibility, provenance] in switches() {
                variants.push(Self {
                    by_rays,
                    environment_map,
                    bright_traced: environment_map && traced,
                    sums: SumPlanes { light_count, visibility },
                    share_words: LightPlanes::share_planes(light_count),
                    camera_count: 1 + light_count % 4,
                    positions: [Positions::Only, Positions::First, Positions::Later][variants.len() % 3],
                    plane_count: 2 + usize::from(provenance),
                    provenance_plane: provenance.then_some(2),
                });
            }
        }
        variants
    }
}

/// Records the look-up at the surfaces of one camera's picture. Pixels that are to be lit come in a list for each piece.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    CachedLight { cache, tests }: CachedLight<'_>,
    picture: Picture<'_>,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let variant = LookUp::new(batch, cache);
    let pass = recording.passes.get(&variant)?;
    let scene = batch.work.scene;
    let Picture { camera, target, planes, lists } = picture;
    let uniform = cache.uniform(recording.gpu, scene, tests, &batch.cameras[camera]);
    let buffers = Buffers {
        cameras: &recording.cameras,
        cache: &uniform,
        sums: &recording.sums.buffer,
        words: &planes.words,
        kept: planes.kept.as_deref().unwrap_or(&planes.words),
    };
    let bound = lists.iter().map(|list| {
        let own = bindings(&variant, &buffers, scene, &cache.samples);
        let normals = target.views.triangle_normal_binding();
        let first = target.views.first_surface_binding().filter(|_| variant.positions != Positions::Only);
        pass.bind(0, own.into_iter().chain(target.bindings()).chain(normals).chain(first).chain(list.bindings()))
    });
    let bound = bound.collect::<Result<Vec<_>, _>>()?;
    let kind = WorkKind::new(batch.family(), &variant.name());
    recording.dispatch_pieces(kind, &pass, camera, |place, piece, width_px| {
        (vec![&bound[place]], DispatchSize::Invocations([width_px, piece.end_row - piece.first_row, 1]))
    });
    Ok(())
}

/// A picture whose light is looked up.
pub(crate) struct Picture<'p> {
    /// Its number in the batch.
    pub camera: usize,
    pub target: &'p Surfaces,
    pub planes: &'p Planes,
    /// A list for each piece.
    pub lists: &'p [PixelList],
}

struct Buffers<'r> {
    cameras: &'r Buffer,
    cache: &'r Buffer,
    sums: &'r Buffer,
    words: &'r Buffer,
    kept: &'r Buffer,
}

/// Those that are not the picture's own.
fn bindings<'r>(
    variant: &LookUp,
    buffers: &Buffers<'r>,
    scene: &'r GpuScene,
    samples: &'r wgpu::TextureView,
) -> Vec<Binding<'r>> {
    let mut bindings = vec![
        Binding::buffer("camera", buffers.cameras),
        Binding::buffer("cache", buffers.cache),
        Binding::buffer("sums", buffers.sums),
        Binding::buffer("illumination", &scene.illumination),
        Binding::texture("samples", samples),
    ];
    bindings.extend(variant.provenance_plane.map(|_| Binding::buffer("words", buffers.words)));
    let shares_light = variant.positions != Positions::Only;
    bindings.extend(shares_light.then(|| Binding::buffer("kept", buffers.kept)));
    let map = scene.environment.as_deref().filter(|_| variant.environment_map);
    bindings.extend(map.into_iter().flat_map(GpuEnvironment::bindings));
    bindings
}

#[cfg(test)]
mod tests {
    use gpu::BufferPool;

    use super::*;
    use crate::test_support::TestStage;

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let table = Table::new(&stage.gpu, "samples", TextureFormat::Rgba32Uint, &[[0_u32; 4]; 2]).expect("a table");
        let list = PixelList::new(&stage.gpu, &BufferPool::new(&stage.gpu), 1);
        let buffer = &stage.buffer;
        let buffers = Buffers { cameras: buffer, cache: buffer, sums: buffer, words: buffer, kept: buffer };
        for variant in LookUp::all() {
            let target = stage.surfaces(variant.by_rays, false);
            let mut own = bindings(&variant, &buffers, &stage.scene, &table);
            own.extend(variant.environment_map.then(|| stage.environment.bindings()).into_iter().flatten());
            own.extend(target.bindings());
            own.extend(target.views.triangle_normal_binding());
            own.extend(target.views.first_surface_binding().filter(|_| variant.positions != Positions::Only));
            own.extend(list.bindings());
            stage.check(&variant, 0, &own);
        }
    }
}
