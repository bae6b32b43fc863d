//! Lists the quads of an image in the order of their samples.

use gpu::{Binding, Frame, PassCache, ShaderVariant};
use minijinja::{Value, context};

use super::{
    cut::{self, ImageCut},
    mesh::QuadVertices,
};
use crate::error::ReconstructionError;

pub(super) const SHADER: (&str, &str) = ("indices.wgsl", include_str!("indices.wgsl"));

/// The switch of `indices.wgsl`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Indices(pub QuadVertices);

impl ShaderVariant for Indices {
    const TEMPLATE: &'static str = SHADER.0;

    fn context(&self) -> Value {
        context! { at_texel_corners => self.0.are_at_texel_corners(), ..cut::context() }
    }

    fn all() -> Vec<Self> {
        QuadVertices::ALL.map(Self).to_vec()
    }
}

/// `places`: where the quads of each chunk begin.
pub(super) fn record(
    passes: &PassCache<Indices>,
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    vertices: QuadVertices,
    places: &wgpu::Buffer,
) -> Result<(), ReconstructionError> {
    let bindings = [
        Binding::buffer("extents", &image.extents),
        Binding::buffer("places", places),
        Binding::buffer("indices", &image.quads.indices),
    ];
    image.dispatch(frame, &*passes.get(&Indices(vertices))?, image.work(), bindings, [image.chunks(), 1])
}
