//! Lists the quads of an image in the order of their samples: counts those of each chunk, sums the counts up, and writes indices.

use gpu::{Frame, shader_variant};

use super::{cut::ImageCut, mesh::QuadVertices};
use crate::error::ReconstructionError;

shader_variant!(Count, "count.wgsl", &[]);
shader_variant!(Scan, "scan.wgsl", &[]);
shader_variant!(Indices(QuadVertices), "indices.wgsl", &[]);

/// Writes the indices and the arguments of the draw, and the number of quads before merging into the report.
pub(super) fn record(
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    vertices: QuadVertices,
) -> Result<(), ReconstructionError> {
    let chunks = image.chunks();
    image.dispatch(frame, &Count, image.work(), [chunks, 1])?;
    image.dispatch(frame, &Scan, image.work(), [1, 1])?;
    image.dispatch(frame, &Indices(vertices), image.work(), [chunks, 1])
}
