//! Lists the quads of an image in the order of their samples.

use gpu::{Binding, Frame, shader_variant};

use super::{cut::ImageCut, mesh::QuadVertices};
use crate::error::ReconstructionError;

shader_variant!(Indices(QuadVertices), "indices.wgsl", &[]);

/// `places`: where the quads of each chunk begin.
pub(super) fn record(
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    places: &wgpu::Buffer,
    vertices: QuadVertices,
) -> Result<(), ReconstructionError> {
    let own = [
        Binding::buffer("extents", &image.extents),
        Binding::buffer("places", places),
        Binding::buffer("indices", &image.quads.indices),
    ];
    image.dispatch(frame, &Indices(vertices), image.work(), &own, [image.chunks(), 1])
}
