//! Mirror images of the scene in views: rays off the mirrors of a picture are followed, the points where they end are lit,
//! and their light is added to the pixels. Mirrors among those points send rays on.

mod follow;
mod land;
mod spawn;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use gpu::{Binding, BoundGroup, BufferPool, ComputePass, DispatchSize, Gpu, PooledBuffer, ShaderVariant, WorkKind};
use wgpu::{Buffer, BufferUsages};

pub(crate) use follow::Follow;
pub(crate) use land::Land;
pub(crate) use spawn::Spawn;

use crate::batch::{Batch, Part, Recording};
use crate::pieces::Piece;
use crate::surfaces::Surfaces;
use crate::{RenderError, illuminate};

/// The pixels of a piece of a picture with mirrors: bounds the memory for rays.
pub(crate) const PIXELS_A_PIECE: u64 = 1 << 18;

/// `Bounce` of `reflections/bounce.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuBounce {
    pub point_in_world: [f32; 3],
    pub place: u32,
    pub direction: [f32; 3],
    pub seed: u32,
    pub throughput_linear: [f32; 3],
    pub side_m: f32,
    pub surface: [u32; 4],
    pub bias_m: f32,
    pub spread: f32,
    pub roughness: f32,
    pub curvature_per_m: f32,
    pub met: u32,
    pub near_m: f32,
    pub padding: [u32; 2],
}

/// The memory for the mirror images of a batch: light for each pixel, and rays for one piece.
pub(crate) struct Reflections {
    /// Linear light, red, green and blue of each pixel.
    pub reflected: PooledBuffer,
    /// Rays and the points where they end: of one mirror, and of the next.
    bounces: [PooledBuffer; 2],
    /// The light at the ends, as `sums.wgsl` has it.
    sums: PooledBuffer,
    /// Rays that there is room for.
    capacity: u32,
}

/// The arguments of the dispatches over the rays of one piece off one mirror.
pub(crate) struct BounceList(Buffer);

impl BounceList {
    pub fn new(gpu: &Gpu) -> Self {
        // Workgroups along x, y and z, and the list's length.
        Self(gpu.buffer_with("mirrored rays", &[0u32, 1, 1, 0], BufferUsages::STORAGE | BufferUsages::INDIRECT))
    }

    pub fn size(&self) -> DispatchSize<'_> {
        DispatchSize::Indirect(&self.0, 0)
    }

    pub fn binding(&self, name: &'static str) -> Binding<'_> {
        Binding::buffer(name, &self.0)
    }
}

impl Reflections {
    /// Memory for the pictures of a batch; none where they have no mirrors.
    ///
    /// # Errors
    /// More memory than the device binds.
    pub fn lend(
        gpu: &Gpu,
        pool: &BufferPool,
        batch: &Batch<'_>,
        pieces: &[Piece],
    ) -> Result<Option<Self>, RenderError> {
        if !batch.output.mirrors {
            return Ok(None);
        }
        let pixels = |piece: &Piece| (piece.end_row - piece.first_row) * batch.cameras[piece.camera].size_px.x;
        let capacity = pieces.iter().map(pixels).max().unwrap_or(0).max(1);
        let lend = |label, bytes| {
            gpu.check_storage_bytes(label, bytes)?;
            Ok::<_, RenderError>(pool.lend_storage(label, bytes))
        };
        let rays_bytes = size_of::<GpuBounce>() as u64 * u64::from(capacity);
        Ok(Some(Self {
            reflected: lend("mirrored light", batch.bytes(3))?,
            bounces: [lend("mirrored rays", rays_bytes)?, lend("mirrored rays", rays_bytes)?],
            sums: lend("light of mirrored points", 4 * u64::from(capacity) * batch.output.sums.count() as u64)?,
            capacity,
        }))
    }

    /// Records the mirror images of all pictures at one position within their pixels.
    ///
    /// # Errors
    /// A pass cannot be made.
    pub fn record(&self, recording: &mut Recording<'_>, surfaces: &[Surfaces]) -> Result<(), RenderError> {
        let batch = recording.batch;
        // Light that is refined is summed up for pixels alone: mirrored points have the same rays anew.
        let rays = recording.sums.rays.clone().map(|rays| Range { start: 0, ..rays });
        let parts = batch.parts_of_points(recording.gpu, &rays, self.capacity);
        for (camera, target) in surfaces.iter().enumerate() {
            for (element, piece) in recording.pieces.of_camera(camera).collect::<Vec<_>>() {
                self.record_piece(recording, &parts, (element, piece), target)?;
            }
        }
        Ok(())
    }

    /// Mirror after mirror: rays are followed, their ends are lit, and what is seen there is added to the pixels.
    fn record_piece(
        &self,
        recording: &mut Recording<'_>,
        parts: &[Part],
        (element, piece): (u32, Piece),
        target: &Surfaces,
    ) -> Result<(), RenderError> {
        let generations = recording.batch.work.lighting.reflections();
        let mut list = BounceList::new(recording.gpu);
        spawn::record(recording, self, (element, piece), target, (&self.bounces[0], &list))?;
        for generation in 1..=generations {
            let [from, to] = if generation % 2 == 1 { [0, 1] } else { [1, 0] };
            let rays = Rays { bounces: &self.bounces[from], list: &list, units: units(recording, piece), generation };
            follow::record(recording, rays)?;
            illuminate::record_points(recording, parts, rays, &self.sums)?;
            let next = BounceList::new(recording.gpu);
            let onward = (generation < generations).then_some((&*self.bounces[to], &next));
            land::record(recording, self, &parts[0].cameras, rays, onward)?;
            list = next;
        }
        Ok(())
    }
}

/// The rays of a piece off one mirror.
#[derive(Clone, Copy)]
pub(crate) struct Rays<'r> {
    pub bounces: &'r Buffer,
    pub list: &'r BounceList,
    /// Pixels of the piece.
    pub units: u64,
    /// Mirrors on the way so far.
    pub generation: u32,
}

impl Rays<'_> {
    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("bounces", self.bounces), self.list.binding("list")]
    }

    /// Records a pass over them. `counts` are those of the rays of light that it traces.
    pub fn dispatch(
        &self,
        recording: &mut Recording<'_>,
        (variant, counts): (&impl ShaderVariant, [u32; 3]),
        pass: &ComputePass,
        groups: &[&BoundGroup],
    ) {
        pass.dispatch(&mut recording.frame, groups, self.list.size());
        // Each mirror on the way leaves fewer rays.
        let kind = WorkKind::new(recording.batch.family(), &(variant.name(), counts, self.generation));
        recording.frame.cut(kind, self.units);
    }
}

fn units(recording: &Recording<'_>, piece: Piece) -> u64 {
    let width_px = recording.batch.cameras[piece.camera].size_px.x;
    u64::from(width_px) * u64::from(piece.end_row - piece.first_row)
}
