//! The conventional mesh: a quad between each four neighbouring samples of one surface.

use std::sync::Arc;

use gpu::{Binding, PassCache, ShaderVariant};
use minijinja::Value;

use crate::{
    device::Device,
    error::ReconstructionError,
    pixel_list::PixelList,
    quads::{self, Cut, Mesh, QuadPasses, QuadVertices},
    recording::Recording,
    sample_set::SampleSet,
};

pub(super) const SHADER: (&str, &str) = ("mesh.wgsl", include_str!("mesh.wgsl"));

const CUT: Cut = Cut { vertices: QuadVertices::AtSamples, merged: None };

/// `mesh.wgsl`, which has no switches.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct CutBetweenSamples;

impl ShaderVariant for CutBetweenSamples {
    const TEMPLATE: &'static str = SHADER.0;

    fn context(&self) -> Value {
        quads::context()
    }

    fn all() -> Vec<Self> {
        vec![Self]
    }
}

/// Gives the pixels that stay unknown.
pub(super) fn record(
    passes: &PassCache<CutBetweenSamples>,
    quads: &QuadPasses,
    recording: &mut Recording<'_>,
) -> Result<PixelList, ReconstructionError> {
    quads.record(recording, &*mesh(passes, quads, recording.device, recording.set)?)
}

/// The set's mesh, cut when it is first asked for.
pub(super) fn mesh(
    passes: &PassCache<CutBetweenSamples>,
    quads: &QuadPasses,
    device: &Device,
    set: &SampleSet,
) -> Result<Arc<Mesh>, ReconstructionError> {
    set.meshes.get_or_make(CUT, || {
        let pass = passes.get(&CutBetweenSamples)?;
        quads::build(quads, device, set, CUT, |frame, image| {
            let codes = Binding::texture("cell_codes", &set.cell_codes);
            let bindings = image.quad_bindings().into_iter().chain([codes]);
            image.dispatch(frame, &pass, image.work(), bindings, image.size_px.to_array())
        })
    })
}
