//! Sampling as a service of a device: all cameras of a request in as few submissions as memory allows.

use std::sync::Arc;

use depth_image::{Camera, DepthImage};
use gpu::Gpu;
use render::{DrawWork, RenderError, Renderer, SamplePlanes};

use crate::{SamplingMethod, depth_peeling, settling::Settling};

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
    /// A camera that is not there, or a part of a chain.
    #[error("image {index} is not among the {cameras} of the set, or not wanted with all others by {method}")]
    Wanted {
        /// The first such.
        index: u32,
        /// Of the set.
        cameras: usize,
        /// Which takes its images in order.
        method: SamplingMethod,
    },
}

/// What to sample.
#[derive(Clone, Copy)]
pub struct SampleWork<'a> {
    /// Of what, lit how.
    pub draw: DrawWork<'a>,
    /// Of the whole set: what a later image leaves out depends on those before it.
    pub cameras: &'a [Camera],
    /// Which images are taken. Images in a chain are taken all together.
    pub wanted: &'a [u32],
    /// Which samples are taken.
    pub method: SamplingMethod,
    /// Planes beside colour and depth.
    pub planes: SamplePlanes,
    /// A moment of a moving scene, what is kept at which is kept on to, where the method settles.
    pub temporal_reference_s: Option<f32>,
}

/// Takes samples; shares its pipelines with direct rendering.
pub struct Sampler {
    renderer: Arc<Renderer>,
    settling: Settling,
}

impl Sampler {
    /// Makes a renderer of its own.
    ///
    /// # Errors
    /// When a shader is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, SamplingError> {
        Ok(Self::sharing(Arc::new(renderer(gpu)?)))
    }

    /// Uses what [`renderer`] made.
    #[must_use]
    pub fn sharing(renderer: Arc<Renderer>) -> Self {
        Self { renderer, settling: Settling::default() }
    }

    /// The wanted depth images, in their order.
    ///
    /// # Errors
    /// A camera that is not valid or does not go with the method, or the device.
    pub fn sample(&self, work: &SampleWork<'_>) -> Result<Vec<DepthImage>, SamplingError> {
        check_wanted(work)?;
        if let SamplingMethod::DepthPeeling { .. } = work.method {
            depth_peeling::check(work.cameras)?;
        }
        let Some(leave_out) = work.method.leave_out() else {
            let cameras: Vec<Camera> = work.wanted.iter().map(|&index| work.cameras[index as usize]).collect();
            return Ok(self.renderer.draw_depth_images(work.draw, &cameras, work.planes)?);
        };
        let before = self.settling.before(&self.renderer, work, leave_out)?;
        let SampleWork { draw, cameras, wanted, planes, .. } = *work;
        Ok(self.renderer.draw_depth_images_apart(draw, cameras, wanted, planes, leave_out, before.as_ref())?)
    }
}

/// Of a chain all are wanted, in their order.
fn check_wanted(work: &SampleWork<'_>) -> Result<(), SamplingError> {
    let cameras = work.cameras.len();
    let all = || (0..cameras as u32).eq(work.wanted.iter().copied());
    let missing = work.wanted.iter().copied().find(|&index| index as usize >= cameras);
    let broken = (work.method.is_chained() && !all()).then(|| work.wanted.first().copied().unwrap_or(0));
    match missing.or(broken) {
        Some(index) => Err(SamplingError::Wanted { index, cameras, method: work.method }),
        None => Ok(()),
    }
}

/// A renderer that knows this crate's tests of what images leave out.
///
/// # Errors
/// When a shader is broken.
pub fn renderer(gpu: &Arc<Gpu>) -> Result<Renderer, RenderError> {
    Renderer::with_tests(gpu, &crate::shaders())
}
