//! Lists the quads of an image in the order of their samples: counts those of each chunk, sums the counts up, and writes indices.

use gpu::{Binding, Frame, shader_variant};

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
    let counts = image.device.buffers.lend_storage("quads of chunks", 4 * u64::from(chunks));
    let extents = Binding::buffer("extents", &image.extents);
    let own = [extents.clone(), Binding::buffer("counts", &counts), Binding::buffer("report", &image.report)];
    image.dispatch(frame, &Count, image.work(), &own, [chunks, 1])?;
    let own = [Binding::buffer("counts", &counts), Binding::buffer("draw", &image.quads.draw)];
    image.dispatch(frame, &Scan, image.work(), &own, [1, 1])?;
    // The counts have become the places where the quads of each chunk begin.
    let own = [extents, Binding::buffer("places", &counts), Binding::buffer("indices", &image.quads.indices)];
    image.dispatch(frame, &Indices(vertices), image.work(), &own, [chunks, 1])
}
