//! Marches in the image of one sample camera, then asks all cameras about the point found.

use gpu::{Binding, PassCache, ResourceTraits, ShaderVariant, WgslLiteral as _};
use minijinja::{Value, context};

use crate::{
    error::ReconstructionError,
    pixel_list::PixelList,
    recording::Recording,
    surface::{self, SurfaceVariant},
    view_work::ONE_VIEW,
};

pub(crate) const SHADER: (&str, &str) = ("march.wgsl", include_str!("march.wgsl"));

/// The marches that come before the carve, in the nearest cameras.
pub(crate) const MARCHES: usize = 2;
/// The coarsest level that a pixel's own search uses; its tile has done the rest.
pub(crate) const START_LEVEL: u32 = 3;
/// Moves from node to node.
pub(crate) const MAX_COARSE_MOVES: u32 = 64;
/// Moves from cell to cell.
pub(crate) const MAX_FINE_MOVES: u32 = 12;
/// Rays move this far past the edge of a node.
pub(crate) const NUDGE_PX: f32 = 1e-3;

/// A march ends at this share of its first depth before the plane through the camera's eye.
pub(crate) const EYE_SHARE: f32 = 0.01;

/// The switches of `march.wgsl`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct March {
    surface: SurfaceVariant,
    /// The camera among a view's, nearest first. Marches after the first are over lists of pixels.
    camera: usize,
}

impl ShaderVariant for March {
    const TEMPLATE: &'static str = SHADER.0;
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            march_camera => self.camera,
            start_level => START_LEVEL,
            max_coarse_moves => MAX_COARSE_MOVES,
            max_fine_moves => MAX_FINE_MOVES,
            nudge_px => NUDGE_PX.wgsl_literal(),
            eye_share => EYE_SHARE.wgsl_literal(),
            ..self.surface.context()
        }
    }

    fn all() -> Vec<Self> {
        let marches =
            |surface: SurfaceVariant| (0..surface.set.cameras.min(MARCHES)).map(move |camera| Self { surface, camera });
        SurfaceVariant::all().into_iter().flat_map(marches).collect()
    }
}

/// Marches all pixels in the nearest camera, from where their tiles start; gives the pixels that stay undecided.
pub(crate) fn record_first(
    passes: &PassCache<March>,
    recording: &mut Recording<'_>,
) -> Result<PixelList, ReconstructionError> {
    let pass = passes.get(&March { surface: SurfaceVariant::of(recording), camera: 0 })?;
    let undecided = recording.lend_list();
    let starts = Binding::buffer("tile_start_m", &recording.batch.tile_start_m);
    let bound = pass.bind(0, surface::bindings(recording, &undecided).into_iter().chain([starts]))?;
    recording.dispatch_pixels(&pass, &bound);
    Ok(undecided)
}

/// Marches listed pixels in a camera farther on; gives the pixels that stay undecided.
pub(crate) fn record_next(
    passes: &PassCache<March>,
    recording: &mut Recording<'_>,
    camera: usize,
    listed: &PixelList,
) -> Result<PixelList, ReconstructionError> {
    let pass = passes.get(&March { surface: SurfaceVariant::of(recording), camera })?;
    let undecided = recording.lend_list();
    let bound = pass.bind(0, surface::bindings(recording, &undecided).into_iter().chain(listed.bindings()))?;
    recording.dispatch_listed(&pass, &bound, listed);
    Ok(undecided)
}
