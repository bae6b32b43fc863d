//! The surfaces where mirrored rays end.

use gpu::ShaderVariant;
use minijinja::Value;

use super::bounces::Rays;
use crate::{RenderError, batch::Recording, rays::Traversal};

#[derive(Debug)]
pub(crate) struct Follow {
    traversal: Traversal,
}

impl ShaderVariant for Follow {
    const TEMPLATE: &'static str = "reflections/follow.wgsl";

    fn context(&self) -> Value {
        self.traversal.context_of_mirrored_rays()
    }

    fn all() -> Vec<Self> {
        Traversal::ALL.map(|traversal| Self { traversal }).into()
    }
}

/// Records the pass over the rays off one mirror.
pub(super) fn record(recording: &mut Recording<'_>, rays: &Rays) -> Result<(), RenderError> {
    let Some(traced) = recording.batch.traced.as_deref() else { return Ok(()) };
    let bound = recording.bind(&Follow { traversal: traced.traversal }, rays.generation, rays.bindings())?;
    rays.dispatch(recording, &bound);
    Ok(())
}
