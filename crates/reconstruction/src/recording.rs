//! Views of one size that are reconstructed together, on their way into a frame: whole, or in pieces of some rows each where
//! the device is shared with live streams.

use std::hash::Hash;
use std::ops::Range;
use std::sync::Arc;

use depth_image::{Antialias, PinholeCamera, ViewPlanes};
use glam::{UVec2, Vec2, Vec3};
use gpu::{
    Binding, BoundGroup, ComputePass, DispatchSize, Frame, PooledBuffer, ShaderVariant, Turn, WorkKind,
    uniform_elements,
};
use wgpu::BufferUsages;

use crate::quads::QuadTargets;
use crate::sample_set::{SampleSet, front_to_back};
use crate::view_work::{GpuSampleCamera, GpuViewCamera, GpuViewWork, GpuVolume, TILE_PX};
use crate::{device::Device, error::ReconstructionError, pixel_list::PixelList};

/// Bounds the memory of a batch: 20 bytes a pixel on the device, 32 with several positions a pixel, 8 more with blocks, up to 12 on the host.
pub(crate) const PIXELS_A_BATCH: usize = 1 << 20;
/// The same where rays off mirrors are followed: they take 108 bytes a pixel, and 16 more for each mirror cell and for a base. Rays into
/// lobes that are walked in a base take as much again, and 76 more for their surfaces.
pub(crate) const MIRRORED_PIXELS_A_BATCH: usize = 1 << 18;
/// The same beside live streams: the rays of a batch are followed in one slice.
pub(crate) const MIRRORED_PIXELS_A_SLICE: usize = 1 << 14;
const MAX_VIEWS_A_BATCH: usize = 256;
/// The pixels of a slice of views whose cost is unknown.
const UNKNOWN_SLICE_PX: u64 = 1 << 14;

/// A batch of views, recorded into one frame: what every pass is handed.
pub(crate) struct Recording<'r> {
    pub device: &'r Device,
    pub set: &'r SampleSet,
    /// What comes before the set, where the scene has blocks.
    pub blocks: Option<VisitedBlocks<'r>>,
    pub frame: Frame<'r>,
    pub batch: Batch,
    /// The family of the passes, whose costs are learned.
    family: u64,
}

/// The blocks of a batch whose views all see them in one order, and memory for lists of rays.
pub(crate) struct VisitedBlocks<'r> {
    pub front_to_back: Vec<VisitedBlock<'r>>,
    pub listed: PooledBuffer,
    pub unknown: PooledBuffer,
}

pub(crate) struct VisitedBlock<'r> {
    pub set: &'r SampleSet,
    /// As in [`Batch`].
    pub tile_start_m: Option<PooledBuffer>,
}

/// Some rows of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Piece {
    view: usize,
    first_row: u32,
}

/// All views in pieces of equal height, but for each view's last.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Pieces {
    all: Vec<Piece>,
    pub rows: u32,
    /// Pieces that a slice of a pass holds.
    a_slice: usize,
}

/// Views of one size, and what they take on the device.
pub(crate) struct Batch {
    /// Of the pixels' centres.
    centers: Vec<PinholeCamera>,
    /// Of the position within the pixels that is being recorded.
    pub cameras: Vec<PinholeCamera>,
    pub size_px: UVec2,
    /// How the views' colours are sampled and shown.
    pub planes: ViewPlanes,
    /// The bytes of one plane of all views.
    pub plane_bytes: u64,
    pub pieces: Pieces,
    /// A `ViewWork` for each piece.
    pub works: wgpu::Buffer,
    /// For methods that follow rays.
    pub tile_start_m: Option<PooledBuffer>,
    /// RGB9E5 of one position; sRGB once the views are finished.
    pub color: PooledBuffer,
    /// Linear light of several positions, 12 bytes a pixel.
    pub sums: Option<PooledBuffer>,
    pub inverse_depth_per_m: PooledBuffer,
    pub provenance: PooledBuffer,
    /// The memory of lists of pixels: a pass reads one list and writes the next.
    undecided_pixels: [PooledBuffer; 2],
    lists_made: usize,
    /// The memory of the list of pixels that all further positions take up.
    rough_pixels: Option<PooledBuffer>,
    /// For methods that draw; all positions are drawn into the same.
    pub targets: Option<QuadTargets>,
    /// The memory of mirrored rays and of blocks, lent until the device is done with the batch.
    pub lent: Vec<PooledBuffer>,
}

impl VisitedBlocks<'_> {
    /// Lent until the device is done with the batch.
    pub fn into_memory(self) -> impl Iterator<Item = PooledBuffer> {
        let starts = self.front_to_back.into_iter().filter_map(|block| block.tile_start_m);
        starts.chain([self.listed, self.unknown])
    }
}

