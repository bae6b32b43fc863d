//! Keeps the samples of an image for redundancy tests of those after it.

use gpu::{Binding, ShaderVariant};
use minijinja::{Value, context};

use crate::{RenderError, batch::Recording, surfaces::Surfaces};

#[derive(Debug)]
pub(crate) struct Keep {
    by_rays: bool,
}

impl ShaderVariant for Keep {
    const TEMPLATE: &'static str = "keep.wgsl";

    fn context(&self) -> Value {
        context! { by_rays => self.by_rays, single_pole => false }
    }

    fn all() -> Vec<Self> {
        vec![Self { by_rays: false }, Self { by_rays: true }]
    }
}

/// Records the pass of one image, whose camera is the `camera`-th of the batch, into a layer of known samples.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    camera: usize,
    target: &Surfaces,
    held: &wgpu::TextureView,
) -> Result<(), RenderError> {
    let own = [Binding::texture("held", held)].into_iter().chain(target.bindings());
    let bound = recording.bind(&Keep { by_rays: recording.batch.by_rays }, (), own)?;
    recording.dispatch(&bound, camera);
    Ok(())
}
