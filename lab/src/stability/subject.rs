//! The scene of a path on the device, its view cell, and its usual samples.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::setup::{SceneArgs, Setup};
use cluster::Workload;
use depth_image::{PinholeCamera, ViewCell};
use engine::GpuEngine;
use glam::UVec2;
use reconstruction::ReconstructionMethod;
use render::Lighting;
use sampling::SamplingMethod;

/// Texels of a sample image a pixel of a view, each way.
const DENSITY: u32 = 2;

/// A scene under a light.
pub struct Subject {
    setup: Setup,
    lighting: Lighting,
    pub cell: ViewCell,
    pub view_px: UVec2,
}

/// The way to make views from sample images.
#[derive(Debug, Clone)]
pub struct Representation {
    pub sampling: SamplingMethod,
    pub method: ReconstructionMethod,
    pub cameras: Vec<PinholeCamera>,
}

impl Subject {
    /// # Errors
    /// The scene cannot be used, or the device fails.
    pub fn load(engine: &Arc<GpuEngine>, scene: &str, lighting: &str, view_px: UVec2) -> anyhow::Result<Self> {
        let setup = SceneArgs::new(fixtures::spec(scene)?).load()?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        let cell = ViewCell::between(&setup.around).context("no sample cameras")?;
        Ok(Self { setup, lighting: lighting.parse()?, cell, view_px })
    }

    /// The default methods with images from the corners of the cell.
    pub fn usual(&self, cameras: u32) -> Representation {
        Representation {
            sampling: SamplingMethod::default(),
            method: ReconstructionMethod::default(),
            cameras: self.cell.nested_cameras(cameras as usize, self.view_px * DENSITY),
        }
    }

    pub fn workload(&self, of: &Representation) -> Workload {
        self.setup.workload(of.sampling, self.lighting, &of.cameras)
    }

    pub fn volume(&self) -> &depth_image::Aabb {
        &self.setup.offer.volume
    }
}