impl<'r> Recording<'r> {
    /// Lends the planes; fails for views beyond the device's limits.
    pub fn begin(
        device: &'r Device,
        set: &'r SampleSet,
        cameras: &[PinholeCamera],
        planes: ViewPlanes,
        family: u64,
        turn: Turn,
    ) -> Result<Self, ReconstructionError> {
        let plane_bytes = 4 * (cameras[0].pixel_count() * cameras.len()) as u64;
        let has_sums = planes.antialias > Antialias::NONE;
        let sum_bytes = if has_sums { 3 * plane_bytes } else { 0 };
        device.gpu.check_storage_bytes("a batch of views (bytes)", plane_bytes)?;
        device.gpu.check_storage_bytes("the sums of several samples a pixel (bytes)", sum_bytes)?;
        let slice_px = device.gpu.device_queue.slice_units(family, UNKNOWN_SLICE_PX);
        let pieces = Pieces::of(cameras.len(), cameras[0].size_px, slice_px);
        let works = works(device, set, cameras, &pieces, planes);
        let [color, inverse_depth_per_m, provenance, undecided, still_undecided] =
            ["color", "inverse depth", "provenance", "undecided pixels", "pixels still undecided"]
                .map(|label| device.buffers.lend_storage(label, plane_bytes));
        let batch = Batch {
            centers: cameras.to_vec(),
            cameras: cameras.to_vec(),
            size_px: cameras[0].size_px,
            planes,
            plane_bytes,
            pieces,
            works,
            tile_start_m: None,
            color,
            sums: has_sums.then(|| device.buffers.lend_storage("sums of positions", sum_bytes)),
            inverse_depth_per_m,
            provenance,
            undecided_pixels: [undecided, still_undecided],
            lists_made: 0,
            rough_pixels: has_sums.then(|| device.buffers.lend_storage("pixels of further positions", plane_bytes)),
            targets: None,
            lent: Vec::new(),
        };
        let frame = Frame::begin(&device.gpu, "reconstruct", turn);
        Ok(Self { device, set, blocks: None, frame, batch, family })
    }

    /// Records what follows for another position within the pixels.
    pub fn go_to(&mut self, offset_px: Vec2) {
        let Batch { centers, pieces, planes, .. } = &self.batch;
        let cameras: Vec<_> = centers.iter().map(|camera| camera.with_offset(offset_px)).collect();
        self.batch.works = works(self.device, self.set, &cameras, pieces, *planes);
        self.batch.cameras = cameras;
    }

    /// Lends what visits to blocks need; nothing without blocks.
    pub fn lend_blocks(&mut self, blocks: &[&'r SampleSet]) {
        if blocks.is_empty() {
            return;
        }
        let numbers = front_to_back(blocks, &self.batch.centers[0]);
        let [listed, unknown] = ["pixels whose rays cross a block", "pixels unknown in blocks"]
            .map(|label| self.device.buffers.lend_storage(label, self.batch.plane_bytes));
        let front_to_back = numbers.into_iter().map(|number| VisitedBlock { set: blocks[number], tile_start_m: None });
        let front_to_back = front_to_back.collect();
        self.blocks = Some(VisitedBlocks { front_to_back, listed, unknown });
    }

    /// Records what follows for another set's images.
    pub fn enter(&mut self, set: &'r SampleSet) {
        let Batch { cameras, pieces, planes, .. } = &self.batch;
        self.batch.works = works(self.device, set, cameras, pieces, *planes);
        self.set = set;
    }

    /// A list for the pixels that a pass leaves undecided; it is good until the list after the next is begun.
    pub fn empty_list(&mut self) -> PixelList {
        let Batch { undecided_pixels, lists_made, pieces, .. } = &mut self.batch;
        let pixels = &undecided_pixels[*lists_made % undecided_pixels.len()];
        *lists_made += 1;
        PixelList::empty(&self.device.gpu, (**pixels).clone(), pieces.count())
    }

    /// A list for the pixels that all further positions take up; it is good until the batch ends.
    ///
    /// # Panics
    /// Where a pixel has one position.
    pub fn rough_list(&self) -> PixelList {
        let pixels = self.batch.rough_pixels.as_ref().expect("lent where a pixel has several positions");
        PixelList::empty(&self.device.gpu, (**pixels).clone(), self.batch.pieces.count())
    }

    /// The resources of the batch and of its set: each shader declares some of them.
    fn bindings(&self) -> Vec<Binding<'_>> {
        let Self { set, batch, .. } = self;
        let mut bindings = set.image_bindings();
        bindings.extend(plane_bindings([&batch.color, &batch.inverse_depth_per_m, &batch.provenance]));
        bindings.extend([Binding::buffer("work", &batch.works), Binding::buffer("background", &set.background)]);
        bindings.extend(set.environment.iter().flat_map(|map| map.bindings()));
        bindings.extend(batch.sums.iter().map(|sums| Binding::buffer("sums", sums)));
        bindings.extend(batch.tile_start_m.iter().map(|starts| Binding::buffer("tile_start_m", starts)));
        bindings.extend(batch.targets.iter().flat_map(|drawn| drawn.bindings()));
        bindings
    }

