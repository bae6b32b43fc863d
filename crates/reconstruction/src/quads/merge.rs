//! Merges quads into rectangles where no corner moves by more than a bound.

use glam::UVec2;
use gpu::{Frame, shader_variant};

use super::cut::{GpuCutWork, ImageCut};
use super::mesh::ErrorBound;
use crate::error::ReconstructionError;

/// The greatest merged quad, across and down in texels: lines are merged in pieces of this length. Powers of two; more
/// would be too much for one thread of the software device, which ends loops after 65,535 turns.
pub(crate) const GREATEST_EXTENT: UVec2 = UVec2::new(64, 16);

shader_variant!(Merge, "merge.wgsl", &[]);

/// Rows into runs, then columns of equal runs into rectangles.
pub(crate) fn record(
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    bound: ErrorBound,
) -> Result<(), ReconstructionError> {
    for (axis, segment) in (0..).zip(GREATEST_EXTENT.to_array()) {
        let [length, lines] = [axis, 1 - axis].map(|axis| image.size_px[axis]);
        let work = GpuCutWork { axis: axis as u32, segment, bound_px: bound.px(), ..image.work() };
        image.dispatch(frame, &Merge, work, [lines, length.div_ceil(segment)])?;
    }
    Ok(())
}
