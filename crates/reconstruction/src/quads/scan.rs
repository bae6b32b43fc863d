//! Turns counts of chunks into the places where their quads begin.

use gpu::{Binding, Frame, shader_variant};

use super::cut::ImageCut;
use crate::error::ReconstructionError;

shader_variant!(Scan, "scan.wgsl", &[]);

/// One workgroup writes places over `counts`, and the arguments of the draw.
pub(super) fn record(
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    counts: &wgpu::Buffer,
) -> Result<(), ReconstructionError> {
    let own = [Binding::buffer("counts", counts), Binding::buffer("draw", &image.quads.draw)];
    image.dispatch(frame, &Scan, image.work(), &own, [1, 1])
}
