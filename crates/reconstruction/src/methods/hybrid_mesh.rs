//! Xie's hybrid reconstruction: each sample a quad of its texel, corners shared with its neighbours, and rectangles
//! of quads merged where a surface is flat.

use std::sync::Arc;

use gpu::{Binding, Gpu, PassCache, ShaderVariant, Templates, WgslLiteral as _};
use minijinja::{Value, context};

use crate::{
    device::Device,
    error::ReconstructionError,
    error_bound::ErrorBound,
    pixel_list::PixelList,
    pyramid::{FLAT_FOOTPRINTS, SLOPE_SHARE},
    quads::{self, CornerPlanes, Cut, Merge, Mesh, QuadPasses, QuadVertices},
    recording::Recording,
    required_planes::RequiredPlanes,
    sample_set::SampleSet,
};

pub(super) const SHADER: (&str, &str) = ("hybrid_mesh.wgsl", include_str!("hybrid_mesh.wgsl"));

pub(super) const REQUIRED_PLANES: RequiredPlanes = CornerPlanes::REQUIRED;

/// The greatest slope of a surface against a line of sight at a guessed corner: the tangent of 87.5°. Beyond, the
/// corner runs to infinity.
pub(crate) const GREATEST_SLOPE: f32 = 22.903_765;

/// `hybrid_mesh.wgsl`, which has no switches.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct CutTexels;

impl ShaderVariant for CutTexels {
    const TEMPLATE: &'static str = SHADER.0;

    fn context(&self) -> Value {
        context! {
            flat_footprints => FLAT_FOOTPRINTS.wgsl_literal(),
            slope_share => SLOPE_SHARE.wgsl_literal(),
            greatest_slope => GREATEST_SLOPE.wgsl_literal(),
            ..quads::context()
        }
    }

    fn all() -> Vec<Self> {
        vec![Self]
    }
}

pub(super) struct HybridPasses {
    cut: PassCache<CutTexels>,
    merge: PassCache<Merge>,
}

impl HybridPasses {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { cut: PassCache::new(gpu, templates), merge: PassCache::new(gpu, templates) }
    }
}

pub(super) fn parse_bound(text: &str) -> Option<ErrorBound> {
    text.parse().ok().and_then(ErrorBound::from_px)
}

/// Gives the pixels that stay unknown.
pub(super) fn record(
    passes: &HybridPasses,
    quads: &QuadPasses,
    recording: &mut Recording<'_>,
    merged: Option<ErrorBound>,
) -> Result<PixelList, ReconstructionError> {
    quads.record(recording, &*mesh(passes, quads, recording.device, recording.set, merged)?)
}

/// The set's mesh, cut when it is first asked for, and merged where that is flat within the bound.
pub(super) fn mesh(
    passes: &HybridPasses,
    quads: &QuadPasses,
    device: &Device,
    set: &SampleSet,
    merged: Option<ErrorBound>,
) -> Result<Arc<Mesh>, ReconstructionError> {
    let planes = set.meshes.planes.as_ref();
    let planes = planes.map_err(|&(index, plane)| ReconstructionError::MissingPlane { index, plane })?;
    let cut = Cut { vertices: QuadVertices::AtTexelCorners, merged };
    set.meshes.get_or_make(cut, || {
        let pass = passes.cut.get(&CutTexels)?;
        quads::build(quads, device, set, cut, |frame, image| {
            let bindings = image.quad_bindings().into_iter().chain([Binding::texture("planes", &planes.texels)]);
            image.dispatch(frame, &pass, image.work(), bindings, image.size_px.to_array())?;
            merged.map_or(Ok(()), |bound| quads::merge(&passes.merge, frame, image, bound))
        })
    })
}
