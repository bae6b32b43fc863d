//! How far all rays of a tile run through space that is proven empty, or that no camera sees.

use gpu::{Binding, DispatchSize, PassCache, ResourceTraits, ShaderVariant, WgslLiteral as _};
use minijinja::{Value, context};

use crate::{
    error::ReconstructionError,
    recording::Recording,
    view_work::{ONE_VIEW, SetVariant},
};

pub(crate) const SHADER: (&str, &str) = ("tile_start.wgsl", include_str!("tile_start.wgsl"));

pub(crate) const MAX_MOVES: u32 = 40;
/// The factor of the first move, and the greatest.
pub(crate) const GREATEST_MOVE: f32 = 1.3;
/// The tile stops where moves get shorter.
pub(crate) const LEAST_MOVE: f32 = 1.01;

/// Half the diagonal of a tile of side 1, and a little for rounding.
pub(crate) const HALF_DIAGONAL: f32 = 0.7072;

/// The switches of `tile_start.wgsl`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct TileStart(SetVariant);

impl ShaderVariant for TileStart {
    const TEMPLATE: &'static str = SHADER.0;
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            max_moves => MAX_MOVES,
            greatest_move => GREATEST_MOVE.wgsl_literal(),
            least_move => LEAST_MOVE.wgsl_literal(),
            half_diagonal => HALF_DIAGONAL.wgsl_literal(),
            ..self.0.context()
        }
    }

    fn all() -> Vec<Self> {
        SetVariant::all().into_iter().map(Self).collect()
    }
}

pub(crate) fn record(passes: &PassCache<TileStart>, recording: &mut Recording<'_>) -> Result<(), ReconstructionError> {
    let pass = passes.get(&TileStart(recording.set.variant()))?;
    let starts = Binding::buffer("tile_start_m", &recording.batch.tile_start_m);
    let bound = pass.bind(0, recording.view_bindings().into_iter().chain([starts]))?;
    let [across, down] = recording.batch.tiles.to_array();
    recording.dispatch(&pass, &bound, DispatchSize::Invocations([across, down, 1]));
    Ok(())
}
