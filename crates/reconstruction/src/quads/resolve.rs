//! Gives the pixels of drawn views their colour.

use gpu::{PassCache, ResourceTraits, ShaderVariant};
use minijinja::Value;

use super::draw::Targets;
use crate::{
    error::ReconstructionError,
    pixel_list::PixelList,
    recording::Recording,
    surface::{self, SurfaceVariant},
    view_work::ONE_VIEW,
};

pub(super) const SHADER: (&str, &str) = ("resolve.wgsl", include_str!("resolve.wgsl"));

/// The switches of `resolve.wgsl`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Resolve(SurfaceVariant);

impl ShaderVariant for Resolve {
    const TEMPLATE: &'static str = SHADER.0;
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        self.0.context()
    }

    fn all() -> Vec<Self> {
        SurfaceVariant::all().into_iter().map(Self).collect()
    }
}

/// Gives the pixels that stay unknown.
pub(super) fn record(
    passes: &PassCache<Resolve>,
    recording: &mut Recording<'_>,
    drawn: &Targets,
) -> Result<PixelList, ReconstructionError> {
    let pass = passes.get(&Resolve(SurfaceVariant::of(recording)))?;
    let unknown = recording.lend_list();
    let bound = pass.bind(0, surface::bindings(recording, &unknown).into_iter().chain(drawn.bindings()))?;
    recording.dispatch_pixels(&pass, &bound);
    Ok(unknown)
}
