//! The conventional mesh: a quad between each four neighbouring samples of one surface.

use std::sync::Arc;

use gpu::{Binding, Turn, shader_variant};

use crate::quads::{self, Cut, Mesh, QuadVertices};
use crate::{device::Device, error::ReconstructionError, sample_set::SampleSet};

const CUT: Cut = Cut { vertices: QuadVertices::AtSamples, merged: None };

shader_variant!(CutBetweenSamples, "mesh.wgsl", &[]);

/// The set's mesh, cut when it is first asked for.
pub(super) fn mesh(device: &Device, set: &SampleSet, turn: Turn) -> Result<Arc<Mesh>, ReconstructionError> {
    quads::mesh(device, set, CUT, turn, |frame, image| {
        let [depths, extents] = image.quad_bindings();
        let own = [depths, extents, Binding::texture("cell_codes", &set.cell_codes)];
        image.dispatch(frame, &CutBetweenSamples, image.work(), &own, image.size_px.to_array())
    })
}
