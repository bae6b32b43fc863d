//! Counts the quads of each chunk of samples.

use gpu::{Binding, Frame, PassCache, ShaderVariant};
use minijinja::Value;

use super::cut::{self, ImageCut};
use crate::error::ReconstructionError;

pub(super) const SHADER: (&str, &str) = ("count.wgsl", include_str!("count.wgsl"));

/// `count.wgsl`, which has no switches.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Count;

impl ShaderVariant for Count {
    const TEMPLATE: &'static str = SHADER.0;

    fn context(&self) -> Value {
        cut::context()
    }

    fn all() -> Vec<Self> {
        vec![Self]
    }
}

pub(super) fn record(
    passes: &PassCache<Count>,
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    counts: &wgpu::Buffer,
) -> Result<(), ReconstructionError> {
    let bindings = [
        Binding::buffer("extents", &image.extents),
        Binding::buffer("counts", counts),
        Binding::buffer("report", &image.report),
    ];
    image.dispatch(frame, &*passes.get(&Count)?, image.work(), bindings, [image.chunks(), 1])
}
