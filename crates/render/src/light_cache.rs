//! The look-up of light in samples, at the surfaces of views.

use depth_image::{Antialias, MAX_LAMP_SHARES, ProvenanceKind};
use gpu::{Binding, GpuEnvironment, ResourceTraits, ShaderVariant, light_slots, switches};
use minijinja::{Value, context, value::merge_maps};
use wgpu::Buffer;

use crate::batch::{Batch, Recording};
use crate::finish::Planes;
use crate::lamp_shares::shares_of_lamps;
use crate::light_samples::{CachedLight, LightCache, sample_texels};
use crate::pixel_camera::CAMERA_TRAITS;
use crate::pixel_list::PixelList;
use crate::{GpuScene, RenderError, sums::SumPlanes, surfaces::Surfaces};

/// Codes of [`ProvenanceKind`].
pub(crate) const PROVENANCE_EMPTY: u32 = ProvenanceKind::Empty as u32;
pub(crate) const PROVENANCE_HIT: u32 = ProvenanceKind::Hit as u32;
pub(crate) const PROVENANCE_LIT_HERE: u32 = ProvenanceKind::LitHere as u32;

#[derive(Debug, Clone, Copy)]
pub(crate) struct LookUp {
    by_rays: bool,
    environment_map: bool,
    /// Bright texels of the map are lamps, and no part of the environment.
    bright_traced: bool,
    /// The ambient light of samples is indirect light.
    indirect: bool,
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
    /// Points are compared with those of the first position, and listed where they differ.
    Later,
    /// The listed points of a later position.
    Asked,
}

impl Positions {
    /// Whether points are compared with those of other positions.
    fn are_compared(self) -> bool {
        matches!(self, Self::First | Self::Later)
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
            indirect: work.lighting.is_indirect(),
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
        let Self { by_rays, environment_map, bright_traced, indirect, sums, share_words, .. } = *self;
        let Self { camera_count, plane_count, provenance_plane, .. } = *self;
        let lamps_with_shares = shares_of_lamps(sums.light_count);
        let own = context! {
            by_rays, environment_map, bright_traced, indirect, share_words, camera_count, plane_count, provenance_plane,
            lamps_with_shares,
            single_pole => false,
            max_lamp_shares => MAX_LAMP_SHARES,
            lamp_vectors => lamps_with_shares + usize::from(bright_traced),
            sample_texels => sample_texels(share_words),
            light_slots => light_slots(sums.light_count),
            positions => match self.positions {
                Positions::Only => "only",
                Positions::First => "first",
                Positions::Later => "later",
                Positions::Asked => "asked",
            },
        };
        merge_maps([own, sums.context()])
    }

