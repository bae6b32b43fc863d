//! The scene and cameras that rays are measured on.

use anyhow::Context as _;
use depth_image::{Camera, DepthImage, PinholeCamera};
use engine::GpuEngine;
use node::Engine as _;
use render::{DrawWork, GpuScene, Lighting, Refinement, SamplePlanes, Visibility};

/// Repeats of every time; the median counts.
pub(super) const RUNS: usize = 3;

/// A scene on the device, and cameras.
pub(super) struct Subject<'a> {
    pub(super) engine: &'a GpuEngine,
    pub(super) scene: &'a GpuScene,
    pub(super) cameras: &'a [PinholeCamera],
}

impl Subject<'_> {
    pub(super) fn work(&self, lighting: Lighting, visibility: Visibility) -> DrawWork<'_> {
        DrawWork {
            scene: self.scene,
            lighting,
            scene_time_s: 0.0,
            visibility,
            refinement: Refinement::default(),
            turn: Default::default(),
        }
    }

    pub(super) fn draw(&self, lighting: Lighting, planes: SamplePlanes) -> anyhow::Result<Vec<DepthImage>> {
        let cameras: Vec<Camera> = self.cameras.iter().copied().map(Camera::Pinhole).collect();
        Ok(self.engine.renderer.draw_depth_images(self.work(lighting, Visibility::Rays), &cameras, planes)?)
    }

    pub(super) fn camera(&self) -> anyhow::Result<&PinholeCamera> {
        self.cameras.first().context("no sample cameras")
    }

    /// The unit of speeds: a core where shaders run on the processor.
    pub(super) fn workers(&self) -> (&'static str, f64) {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from) as f64;
        if self.engine.is_software() { ("a core", cores()) } else { ("the device", 1.0) }
    }
}
