//! Keeps the samples of an image for redundancy tests of those after it.

use std::sync::Arc;

use gpu::{Binding, Frame, Gpu, PassCache, ResourceTraits, ShaderVariant, Templates};
use minijinja::{Value, context};

use crate::{RenderError, pixel_camera::CAMERA_TRAITS, surfaces::Surfaces};

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct KeepVariant {
    by_rays: bool,
}

impl ShaderVariant for KeepVariant {
    const TEMPLATE: &'static str = "keep.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        context! { by_rays => self.by_rays }
    }

    fn all() -> Vec<Self> {
        [false, true].map(|by_rays| Self { by_rays }).to_vec()
    }
}

pub(crate) struct Keep(PassCache);

impl Keep {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self(PassCache::new(gpu, templates))
    }

    /// Records the pass of one image, whose camera is the `element`-th of `cameras`, into a layer of known samples.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        (cameras, element): (&wgpu::Buffer, u32),
        (surfaces, by_rays): (&Surfaces, bool),
        held: &wgpu::TextureView,
    ) -> Result<(), RenderError> {
        let pass = self.0.get(&KeepVariant { by_rays })?;
        let own = [Binding::buffer("camera", cameras), Binding::texture("held", held)];
        let bound = pass.bind(0, own.into_iter().chain(surfaces.bindings()))?;
        pass.dispatch_each(frame, &[&bound], element..element + 1, surfaces.invocations(1));
        Ok(())
    }
}
