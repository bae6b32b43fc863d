//! Turns counts of chunks into the places where their quads begin.

use gpu::{Binding, Frame, PassCache, ShaderVariant};
use minijinja::Value;

use super::cut::{self, ImageCut};
use crate::error::ReconstructionError;

pub(super) const SHADER: (&str, &str) = ("scan.wgsl", include_str!("scan.wgsl"));

/// `scan.wgsl`, which has no switches.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Scan;

impl ShaderVariant for Scan {
    const TEMPLATE: &'static str = SHADER.0;

    fn context(&self) -> Value {
        cut::context()
    }

    fn all() -> Vec<Self> {
        vec![Self]
    }
}

/// One workgroup writes places over `counts`, and the arguments of the draw.
pub(super) fn record(
    passes: &PassCache<Scan>,
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    counts: &wgpu::Buffer,
) -> Result<(), ReconstructionError> {
    let bindings = [Binding::buffer("counts", counts), Binding::buffer("draw", &image.quads.draw)];
    image.dispatch(frame, &*passes.get(&Scan)?, image.work(), bindings, [1, 1])
}
