//! The look-up of light in samples, at the surfaces of views.

use depth_image::{Antialias, MAX_LAMP_SHARES, ProvenanceKind};
use gpu::{Binding, ShaderVariant, switches};
use minijinja::{Value, context};

use crate::batch::{Batch, Recording};
use crate::finish::Planes;
use crate::lamp_shares::shares_of_lamps;
use crate::light_samples::{CachedLight, LightCache, sample_texels};
use crate::pixel_list::PixelList;
use crate::{RenderError, sums::SumPlanes, surfaces::Surfaces};

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

    fn context(&self) -> Value {
        let Self { by_rays, environment_map, bright_traced, indirect, sums, share_words, .. } = *self;
        let Self { camera_count, plane_count, provenance_plane, .. } = *self;
        let lamps_with_shares = shares_of_lamps(sums.light_count);
        context! {
            by_rays, environment_map, bright_traced, indirect, share_words, camera_count, plane_count, provenance_plane,
            lamps_with_shares,
            single_pole => false,
            max_lamp_shares => MAX_LAMP_SHARES,
            lamp_vectors => lamps_with_shares + usize::from(bright_traced),
            sample_texels => sample_texels(share_words),
            positions => format!("{:?}", self.positions),
            ..sums.context()
        }
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
    let scene = recording.batch.work.scene;
    let Picture { camera, target, planes, lists, asked } = picture;
    let uniform = cache.uniform(recording.gpu, scene, tests, cache.images.len(), &recording.batch.cameras[camera]);
    let is_asked = variant.positions == Positions::Asked;
    for (place, piece) in recording.pieces_of(camera).into_iter().enumerate() {
        let asked = asked.get(place).filter(|_| is_asked);
        let own = [Binding::buffer("cache", &uniform), Binding::texture("samples", &cache.samples)];
        let own = own.into_iter().chain(planes.bindings()).chain(target.bindings()).chain(lists[place].bindings());
        let bound = recording.bind(&variant, (), own.chain(asked.into_iter().flat_map(PixelList::asked_bindings)))?;
        recording.dispatch_piece(&bound, piece, asked.map_or_else(|| piece.size(), PixelList::size));
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
