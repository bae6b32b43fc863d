//! The device of all curves, and the size at which they are measured.

use std::sync::Arc;

use depth_image::{Camera, DepthImage, Highlight, PinholeCamera, View, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use reconstruction::{Reconstructor, SetDescription};
use render::{DrawWork, GpuScene, Lighting, SamplePlanes, Visibility};
use sampling::{SampleWork, Sampler, SamplingMethod};
use scene::Scene;

/// Views at the study's size, and in tests.
const VIEW_PX: [UVec2; 2] = [UVec2::new(160, 120), UVec2::new(64, 48)];
/// Sample images have half as many texels again along each side.
const SAMPLE_PX: [UVec2; 2] = [UVec2::new(240, 180), UVec2::new(96, 72)];

/// One device with its pipelines, and the sizes of pictures.
pub struct Stand {
    engine: Arc<GpuEngine>,
    sampler: Sampler,
    pub is_small: bool,
    pub view_px: UVec2,
    pub sample_px: UVec2,
}

impl Stand {
    pub fn new(engine: &Arc<GpuEngine>, is_small: bool) -> Self {
        let size = usize::from(is_small);
        let sampler = Sampler::sharing(engine.renderer.clone());
        Self { engine: engine.clone(), sampler, is_small, view_px: VIEW_PX[size], sample_px: SAMPLE_PX[size] }
    }

    pub fn engine(&self) -> &Arc<GpuEngine> {
        &self.engine
    }

    pub fn sampler(&self) -> &Sampler {
        &self.sampler
    }

    pub fn reconstructor(&self) -> &Reconstructor {
        &self.engine.reconstructor
    }

    pub fn upload(&self, scene: &Scene) -> anyhow::Result<GpuScene> {
        Ok(GpuScene::upload(self.engine.renderer.gpu(), scene)?)
    }

    /// Views drawn from the triangles.
    pub fn views(
        &self,
        scene: &GpuScene,
        lighting: Lighting,
        cameras: &[PinholeCamera],
        planes: ViewPlanes,
    ) -> anyhow::Result<Vec<View>> {
        Ok(self.engine.renderer.draw_views(work(scene, lighting), cameras, planes)?)
    }

    /// Depth images with all visible surfaces.
    pub fn images(
        &self,
        scene: &GpuScene,
        lighting: Lighting,
        cameras: &[Camera],
        planes: SamplePlanes,
    ) -> anyhow::Result<Vec<DepthImage>> {
        Ok(self.engine.renderer.draw_depth_images(work(scene, lighting), cameras, planes)?)
    }

    /// Depth images of a sampling method, without light, with surface ids.
    pub fn sample(
        &self,
        scene: &GpuScene,
        cameras: &[PinholeCamera],
        method: SamplingMethod,
    ) -> anyhow::Result<Vec<DepthImage>> {
        let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
        let work = SampleWork {
            // By rays, which the test by visibility needs.
            draw: DrawWork { visibility: Visibility::Rays, ..work(scene, Lighting::UNLIT) },
            cameras: &pinholes(cameras),
            tile_count: 1,
            wanted: &wanted,
            method,
            planes: SamplePlanes { normal: true, surface_id: true, ..SamplePlanes::default() },
        };
        Ok(self.sampler.sample(&work)?)
    }
}

pub fn pinholes(cameras: &[PinholeCamera]) -> Vec<Camera> {
    cameras.iter().copied().map(Camera::Pinhole).collect()
}

/// What sample sets of a scene share.
pub fn description(scene: &Scene, highlight: Option<Highlight>) -> SetDescription<'_> {
    SetDescription {
        volume: scene.bounds(),
        background: scene.background,
        illumination: &scene.illumination,
        highlight,
        environment: None,
        mips: false,
    }
}

/// By triangles, so that no measurement of times decides what is drawn.
pub fn work(scene: &GpuScene, lighting: Lighting) -> DrawWork<'_> {
    DrawWork { visibility: Visibility::Triangles, ..DrawWork::new(scene, lighting) }
}
