//! Mirror images of the scene in views, and what is seen through glass: rays off the mirrors of a picture, into the lobes of glossy
//! surfaces, and of the eye through glass, are followed, the points where they end are lit, and their light is added to the pixels.
//! Mirrors among those points send rays on.

pub(crate) mod bounces;
mod follow;
mod land;
pub(crate) mod lobe;
mod look_through;
pub(crate) mod radiance;
mod spawn;

use depth_image::MAX_REFLECTIONS;
use gpu::{BufferPool, Gpu, PooledBuffer};

pub(crate) use follow::Follow;
pub(crate) use land::Land;
pub(crate) use lobe::Lobe;
pub(crate) use look_through::{LookThrough, MOST_INTERFACES};
pub(crate) use spawn::Spawn;

use self::bounces::{GpuBounce, Rays};
use crate::batch::{Batch, Part, Recording};
use crate::pieces::Piece;
use crate::surfaces::Surfaces;
use crate::{RenderError, illuminate};

/// The pixels of a piece of a picture with mirrors or glass: bounds the memory for rays.
pub(crate) const PIXELS_A_PIECE: u64 = 1 << 18;

/// The memory for the mirror images of a batch, and for what it shows through glass: light for each pixel, and rays for one piece.
pub(crate) struct Reflections {
    /// Linear light, red, green and blue of each pixel.
    pub reflected: PooledBuffer,
    /// Rays and the points where they end: of one mirror, and of the next.
    bounces: [PooledBuffer; 2],
    /// The weights of all rays into the lobe of each pixel together.
    lobe_weights: PooledBuffer,
    /// The light at the ends, as `sums.wgsl` has it.
    sums: PooledBuffer,
    /// Rays that there is room for.
    capacity: u32,
}

impl Reflections {
    /// Memory for `capacity` rays, and for planes of `plane_bytes` each.
    ///
    /// # Errors
    /// More memory than the device binds.
    pub fn lend(
        gpu: &Gpu,
        pool: &BufferPool,
        batch: &Batch<'_>,
        capacity: u32,
        plane_bytes: u64,
    ) -> Result<Self, RenderError> {
        let lend = |label, bytes| {
            gpu.check_storage_bytes(label, bytes)?;
            Ok::<_, RenderError>(pool.lend_storage(label, bytes))
        };
        let lobe_bytes = if batch.output.glossy { plane_bytes } else { 4 };
        let rays_bytes = size_of::<GpuBounce>() as u64 * u64::from(capacity);
        Ok(Self {
            reflected: lend("mirrored light", 3 * plane_bytes)?,
            bounces: [lend("mirrored rays", rays_bytes)?, lend("mirrored rays", rays_bytes)?],
            lobe_weights: lend("weights of lobes", lobe_bytes)?,
            sums: lend("light of mirrored points", 4 * u64::from(capacity) * batch.output.sums.count() as u64)?,
            capacity,
        })
    }

    /// Records the mirror images of all pictures at one position within their pixels.
    ///
    /// # Errors
    /// A pass cannot be made.
    pub fn record(&self, recording: &mut Recording<'_>, surfaces: &[Surfaces]) -> Result<(), RenderError> {
        let batch = recording.batch;
        recording.frame.encoder.clear_buffer(&self.reflected, 0, None);
        // Light that is refined is summed up for pixels alone: mirrored points have the same rays anew.
        let rays = recording.sums.rays.each_ref().map(|rays| 0..rays.end);
        let parts = batch.parts_of_points(recording.gpu, &rays, self.capacity);
        for (camera, target) in surfaces.iter().enumerate() {
            for piece in recording.pieces_of(camera) {
                self.record_piece(recording, &parts, piece, target)?;
            }
        }
        Ok(())
    }

    /// Rays through glass, rays off mirrors, then of each pixel's lobe one after another: the memory is that of one ray a pixel.
    fn record_piece(
        &self,
        recording: &mut Recording<'_>,
        parts: &[Part],
        piece: Piece,
        target: &Surfaces,
    ) -> Result<(), RenderError> {
        let mirrors = recording.batch.work.lighting.reflections();
        if recording.batch.output.glass {
            let first = self.rays(recording.gpu, piece.pixel_count(), 0);
            look_through::record(recording, piece, target, &first)?;
            self.record_rays(recording, parts, first, mirrors)?;
        }
        if mirrors > 0 {
            let first = self.rays(recording.gpu, piece.pixel_count(), 1);
            spawn::record(recording, piece, target, &first)?;
            self.record_rays(recording, parts, first, mirrors)?;
        }
        for ray in 0..recording.batch.glossy_rays() {
            // Costs are learned by generation, and are others than those of rays off mirrors.
            let first = self.rays(recording.gpu, piece.pixel_count(), MAX_REFLECTIONS + 1);
            lobe::record(recording, ray, &self.lobe_weights, piece, target, &first)?;
            self.record_rays(recording, parts, first, MAX_REFLECTIONS + mirrors.max(1))?;
        }
        Ok(())
    }

    /// An empty list. Generations take turns in two memories.
    fn rays(&self, gpu: &Gpu, units: u32, generation: u32) -> Rays {
        Rays::new(gpu, &self.bounces[generation as usize % 2], units, generation)
    }

    /// Mirror after mirror: rays are followed, their ends are lit, and what is seen there is added to the pixels, up to the `last`
    /// generation.
    fn record_rays(
        &self,
        recording: &mut Recording<'_>,
        parts: &[Part],
        first: Rays,
        last: u32,
    ) -> Result<(), RenderError> {
        let mut next = Some(first);
        while let Some(rays) = next {
            follow::record(recording, &rays)?;
            next = self.record_ends(recording, parts, &rays, last)?;
        }
        Ok(())
    }

    /// Lights the ends of rays, and adds what they send to the pixels. Gives the rays off mirrors among them, unless these rays are the
    /// `last` generation.
    fn record_ends(
        &self,
        recording: &mut Recording<'_>,
        parts: &[Part],
        ends: &Rays,
        last: u32,
    ) -> Result<Option<Rays>, RenderError> {
        illuminate::record_points(recording, parts, ends, &self.sums)?;
        let next = (ends.generation < last).then(|| self.rays(recording.gpu, ends.units, ends.generation + 1));
        land::record(recording, [&parts[0].cameras, &self.sums, &self.reflected], ends, next.as_ref())?;
        Ok(next)
    }
}
