//! Mirror images of the scene in views: rays off the mirrors of a picture are followed, the points where they end are lit,
//! and their light is added to the pixels. Mirrors among those points send rays on.

pub(crate) mod bounces;
mod follow;
mod land;
mod spawn;

use std::ops::Range;

use gpu::{BufferPool, Gpu, PooledBuffer};

pub(crate) use follow::Follow;
pub(crate) use land::Land;
pub(crate) use spawn::Spawn;

use self::bounces::{BounceList, GpuBounce, Rays};
use crate::batch::{Batch, Part, Recording};
use crate::pieces::Piece;
use crate::surfaces::Surfaces;
use crate::{RenderError, illuminate};

/// The pixels of a piece of a picture with mirrors: bounds the memory for rays.
pub(crate) const PIXELS_A_PIECE: u64 = 1 << 18;

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
        let pixels = |piece: &Piece| (piece.end_row - piece.first_row) * batch.cameras[piece.camera].size_px().x;
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
        let units = units(recording, piece);
        let first = BounceList::new(recording.gpu);
        let next = (&*self.bounces[0], &first);
        spawn::record(recording, &self.reflected, (element, piece, units), target, next)?;
        let mut listed = Some(first);
        for generation in 1..=generations {
            let Some(list) = listed else { break };
            let [from, to] = if generation % 2 == 1 { [0, 1] } else { [1, 0] };
            let rays = Rays { bounces: &self.bounces[from], list: &list, units, generation };
            follow::record(recording, rays)?;
            illuminate::record_points(recording, parts, rays, &self.sums)?;
            let next = (generation < generations).then(|| BounceList::new(recording.gpu));
            let onward = next.as_ref().map(|next| (&*self.bounces[to], next));
            land::record(recording, [&parts[0].cameras, &self.sums, &self.reflected], rays, onward)?;
            listed = next;
        }
        Ok(())
    }
}

fn units(recording: &Recording<'_>, piece: Piece) -> u64 {
    let width_px = recording.batch.cameras[piece.camera].size_px().x;
    u64::from(width_px) * u64::from(piece.end_row - piece.first_row)
}
