//! Views on their way from the device.

use depth_image::{Provenance, View};
use glam::UVec2;
use gpu::{Readback, Submitted};

use super::{Batch, Statistics};
use crate::ReconstructionError;

/// One batch on its way.
pub(super) struct InFlight<'g> {
    pub(super) submitted: Submitted<'g>,
    pub(super) reads: Reads,
    pub(super) size_px: UVec2,
    pub(super) count: usize,
    /// Lent until the device is done with it.
    pub(super) _batch: Batch,
}

#[derive(Clone, Copy)]
pub(super) struct Reads {
    pub(super) srgb8: Readback,
    pub(super) inverse_depth: Option<Readback>,
    pub(super) provenance: Option<Readback>,
    pub(super) fetches: Option<Readback>,
}

impl InFlight<'_> {
    pub(super) fn finish(self, views: &mut Vec<View>, statistics: &mut Statistics) -> Result<(), ReconstructionError> {
        let result = self.submitted.wait()?;
        statistics.device_s += result.device_s;
        let pixels = self.size_px.element_product() as usize;
        let planes = |readback: Readback| {
            result.with(readback, |words: &[u32]| {
                words.chunks(pixels).take(self.count).map(<[u32]>::to_vec).collect::<Vec<_>>()
            })
        };
        let mut rgb = result
            .with(self.reads.srgb8, |words: &[u32]| {
                words.chunks(pixels).take(self.count).map(rgb_bytes).collect::<Vec<_>>()
            })?
            .into_iter();
        let mut depths = self.reads.inverse_depth.map(planes).transpose()?.unwrap_or_default().into_iter();
        let mut provenances = self.reads.provenance.map(planes).transpose()?.unwrap_or_default().into_iter();
        if let Some(readback) = self.reads.fetches {
            let sum: f64 = result
                .with(readback, |words: &[u32]| words[..pixels * self.count].iter().map(|&n| f64::from(n)).sum())?;
            *statistics.fetches_per_ray.get_or_insert(0.0) += sum / pixels as f64;
        }
        views.extend((0..self.count).map(|_| View {
            size_px: self.size_px,
            srgb8: rgb.next().unwrap_or_default(),
            inverse_depth_per_m: depths.next().map(bytemuck::cast_vec),
            provenance: provenances.next().map(|words| words.into_iter().map(Provenance).collect()),
        }));
        Ok(())
    }
}

fn rgb_bytes(rgba: &[u32]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(rgba.len() * 3);
    bytes.extend(rgba.iter().flat_map(|word| {
        let [r, g, b, _] = word.to_le_bytes();
        [r, g, b]
    }));
    bytes
}
