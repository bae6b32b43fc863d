//! Gives the pixels of drawn views their colour.

use gpu::shader_variant;

use super::draw::{self, QuadDrawing};
use super::mesh::Mesh;
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording, surface};

shader_variant!(Resolve(SetVariant), "resolve.wgsl", ONE_VIEW);

/// Draws a mesh into all views and gives pixels their colour; gives the pixels that stay unknown.
pub(crate) fn record(
    drawing: &QuadDrawing,
    recording: &mut Recording<'_>,
    mesh: Option<&Mesh>,
) -> Result<PixelList, ReconstructionError> {
    let mesh = mesh.expect("methods that draw are handed their mesh");
    draw::record(drawing, recording, mesh)?;
    let resolve = Resolve(recording.set.variant());
    surface::record(recording, &resolve, None, &[])
}
