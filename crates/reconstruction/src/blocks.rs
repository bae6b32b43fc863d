//! Blocks of a scene, each with images of its own (Lages §4.1). A ray visits the blocks that it crosses, front to back, and is searched
//! in the images of each. What some block leaves unknown is searched in the images of the view cell.

use depth_image::PinholeCamera;
use gpu::{Binding, DynamicUniforms, PooledBuffer, ShaderVariant};
use minijinja::{Value, context};

use crate::device::Device;
use crate::methods::ReconstructionMethod;
use crate::quads::QuadDrawing;
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording, sample_set::SampleSet};
use crate::{specular, tile_start};

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

/// The numbers of blocks, nearest first. Blocks are the cells of one grid: no ray comes to a nearer one after a farther one.
pub(crate) fn front_to_back(blocks: &[&SampleSet], camera: &PinholeCamera) -> Vec<usize> {
    let distances = blocks.iter().map(|block| block.distance_squared_m2(camera.eye_in_world));
    let distances: Vec<f32> = distances.collect();
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    order.sort_by(|&a, &b| distances[a].total_cmp(&distances[b]));
    order
}

/// The blocks of a batch whose views all see them in one order, and memory for lists of rays.
pub(crate) struct BlockVisits<'s> {
    front_to_back: Vec<&'s SampleSet>,
    listed: PooledBuffer,
    unknown: PooledBuffer,
}

impl<'s> BlockVisits<'s> {
    /// `None` without blocks.
    pub fn lend(device: &Device, blocks: &[&'s SampleSet], camera: &PinholeCamera, plane_bytes: u64) -> Option<Self> {
        let first = front_to_back(blocks, camera).into_iter().map(|number| blocks[number]);
        let lend = |label| device.buffers.lend_storage(label, plane_bytes);
        (!blocks.is_empty()).then(|| Self {
            front_to_back: first.collect(),
            listed: lend("pixels whose rays cross a block"),
            unknown: lend("pixels unknown in blocks"),
        })
    }

    pub fn into_memory(self) -> impl Iterator<Item = PooledBuffer> {
        [self.listed, self.unknown].into_iter()
    }

    /// Records the search in all blocks of a recording, with their highlights; gives the pixels that some block has left unknown, or
    /// `None` without blocks.
    pub fn record(
        recording: &mut Recording<'s>,
        drawing: &QuadDrawing,
        method: ReconstructionMethod,
    ) -> Result<Option<PixelList>, ReconstructionError> {
        let Some(visits) = recording.blocks.take() else { return Ok(None) };
        let own = recording.set;
        for (number, block) in visits.front_to_back.iter().enumerate() {
            recording.enter(block);
            let rays = if number == 0 { ListedRays::OfFirstBlock } else { ListedRays::OfNextBlock };
            let crossing = visits.list(recording, rays)?;
            tile_start::record(recording)?;
            method.record(drawing, None, recording, Some(&crossing), None)?;
            specular::record(recording, Some(&crossing), None, None)?;
        }
        recording.enter(own);
        tile_start::record(recording)?;
        let unknown = visits.list(recording, ListedRays::LeftUnknown)?;
        recording.blocks = Some(visits);
        Ok(Some(unknown))
    }

    fn list(&self, recording: &mut Recording<'_>, rays: ListedRays) -> Result<PixelList, ReconstructionError> {
        let pixels = (*self.listed).clone();
        let list = PixelList::empty(&recording.device.gpu, pixels, recording.batch.pieces.count());
        let variant = ListRays { set: recording.set.variant(), rays };
        let unknown = Binding::buffer("unknown_in_blocks", &self.unknown);
        recording.dispatch_pixels(&variant, list.written_bindings().into_iter().chain([unknown]), None)?;
        Ok(list)
    }
}
