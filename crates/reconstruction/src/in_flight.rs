//! Views on their way from the device.

use depth_image::{Provenance, View};
use gpu::{FrameResult, PooledBuffer, Readback, Submitted};

use crate::error::ReconstructionError;
use crate::recording::{Batch, Recording};
use crate::surface::SPLIT_SHIFT;

/// A submitted batch.
pub(crate) struct InFlight<'g> {
    submitted: Submitted<'g>,
    views: BatchViews,
}

/// What is read back of a batch.
pub(crate) struct BatchViews {
    colors: Readback,
    inverse_depth: Option<Readback>,
    provenance: Option<Readback>,
    /// Lent until the device is done with it.
    batch: Batch,
}

impl<'g> InFlight<'g> {
    /// Submits a recording, with read-backs of the planes that are asked for.
    pub fn submit(recording: Recording<'g>) -> Result<Self, ReconstructionError> {
        let Recording { device, mut frame, batch, .. } = recording;
        let bytes = batch.plane_bytes;
        let mut read =
            |plane: &PooledBuffer| frame.read_back(plane, 0..bytes, device.buffers.lend_host("view read-back", bytes));
        let colors = read(&batch.color);
        let inverse_depth = batch.planes.inverse_depth.then(|| read(&batch.inverse_depth_per_m));
        let provenance = batch.planes.provenance.then(|| read(&batch.provenance));
        Ok(Self { submitted: frame.submit()?, views: BatchViews { colors, inverse_depth, provenance, batch } })
    }

    /// Waits until the device is free of it.
    pub fn wait(self) -> Result<(FrameResult, BatchViews), ReconstructionError> {
        Ok((self.submitted.wait()?, self.views))
    }
}

impl BatchViews {
    /// Appends the batch's views.
    pub fn unpack(self, result: &FrameResult, views: &mut Vec<View>) -> Result<(), ReconstructionError> {
        let Self { colors, inverse_depth, provenance, batch } = self;
        let rgb = each_view(result, colors, &batch, rgb_bytes)?;
        let [depths, provenances] = [inverse_depth, provenance].map(|plane| match plane {
            Some(plane) => each_view(result, plane, &batch, <[u32]>::to_vec),
            None => Ok(Vec::new()),
        });
        let mut depths = depths?.into_iter();
        let mut provenances = provenances?.into_iter();
        views.extend(rgb.into_iter().map(|srgb8| {
            View {
                size_px: batch.size_px,
                srgb8,
                inverse_depth_per_m: depths.next().map(bytemuck::cast_vec),
                // Without what stays on the device.
                provenance: provenances
                    .next()
                    .map(|words| words.into_iter().map(|word| Provenance(word & ((1 << SPLIT_SHIFT) - 1))).collect()),
            }
        }));
        Ok(())
    }
}

/// A plane of each view.
fn each_view<T>(
    result: &FrameResult,
    readback: Readback,
    batch: &Batch,
    plane: impl Fn(&[u32]) -> T,
) -> Result<Vec<T>, gpu::GpuError> {
    let pixels = batch.size_px.element_product() as usize;
    result.with(readback, |words: &[u32]| words.chunks(pixels).take(batch.cameras.len()).map(plane).collect())
}

fn rgb_bytes(rgba: &[u32]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(rgba.len() * 3);
    rgba.iter().for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()[..3]));
    bytes
}
