//! Xie's hybrid reconstruction: each sample a quad of its texel, corners shared with its neighbours, and rectangles
//! of quads merged where a surface is flat.

use std::sync::Arc;

use gpu::{Binding, Turn, shader_variant};

use crate::quads::{self, Cut, ErrorBound, Mesh, QuadVertices};
use crate::{device::Device, error::ReconstructionError, sample_set::SampleSet};

/// The greatest slope of a surface against a line of sight at a guessed corner: the tangent of 87.5°. Beyond, the
/// corner runs to infinity.
pub(crate) const GREATEST_SLOPE: f32 = 22.903_765;

shader_variant!(CutTexels, "hybrid_mesh.wgsl", &[]);

/// The set's mesh, cut when it is first asked for, and merged where that is flat within the bound.
pub(super) fn mesh(
    device: &Device,
    set: &SampleSet,
    merged: Option<ErrorBound>,
    turn: Turn,
) -> Result<Arc<Mesh>, ReconstructionError> {
    let planes = set.meshes.planes.as_ref();
    let planes = planes.map_err(|&(index, plane)| ReconstructionError::MissingPlane { index, plane })?;
    let cut = Cut { vertices: QuadVertices::AtTexelCorners, merged };
    quads::mesh(device, set, cut, turn, |frame, image| {
        let [depths, extents] = image.quad_bindings();
        let own = [depths, extents, Binding::texture("planes", &planes.texels)];
        image.dispatch(frame, &CutTexels, image.work(), &own, image.size_px.to_array())?;
        merged.map_or(Ok(()), |bound| quads::merge(frame, image, bound))
    })
}
