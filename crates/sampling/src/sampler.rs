//! Sampling as a service of a device: all cameras of a request in as few submissions as memory allows.

use std::sync::Arc;

use depth_image::{Antialias, DepthImage};
use gpu::Gpu;
use render::{RenderError, Renderer, SamplePlanes};

use crate::{error::SamplingError, methods::templates, work::SampleWork};

/// Takes samples; shares its pipelines with direct rendering.
pub struct Sampler {
    renderer: Arc<Renderer>,
}

impl Sampler {
    /// Uses what [`renderer`] made.
    #[must_use]
    pub fn sharing(renderer: Arc<Renderer>) -> Self {
        Self { renderer }
    }

    /// The wanted depth images, in their order.
    ///
    /// # Errors
    /// A camera that is not valid or does not go with the method, or the device.
    pub fn sample(&self, work: &SampleWork<'_>) -> Result<Vec<DepthImage>, SamplingError> {
        check_wanted(work)?;
        if work.planes.light && work.method.antialias() > Antialias::NONE {
            return Err(SamplingError::Positions { method: work.method.to_string() });
        }
        work.method.check(work.cameras)?;
        let SampleWork { draw, cameras, wanted, planes, .. } = *work;
        if let Some(test) = work.method.redundancy_test() {
            return Ok(self.renderer.draw_image_sequence(draw, cameras, wanted, planes, test)?);
        }
        let (tiles, numbers) = work.tiles();
        if work.method.omits_covered_pixels() {
            return Ok(self.renderer.draw_uncovered_images(draw, cameras, &numbers, &tiles, planes)?);
        }
        let planes = SamplePlanes { antialias: work.method.antialias(), ..planes };
        Ok(self.renderer.draw_depth_images(draw, &tiles, planes)?)
    }
}

/// Images in sequence are all wanted, in their order. Images that depend on others in what they show are wanted whole.
fn check_wanted(work: &SampleWork<'_>) -> Result<(), SamplingError> {
    let cameras = work.cameras.len() * work.tile_count as usize;
    let missing = work.wanted.iter().copied().find(|&index| index as usize >= cameras);
    let is_cut = work.tile_count > 1 && !work.method.images_are_independent();
    let is_broken =
        is_cut || work.method.images_are_sequential() && (0..cameras as u32).ne(work.wanted.iter().copied());
    let broken = is_broken.then(|| work.wanted.first().copied().unwrap_or(0));
    match missing.or(broken) {
        Some(index) => Err(SamplingError::Selection { index, cameras, method: work.method.to_string() }),
        None => Ok(()),
    }
}

/// A renderer that has this crate's redundancy tests.
///
/// # Errors
/// When a shader is broken.
pub fn renderer(gpu: &Arc<Gpu>) -> Result<Renderer, RenderError> {
    Ok(Renderer::new(gpu, templates()?))
}
