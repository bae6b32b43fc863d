//! How far all rays of a tile run through space that is proven empty, or that no camera sees.

use gpu::{Binding, DispatchSize, shader_variant};

use crate::view_work::{ONE_VIEW, SetVariant, TILE_PX, tiles_of};
use crate::{error::ReconstructionError, recording::Recording};

pub(crate) const MAX_TILE_MOVES: u32 = 40;
/// The factor of the first move, and the greatest.
pub(crate) const GREATEST_TILE_MOVE: f32 = 1.3;
/// The tile stops where moves get shorter.
pub(crate) const LEAST_TILE_MOVE: f32 = 1.01;
/// Half the diagonal of a tile of side 1, and a little for rounding.
pub(crate) const HALF_DIAGONAL: f32 = 0.7072;

shader_variant!(TileStart(SetVariant), "tile_start.wgsl", ONE_VIEW);

pub(crate) fn record(recording: &mut Recording<'_>) -> Result<(), ReconstructionError> {
    let rows = recording.batch.pieces.rows;
    let [across, down] = tiles_of(recording.batch.size_px).to_array();
    let bytes = 4 * u64::from(across * down) * recording.batch.cameras.len() as u64;
    let starts = recording.device.buffers.lend_storage("tile starts", bytes);
    let own = [Binding::buffer("tile_start_m", &starts)];
    let variant = TileStart(recording.set.variant());
    recording.dispatch(&variant, own, |_| DispatchSize::Invocations([across, rows.div_ceil(TILE_PX), 1]))?;
    recording.batch.tile_start_m = Some(starts);
    Ok(())
}
