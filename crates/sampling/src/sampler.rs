//! Sampling as a service of a device: all cameras of a request in as few submissions as memory allows.

use std::sync::Arc;

use depth_image::{Camera, DepthImage};
use gpu::Gpu;
use render::{DrawWork, RenderError, Renderer, SamplePlanes};

use crate::{SamplingMethod, depth_peeling, non_redundant};

/// Why samples could not be taken.
#[derive(Debug, thiserror::Error)]
pub enum SamplingError {
    /// A camera, the device, or a shader.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Layers are peeled from one place.
    #[error("camera {index}: the layers of depth_peeling are taken by one camera, this is another")]
    Layer {
        /// Its place in the request.
        index: usize,
    },
}

/// What to sample.
#[derive(Clone, Copy)]
pub struct SampleWork<'a> {
    /// Of what, lit how.
    pub draw: DrawWork<'a>,
    /// One image each. What a later one leaves out depends on those before it.
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
        Ok(Self { renderer: Arc::new(renderer(gpu)?) })
    }

    /// Uses what [`renderer`] made.
    #[must_use]
    pub fn sharing(renderer: Arc<Renderer>) -> Self {
        Self { renderer }
    }

    /// One depth image a camera, in their order.
    ///
    /// # Errors
    /// A camera that is not valid or does not go with the method, or the device.
    pub fn sample(&self, work: &SampleWork<'_>) -> Result<Vec<DepthImage>, SamplingError> {
        let leave_out = match work.method {
            SamplingMethod::Conventional => {
                return Ok(self.renderer.draw_depth_images(work.draw, work.cameras, work.planes)?);
            }
            SamplingMethod::NonRedundant(redundancy) => non_redundant::test(redundancy),
            SamplingMethod::DepthPeeling { .. } => {
                depth_peeling::check(work.cameras)?;
                depth_peeling::TEST
            }
        };
        Ok(self.renderer.draw_depth_images_apart(work.draw, work.cameras, work.planes, leave_out)?)
    }
}

/// A renderer that knows this crate's tests of what images leave out.
///
/// # Errors
/// When a shader is broken.
pub fn renderer(gpu: &Arc<Gpu>) -> Result<Renderer, RenderError> {
    Renderer::with_tests(gpu, &crate::shaders())
}
