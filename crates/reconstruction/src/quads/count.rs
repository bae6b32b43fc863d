//! Counts the quads of each chunk of samples.

use gpu::{Binding, Frame, shader_variant};

use super::cut::ImageCut;
use crate::error::ReconstructionError;

shader_variant!(Count, "count.wgsl", &[]);

/// Writes the counts that `scan.wgsl` reads, and their sum before merging into the report.
pub(super) fn record(
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    counts: &wgpu::Buffer,
) -> Result<(), ReconstructionError> {
    let own = [
        Binding::buffer("extents", &image.extents),
        Binding::buffer("counts", counts),
        Binding::buffer("report", &image.report),
    ];
    image.dispatch(frame, &Count, image.work(), &own, [image.chunks(), 1])
}