    /// A pass of `variant`. Its shader is bound to its `own` resources, and to those of the batch.
    fn bind<'b>(
        &self,
        variant: &impl ShaderVariant,
        own: impl IntoIterator<Item = Binding<'b>>,
    ) -> Result<(Arc<ComputePass>, BoundGroup), ReconstructionError> {
        let pass = self.device.passes.get(variant)?;
        let mut bindings: Vec<Binding<'_>> = own.into_iter().collect();
        bindings.extend(self.bindings());
        let bound = pass.bind(0, bindings)?;
        Ok((pass, bound))
    }

    /// Records a pass over the listed pixels of each piece, or over all.
    pub fn dispatch_pixels<'b>(
        &mut self,
        variant: &impl ShaderVariant,
        own: impl IntoIterator<Item = Binding<'b>>,
        listed: Option<&'b PixelList>,
    ) -> Result<(), ReconstructionError> {
        let all = [self.batch.size_px.x, self.batch.pieces.rows, 1];
        let own = own.into_iter().chain(listed.into_iter().flat_map(PixelList::bindings));
        self.dispatch(variant, own, |first| match listed {
            Some(listed) => DispatchSize::Indirect(&listed.lists, first),
            None => DispatchSize::Invocations(all),
        })
    }

    /// Records a pass over the `number`-th of some lists, of rays of any of the batch's pixels. Equal `what` cost the same.
    pub fn dispatch_listed<'b>(
        &mut self,
        variant: &impl ShaderVariant,
        own: impl IntoIterator<Item = Binding<'b>>,
        lists: &wgpu::Buffer,
        number: usize,
        what: impl Hash,
    ) -> Result<(), ReconstructionError> {
        let (pass, bound) = self.bind(variant, own)?;
        pass.dispatch(&mut self.frame, &[&bound], DispatchSize::Indirect(lists, number as u32));
        self.frame.cut(WorkKind::new(self.family, &(variant.name(), what)), self.batch.plane_bytes / 4);
        Ok(())
    }

    /// Records one dispatch a piece, of a size that may depend on the first piece.
    pub fn dispatch<'b, 's>(
        &mut self,
        variant: &impl ShaderVariant,
        own: impl IntoIterator<Item = Binding<'b>>,
        size: impl Fn(u32) -> DispatchSize<'s>,
    ) -> Result<(), ReconstructionError> {
        let (pass, bound) = self.bind(variant, own)?;
        let kind = WorkKind::new(self.family, &variant.name());
        let piece_px = u64::from(self.batch.size_px.x) * u64::from(self.batch.pieces.rows);
        for slice in self.batch.pieces.slices() {
            let count = slice.len() as u64;
            let size = size(slice.start);
            pass.dispatch_each(&mut self.frame, &[&bound], slice, size);
            self.frame.cut(kind, count * piece_px);
        }
        Ok(())
    }
}

/// Colours, inverse depths and provenance of pixels or rays, under the names of passes that find them and of those that go on.
pub(crate) fn plane_bindings([color, inverse_depth, provenance]: [&wgpu::Buffer; 3]) -> [Binding<'_>; 6] {
    [
        Binding::buffer("color", color),
        Binding::buffer("out_color", color),
        Binding::buffer("inverse_depth", inverse_depth),
        Binding::buffer("out_inverse_depth", inverse_depth),
        Binding::buffer("provenance", provenance),
        Binding::buffer("out_provenance", provenance),
    ]
}

