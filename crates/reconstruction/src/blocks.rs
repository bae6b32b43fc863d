//! Blocks of a scene, each with images of its own (Lages §4.1). A ray visits the blocks that it crosses, front to back, and is searched
//! in the images of each. What some block leaves unknown is searched in the images of the view cell.

use gpu::{Binding, DynamicUniforms, ShaderVariant};
use minijinja::{Value, context};

use crate::methods::ReconstructionMethod;
use crate::quads::QuadDrawing;
use crate::recording::{Recording, VisitedBlocks};
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, specular, tile_start};

/// The rays that are listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ListedRays {
    /// Those that cross the nearest block.
    OfFirstBlock,
    /// Those that cross the next block.
    OfNextBlock,
    /// Those that some block has left unknown.
    LeftUnknown,
}

/// The switches of `blocks.wgsl`.
#[derive(Debug)]
pub(crate) struct ListRays {
    set: SetVariant,
    rays: ListedRays,
}

impl ShaderVariant for ListRays {
    const TEMPLATE: &'static str = "blocks.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        context! { rays => format!("{:?}", self.rays), ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let rays = [ListedRays::OfFirstBlock, ListedRays::OfNextBlock, ListedRays::LeftUnknown];
        SetVariant::all().into_iter().flat_map(|set| rays.map(|rays| Self { set, rays })).collect()
    }
}

/// Records the tiles' starts in the blocks of a recording, which hold for every position within the pixels.
pub(crate) fn record_tile_starts(recording: &mut Recording<'_>) -> Result<(), ReconstructionError> {
    let Some(mut blocks) = recording.blocks.take() else { return Ok(()) };
    let own = recording.set;
    let own_tile_start_m = recording.batch.tile_start_m.take();
    for block in &mut blocks.front_to_back {
        recording.enter(block.set);
        tile_start::record(recording)?;
        block.tile_start_m = recording.batch.tile_start_m.take();
    }
    recording.enter(own);
    recording.batch.tile_start_m = own_tile_start_m;
    recording.blocks = Some(blocks);
    Ok(())
}

/// Records the search in the blocks of a recording, with their highlights. Gives the pixels that some block has left unknown, or `None`
/// without blocks.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    drawing: &QuadDrawing,
    method: ReconstructionMethod,
) -> Result<Option<PixelList>, ReconstructionError> {
    let Some(mut blocks) = recording.blocks.take() else { return Ok(None) };
    let own = recording.set;
    let own_tile_start_m = recording.batch.tile_start_m.take();
    for number in 0..blocks.front_to_back.len() {
        recording.enter(blocks.front_to_back[number].set);
        let rays = if number == 0 { ListedRays::OfFirstBlock } else { ListedRays::OfNextBlock };
        let crossing = list(recording, &blocks, rays)?;
        recording.batch.tile_start_m = blocks.front_to_back[number].tile_start_m.take();
        method.record(drawing, None, recording, Some(&crossing), None)?;
        specular::record(recording, Some(&crossing), None, None)?;
        blocks.front_to_back[number].tile_start_m = recording.batch.tile_start_m.take();
    }
    recording.enter(own);
    recording.batch.tile_start_m = own_tile_start_m;
    let unknown = list(recording, &blocks, ListedRays::LeftUnknown)?;
    recording.blocks = Some(blocks);
    Ok(Some(unknown))
}

fn list(
    recording: &mut Recording<'_>,
    blocks: &VisitedBlocks<'_>,
    rays: ListedRays,
) -> Result<PixelList, ReconstructionError> {
    let pixels = (*blocks.listed).clone();
    let list = PixelList::empty(&recording.device.gpu, pixels, recording.batch.pieces.count());
    let variant = ListRays { set: recording.set.variant(), rays };
    let unknown = Binding::buffer("unknown_in_blocks", &blocks.unknown);
    recording.dispatch_pixels(&variant, list.written_bindings().into_iter().chain([unknown]), None)?;
    Ok(list)
}
