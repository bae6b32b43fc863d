//! Min-max pyramids of all cameras, traversed together; the cameras' colours are blended.

pub(crate) mod march;

use std::sync::Arc;

use gpu::{Gpu, PassCache, ResourceTraits, ShaderVariant, Templates, WgslLiteral as _};
use minijinja::{Value, context};

use self::march::{MARCHES, March, NUDGE_PX, START_LEVEL};
use crate::{
    error::ReconstructionError,
    pixel_list::PixelList,
    recording::Recording,
    surface::{self, SurfaceVariant},
    view_work::ONE_VIEW,
};

pub(super) const SHADER: (&str, &str) = ("joint_carve.wgsl", include_str!("joint_carve.wgsl"));

const MAX_STOP_LEVEL: u32 = 8;
/// Moves of a ray. A ray that is not done by then wanders behind all that cameras see, and stays unknown. A surface that
/// it still met would more likely be wrong than right (docs/methods/joint_carve.md).
pub(crate) const MAX_MOVES: u32 = 24;
/// Moves of a ray in a set with holes: texels that prove nothing are crossed one by one.
pub(crate) const MAX_MOVES_AMONG_HOLES: u32 = 96;

/// A ray that leaves no node moves by this share of its way in the volume.
pub(crate) const BLIND_MOVE: f32 = 0.01;
/// The least move into the unknown, as a factor.
pub(crate) const LEAST_MOVE: f32 = 1.00001;

/// The switches of `joint_carve.wgsl`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Carve {
    surface: SurfaceVariant,
    /// The pyramid level at which the search ends; 0 is exact.
    stop_level: u32,
}

impl ShaderVariant for Carve {
    const TEMPLATE: &'static str = SHADER.0;
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            max_moves => if self.surface.set.holes { MAX_MOVES_AMONG_HOLES } else { MAX_MOVES },
            start_level => START_LEVEL.max(self.stop_level),
            stop_level => self.stop_level,
            nudge_px => NUDGE_PX.wgsl_literal(),
            blind_move => BLIND_MOVE.wgsl_literal(),
            least_move => LEAST_MOVE.wgsl_literal(),
            ..self.surface.context()
        }
    }

    fn all() -> Vec<Self> {
        let levels = |surface| [0, 1, MAX_STOP_LEVEL].map(|stop_level| Self { surface, stop_level });
        SurfaceVariant::all().into_iter().flat_map(levels).collect()
    }
}

pub(super) struct CarvePasses {
    march: PassCache<March>,
    carve: PassCache<Carve>,
}

impl CarvePasses {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { march: PassCache::new(gpu, templates), carve: PassCache::new(gpu, templates) }
    }
}

pub(super) fn parse_stop_level(text: &str) -> Option<u32> {
    text.parse().ok().filter(|&level| level <= MAX_STOP_LEVEL)
}

/// One level coarser.
pub(super) fn coarser_level(stop_level: u32) -> Option<u32> {
    (stop_level < MAX_STOP_LEVEL).then_some(stop_level + 1)
}

/// Marches in the nearest cameras, one after another; what they leave is carved by all together. Gives the pixels that
/// stay unknown.
pub(super) fn record(
    passes: &CarvePasses,
    recording: &mut Recording<'_>,
    stop_level: u32,
) -> Result<PixelList, ReconstructionError> {
    let mut undecided = march::record_first(&passes.march, recording)?;
    for camera in 1..MARCHES.min(recording.set.cameras.len()) {
        undecided = march::record_next(&passes.march, recording, camera, &undecided)?;
    }
    let pass = passes.carve.get(&Carve { surface: SurfaceVariant::of(recording), stop_level })?;
    let unknown = recording.lend_list();
    let bound = pass.bind(0, surface::bindings(recording, &unknown).into_iter().chain(undecided.bindings()))?;
    recording.dispatch_listed(&pass, &bound, &undecided);
    Ok(unknown)
}
