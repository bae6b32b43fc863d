//! Views on their way from the device.

use depth_image::{Provenance, View};
use gpu::{FrameResult, PooledBuffer, Readback, Submitted};

use crate::error::ReconstructionError;
use crate::recording::{Batch, Recording};
use crate::surface::SPLIT_SHIFT;

/// What is read back of a batch.
pub(crate) struct BatchViews {
    colors: Readback,
    inverse_depth: Option<Readback>,
    provenance: Option<Readback>,
    /// Lent until the device is done with it.
    batch: Batch,
}

/// Submits a recording, with read-backs of the planes that are asked for.
pub(crate) fn submit(recording: Recording<'_>) -> Result<(Submitted<'_>, BatchViews), ReconstructionError> {
    let Recording { device, mut frame, batch, .. } = recording;
    let bytes = batch.plane_bytes;
    let mut read =
        |plane: &PooledBuffer| frame.read_back(plane, 0..bytes, device.buffers.lend_host("view read-back", bytes));
    let colors = read(&batch.color);
    let inverse_depth = batch.planes.inverse_depth.then(|| read(&batch.inverse_depth_per_m));
    let provenance = batch.planes.provenance.then(|| read(&batch.provenance));
    Ok((frame.submit()?, BatchViews { colors, inverse_depth, provenance, batch }))
}

impl BatchViews {
    /// Appends the batch's views.
    pub fn unpack(self, result: &FrameResult, views: &mut Vec<View>) -> Result<(), ReconstructionError> {
        let Self { colors, inverse_depth, provenance, batch } = self;
        let size_px = batch.size_px;
        let pixels = size_px.element_product() as usize;
        let first = views.len();
        result.with(colors, |words: &[u32]| {
            let colors = words.chunks(pixels).take(batch.cameras.len()).map(rgb_bytes);
            views.extend(colors.map(|srgb8| View { size_px, srgb8, inverse_depth_per_m: None, provenance: None }));
        })?;
        let views = &mut views[first..];
        if let Some(plane) = inverse_depth {
            result.with(plane, |depths: &[f32]| {
                let planes = views.iter_mut().zip(depths.chunks(pixels));
                planes.for_each(|(view, depths)| view.inverse_depth_per_m = Some(depths.to_vec()));
            })?;
        }
        if let Some(plane) = provenance {
            result.with(plane, |words: &[u32]| {
                for (view, words) in views.iter_mut().zip(words.chunks(pixels)) {
                    // Without what stays on the device.
                    let words = words.iter().map(|word| Provenance(word & ((1 << SPLIT_SHIFT) - 1)));
                    view.provenance = Some(words.collect());
                }
            })?;
        }
        Ok(())
    }
}

fn rgb_bytes(rgba: &[u32]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(rgba.len() * 3);
    rgba.iter().for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()[..3]));
    bytes
}
