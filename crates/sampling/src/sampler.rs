//! Sampling as a service of a device: all cameras of a request in one submission.

use std::sync::Arc;

use depth_image::{Camera, DepthImage};
use gpu::Gpu;
use render::{DrawWork, GpuScene, Lighting, Rasterizer, RenderError, SamplePlanes};

use crate::SamplingMethod;

/// Why samples could not be taken.
#[derive(Debug, thiserror::Error)]
pub enum SamplingError {
    /// A camera, the device, or a shader.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// What to sample.
pub struct SampleWork<'a> {
    /// From where.
    pub scene: &'a GpuScene,
    /// One image each.
    pub cameras: &'a [Camera],
    /// Which samples are taken.
    pub method: SamplingMethod,
    /// How surfaces are lit.
    pub lighting: Lighting,
    /// Which moment of an animated scene.
    pub scene_time_s: f32,
    /// Planes beside colour and depth.
    pub planes: SamplePlanes,
}

/// Takes samples; shares its pipelines with direct rendering.
pub struct Sampler {
    rasterizer: Arc<Rasterizer>,
}

impl Sampler {
    /// Makes a rasteriser of its own.
    ///
    /// # Errors
    /// When a shader is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, SamplingError> {
        Ok(Self::sharing(Arc::new(Rasterizer::new(gpu)?)))
    }

    /// Uses `rasterizer`.
    #[must_use]
    pub fn sharing(rasterizer: Arc<Rasterizer>) -> Self {
        Self { rasterizer }
    }

    /// One depth image a camera, in their order.
    ///
    /// # Errors
    /// A camera that is not valid, or the device.
    pub fn sample(&self, work: &SampleWork<'_>) -> Result<Vec<DepthImage>, SamplingError> {
        let draw = DrawWork { scene: work.scene, lighting: work.lighting, scene_time_s: work.scene_time_s };
        match work.method {
            SamplingMethod::Conventional => Ok(self.rasterizer.draw_depth_images(draw, work.cameras, work.planes)?),
        }
    }
}