impl Pieces {
    /// The pieces of views of one size, for slices of at most so many pixels.
    fn of(views: usize, size_px: UVec2, slice_px: u64) -> Self {
        let most_rows = (slice_px / u64::from(size_px.x)).min(size_px.y.into()) as u32;
        let most_rows = if most_rows == size_px.y { most_rows } else { (most_rows / TILE_PX * TILE_PX).max(TILE_PX) };
        let count = size_px.y.div_ceil(most_rows);
        // Pieces of a view are about equal, and begin with whole tiles.
        let rows = if count == 1 { size_px.y } else { size_px.y.div_ceil(count).next_multiple_of(TILE_PX) };
        let piece_px = u64::from(rows) * u64::from(size_px.x);
        let all = (0..views)
            .flat_map(|view| (0..size_px.y).step_by(rows as usize).map(move |first_row| Piece { view, first_row }));
        Self { all: all.collect(), rows, a_slice: (slice_px / piece_px).max(1) as usize }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    fn slices(&self) -> impl Iterator<Item = Range<u32>> + use<> {
        let count = self.all.len();
        let a_slice = self.a_slice;
        (0..count).step_by(a_slice).map(move |first| first as u32..first.saturating_add(a_slice).min(count) as u32)
    }
}

/// Runs of views of one size, bounded in pixels, which see all blocks in one order.
pub(crate) fn batches<'c>(
    cameras: &'c [PinholeCamera],
    most_pixels: usize,
    blocks: &[&SampleSet],
) -> impl Iterator<Item = &'c [PinholeCamera]> {
    let alike = cameras.chunk_by(|a, b| a.size_px == b.size_px && front_to_back(blocks, a) == front_to_back(blocks, b));
    alike.flat_map(move |run| {
        let views = (most_pixels / run[0].pixel_count()).clamp(1, MAX_VIEWS_A_BATCH);
        run.chunks(views)
    })
}

/// The `ViewWork` of each piece.
fn works(
    device: &Device,
    set: &SampleSet,
    cameras: &[PinholeCamera],
    pieces: &Pieces,
    planes: ViewPlanes,
) -> wgpu::Buffer {
    let volume = GpuVolume { position_share: (planes.antialias.samples() as f32).recip(), ..set.volume };
    let sorted: Vec<_> = cameras.iter().map(|camera| nearest_first(set, camera.eye_in_world)).collect();
    let works = (0..).zip(&pieces.all).map(|(number, &Piece { view, first_row })| {
        let end_row = (first_row + pieces.rows).min(cameras[view].size_px.y);
        let rows = first_row | end_row << 16;
        let view_camera = GpuViewCamera { number, rows, ..GpuViewCamera::of(&cameras[view], view as u32) };
        let work = GpuViewWork { view: view_camera, volume, tone: planes.tone.into() };
        [bytemuck::bytes_of(&work), bytemuck::cast_slice(&sorted[view])].concat()
    });
    device.gpu.buffer_with("views", &uniform_elements(works), BufferUsages::UNIFORM)
}

/// The sample cameras in the order of their distance from a place.
pub(crate) fn nearest_first(set: &SampleSet, place_in_world: Vec3) -> Vec<GpuSampleCamera> {
    let mut nearest_first = set.cameras.clone();
    nearest_first.sort_by(|a, b| {
        // Images that prove nothing everywhere are no use to march in.
        let [a_uncertain, b_uncertain] = [a, b].map(|c| set.uncertain[c.mask.trailing_zeros() as usize]);
        let [to_a, to_b] = [a, b].map(|c| Vec3::from(c.eye_in_world).distance_squared(place_in_world));
        a_uncertain.cmp(&b_uncertain).then(to_a.total_cmp(&to_b))
    });
    nearest_first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_every_row_once_and_slices_every_piece() {
        for (size_px, slice_px) in
            [([64, 48], 1), ([64, 48], 1024), ([33, 21], 600), ([1280, 720], 100_000), ([8, 8], 64)]
        {
            let size_px = UVec2::from(size_px);
            let pieces = Pieces::of(3, size_px, slice_px);
            let rows_of = |piece: &Piece| (size_px.y - piece.first_row).min(pieces.rows);
            let rows: u32 = pieces.all.iter().map(rows_of).sum();
            assert_eq!(rows, 3 * size_px.y);
            assert!(pieces.all.iter().all(|piece| piece.first_row % TILE_PX == 0));
            assert!(pieces.rows <= TILE_PX || u64::from(pieces.rows * size_px.x) <= slice_px.max(1), "{pieces:?}");
            let covered: Vec<u32> = pieces.slices().flatten().collect();
            assert_eq!(covered, (0..pieces.count() as u32).collect::<Vec<_>>());
        }
    }

    #[test]
    fn views_are_whole_and_together_where_nobody_watches() {
        let pieces = Pieces::of(5, UVec2::new(33, 21), u64::MAX);
        assert_eq!((pieces.count(), pieces.rows), (5, 21));
        assert_eq!(pieces.slices().collect::<Vec<_>>().len(), 1);
        assert_eq!(pieces.slices().next(), Some(0..5));
    }
}
