//! Merges quads into rectangles where no corner moves by more than a bound.

use glam::UVec2;
use gpu::{Binding, Frame, PassCache, ShaderVariant};
use minijinja::Value;

use super::cut::{self, GpuCutWork, ImageCut};
use crate::{error::ReconstructionError, error_bound::ErrorBound};

pub(super) const SHADER: (&str, &str) = ("merge.wgsl", include_str!("merge.wgsl"));

/// The greatest merged quad, across and down in texels: lines are merged in pieces of this length. Powers of two; more
/// would be too much for one thread of the software device, which ends loops after 65,535 turns.
pub(crate) const GREATEST_EXTENT: UVec2 = UVec2::new(64, 16);

/// `merge.wgsl`, which has no switches.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Merge;

impl ShaderVariant for Merge {
    const TEMPLATE: &'static str = SHADER.0;

    fn context(&self) -> Value {
        cut::context()
    }

    fn all() -> Vec<Self> {
        vec![Self]
    }
}

/// Rows into runs, then columns of equal runs into rectangles.
pub(crate) fn record(
    passes: &PassCache<Merge>,
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    bound: ErrorBound,
) -> Result<(), ReconstructionError> {
    let pass = passes.get(&Merge)?;
    for (axis, segment) in (0..).zip(GREATEST_EXTENT.to_array()) {
        let [length, lines] = [axis, 1 - axis].map(|axis| image.size_px[axis]);
        let work = GpuCutWork { axis: axis as u32, segment, bound_px: bound.px(), ..image.work() };
        let report = Binding::buffer("report", &image.report);
        let bindings = image.quad_bindings().into_iter().chain([report]);
        image.dispatch(frame, &pass, work, bindings, [lines, length.div_ceil(segment)])?;
    }
    Ok(())
}
