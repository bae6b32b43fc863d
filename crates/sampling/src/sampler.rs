//! Sampling as a service of a device: all cameras of a request in one submission.

use std::sync::Arc;

use depth_image::{Camera, DepthImage};
use gpu::Gpu;
use render::{DrawWork, RenderError, Renderer, SamplePlanes};

use crate::SamplingMethod;

/// Why samples could not be taken.
#[derive(Debug, thiserror::Error)]
pub enum SamplingError {
    /// A camera, the device, or a shader.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// What to sample.
#[derive(Clone, Copy)]
pub struct SampleWork<'a> {
    /// Of what, lit how.
    pub draw: DrawWork<'a>,
    /// One image each.
    pub cameras: &'a [Camera],
    /// Which samples are taken.
    pub method: SamplingMethod,
    /// Planes beside colour and depth.
    pub planes: SamplePlanes,
}

/// Takes samples; shares its pipelines with direct rendering.
pub struct Sampler {
    renderer: Arc<Renderer>,
}

impl Sampler {
    /// Makes a renderer of its own.
    ///
    /// # Errors
    /// When a shader is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, SamplingError> {
        Ok(Self::sharing(Arc::new(Renderer::new(gpu)?)))
    }

    /// Uses `renderer`.
    #[must_use]
    pub fn sharing(renderer: Arc<Renderer>) -> Self {
        Self { renderer }
    }

    /// One depth image a camera, in their order.
    ///
    /// # Errors
    /// A camera that is not valid, or the device.
    pub fn sample(&self, work: &SampleWork<'_>) -> Result<Vec<DepthImage>, SamplingError> {
        match work.method {
            SamplingMethod::Conventional => {
                Ok(self.renderer.draw_depth_images(work.draw, work.cameras, work.planes)?)
            }
        }
    }
}