    fn all() -> Vec<Self> {
        let positions = [Positions::Only, Positions::First, Positions::Later, Positions::Asked];
        let mut variants = Vec::new();
        for light_count in [0, 1, 9, 40] {
            for [by_rays, environment_map, traced, visibility, provenance] in switches() {
                variants.push(Self {
                    by_rays,
                    environment_map,
                    bright_traced: environment_map && traced,
                    indirect: traced,
                    sums: SumPlanes { light_count, visibility },
                    share_words: (1 + shares_of_lamps(light_count)).div_ceil(4),
                    camera_count: 1 + light_count % 4,
                    positions: positions[(variants.len() + variants.len() / 4) % 4],
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
    cached: CachedLight<'_>,
    picture: Picture<'_>,
) -> Result<(), RenderError> {
    let variant = LookUp::new(recording.batch, cached.cache);
    if variant.positions != Positions::Later {
        return dispatch(recording, cached, picture, variant);
    }
    dispatch(recording, cached, Picture { lists: picture.asked, ..picture }, variant)?;
    dispatch(recording, cached, picture, LookUp { positions: Positions::Asked, ..variant })
}

fn dispatch(
    recording: &mut Recording<'_>,
    CachedLight { cache, tests }: CachedLight<'_>,
    picture: Picture<'_>,
    variant: LookUp,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let pass = recording.passes.get(&variant)?;
    let scene = batch.work.scene;
    let Picture { camera, target, planes, lists, asked } = picture;
    let uniform = cache.uniform(recording.gpu, scene, tests, &batch.cameras[camera]);
    let kept = planes.kept.as_deref().unwrap_or(&planes.words);
    let buffers: [&Buffer; 5] = [&recording.cameras, &uniform, &recording.sums.buffer, &planes.words, kept];
    let is_asked = variant.positions == Positions::Asked;
    let bound = lists.iter().enumerate().map(|(place, list)| {
        let own = bindings(&variant, buffers, scene, &cache.samples);
        let normals = target.views.triangle_normal_binding();
        let first = target.views.first_surface_binding().filter(|_| variant.positions.are_compared());
        let asked = asked.get(place).filter(|_| is_asked).into_iter().flat_map(PixelList::asked_bindings);
        let bindings = own.into_iter().chain(target.bindings()).chain(normals).chain(first);
        pass.bind(0, bindings.chain(list.bindings()).chain(asked))
    });
    let bound = bound.collect::<Result<Vec<_>, _>>()?;
    let kind = recording.kind_of(&variant);
    for (place, piece) in recording.pieces_of(camera).into_iter().enumerate() {
        let size = if is_asked { asked[place].size() } else { piece.size() };
        recording.dispatch_piece(kind, &pass, &[&bound[place]], piece, size);
    }
    Ok(())
}

/// A picture whose light is looked up.
#[derive(Clone, Copy)]
pub(crate) struct Picture<'p> {
    /// Its number in the batch.
    pub camera: usize,
    pub target: &'p Surfaces,
    pub planes: &'p Planes,
    /// Pixels to be lit: a list for each piece.
    pub lists: &'p [PixelList],
    /// Pixels that do not have the light of their first position: a list for each piece, in later positions.
    pub asked: &'p [PixelList],
}

/// Those that are not the picture's own.
fn bindings<'r>(
    variant: &LookUp,
    [camera, cache, sums, words, kept]: [&'r Buffer; 5],
    scene: &'r GpuScene,
    samples: &'r wgpu::TextureView,
) -> Vec<Binding<'r>> {
    let mut bindings = vec![
        Binding::buffer("camera", camera),
        Binding::buffer("cache", cache),
        Binding::buffer("sums", sums),
        Binding::buffer("illumination", &scene.illumination),
        Binding::texture("samples", samples),
    ];
    bindings.extend(variant.provenance_plane.map(|_| Binding::buffer("words", words)));
    bindings.extend(variant.positions.are_compared().then(|| Binding::buffer("kept", kept)));
    let map = scene.environment.as_deref().filter(|_| variant.environment_map);
    bindings.extend(map.into_iter().flat_map(GpuEnvironment::bindings));
    bindings
}

#[cfg(test)]
mod tests {
    use gpu::{BufferPool, Table};
    use wgpu::TextureFormat;

    use super::*;
    use crate::test_support::TestStage;

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let table = Table::new(&stage.gpu, "samples", TextureFormat::Rgba32Uint, &[[0_u32; 4]; 2]).expect("a table");
        let [list, asked] = [(); 2].map(|()| PixelList::new(&stage.gpu, &BufferPool::new(&stage.gpu), 1));
        for variant in LookUp::all() {
            let target = stage.surfaces(variant.by_rays, false);
            let mut own = bindings(&variant, [&stage.buffer; 5], &stage.scene, &table);
            own.extend(variant.environment_map.then(|| stage.environment.bindings()).into_iter().flatten());
            own.extend(target.bindings());
            own.extend(target.views.triangle_normal_binding());
            own.extend(target.views.first_surface_binding().filter(|_| variant.positions.are_compared()));
            own.extend(list.bindings());
            let asked = Some(&asked).filter(|_| variant.positions == Positions::Asked);
            own.extend(asked.into_iter().flat_map(PixelList::asked_bindings));
            stage.check(&variant, 0, &own);
        }
    }
}
