//! The light that listed surfaces send towards one direction each, with what their mirrors show.

use glam::Vec3;

use super::Reflections;
use super::bounces::{GpuBounce, Rays};
use crate::batch::Batch;
use crate::planes::Output;
use crate::{RenderError, stages::Stages, work::DrawWork};

/// Surfaces that are lit together: bounds their memory.
const POINTS_A_LIST: usize = 1 << 17;

/// Surfaces to be lit, as the ends of rays that come from where their light goes.
pub(crate) struct RadianceWork<'a> {
    stages: &'a Stages,
    batch: Batch<'a>,
    points: Vec<GpuBounce>,
    /// Linear radiance of the points before.
    lit: Vec<Vec3>,
}

impl<'a> RadianceWork<'a> {
    /// No surfaces as yet. The lighting has shadows.
    pub fn of(stages: &'a Stages, work: DrawWork<'a>) -> Result<Self, RenderError> {
        let traced = Some(work.scene.rays.at(work.scene_time_s)?);
        let batch = Batch { traced, ..Batch::new(work, Output { mirrors: true, ..Output::of(work, true) }) };
        Ok(Self { stages, batch, points: Vec::new(), lit: Vec::new() })
    }

    /// Adds surfaces; lights those that are listed once there are enough of them.
    pub fn add(&mut self, points: impl Iterator<Item = GpuBounce>) -> Result<(), RenderError> {
        for point in points {
            let place = self.points.len() as u32;
            self.points.push(GpuBounce { place, throughput_linear: [1.0; 3], met: 1, ..point });
            if self.points.len() == POINTS_A_LIST {
                self.light()?;
            }
        }
        Ok(())
    }

    /// The radiance of all surfaces, in the order in which they were added.
    pub fn finish(mut self) -> Result<Vec<Vec3>, RenderError> {
        if !self.points.is_empty() {
            self.light()?;
        }
        Ok(self.lit)
    }

    fn light(&mut self) -> Result<(), RenderError> {
        let Self { stages, batch, points, lit } = self;
        let Stages { gpu, pool, batches, .. } = stages;
        let count = points.len() as u32;
        let plane_bytes = 4 * u64::from(count);
        let _one = batches.begin(batch.work.turn.class);
        let memory = Reflections::lend(gpu, pool, batch, count, plane_bytes)?;
        gpu.queue.write_buffer(&memory.bounces[0], 0, bytemuck::cast_slice(points));
        let ends = Rays::of_points(gpu, &memory.bounces[0], count, 0);
        let no_sums = pool.lend_storage("no sums", 4);
        let (mut recording, parts) =
            batch.record_points(&stages.gpu, &stages.passes, "light of a light field", no_sums, count);
        recording.frame.encoder.clear_buffer(&memory.reflected, 0, None);
        // Whoever gathers them has met one mirror before.
        let mirrors = batch.work.lighting.reflections().saturating_sub(1);
        if let Some(next) = memory.record_ends(&mut recording, &parts, &ends, mirrors)? {
            memory.record_rays(&mut recording, &parts, next, mirrors)?;
        }
        let mut frame = recording.frame;
        let read = frame.read_back(&memory.reflected, 0..3 * plane_bytes, pool.lend_host("radiance", 3 * plane_bytes));
        let result = frame.submit()?.wait()?;
        result.with(read, |linear: &[f32]| {
            lit.extend(linear.chunks_exact(3).take(points.len()).map(Vec3::from_slice));
        })?;
        points.clear();
        Ok(())
    }
}
