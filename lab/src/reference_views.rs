//! Reference views: drawn from the scene, beside the sample set that other views are reconstructed from.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::setup::{SceneArgs, Setup};
use codec::{DecodeLimits, decode_depth_image, encode_depth_image};
use depth_image::{DepthImage, PinholeCamera, SampleImage, View, ViewPlanes};
use engine::GpuEngine;
use metrics::{PixelClass, classify};
use node::{DirectWork, Engine as _, SampleWork, Turn, WorkClass};
use reconstruction::{ReconstructRequest, ReconstructionMethod, SampleSet, SetDescription};
use render::Lighting;

use crate::statistics::median_seconds;

const TURN: Turn = Turn { class: WorkClass::Batch, flow: Turn::COMMON_FLOW };

/// A scene's sample set as compositors have it, and views drawn from the scene.
pub struct ReferenceViews {
    engine: Arc<GpuEngine>,
    /// Cameras of the views.
    pub cameras: Vec<PinholeCamera>,
    /// Views drawn from the scene.
    pub views: Vec<View>,
    set: SampleSet,
    classes: Vec<Vec<PixelClass>>,
}

impl ReferenceViews {
    /// Samples the scene, sends the images through the codec, and draws the views.
    ///
    /// # Errors
    /// The device's or the codec's.
    pub fn draw(
        engine: &Arc<GpuEngine>,
        setup: &Setup,
        args: &SceneArgs,
        cameras: Vec<PinholeCamera>,
    ) -> anyhow::Result<Self> {
        setup.check_depth_images()?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        let images = sample(engine, setup, args)?;
        let environment = engine.scene(setup.offer.hash.as_str())?.environment.clone();
        let description = SetDescription {
            volume: setup.offer.volume,
            background: setup.offer.background,
            illumination: &setup.offer.illumination,
            highlight: args.lighting.highlight(),
            environment: environment.as_ref(),
            mips: false,
        };
        let set = engine.reconstructor.upload(&images, &description, Default::default())?;
        let views = engine.draw_direct(&direct_work(setup, args.lighting, &cameras, ViewPlanes::ALL), TURN)?;
        let mut classes = Vec::with_capacity(views.len());
        for (camera, view) in cameras.iter().zip(&views) {
            let inverse_depth = view.inverse_depth_per_m.as_ref().context("a view without depth")?;
            classes.push(classify(camera, inverse_depth, &images)?);
        }
        Ok(Self { engine: engine.clone(), cameras, views, set, classes })
    }

    /// The classes of the pixels of every view.
    pub(crate) fn classes(&self) -> &[Vec<PixelClass>] {
        &self.classes
    }

    /// Reconstructs all views.
    ///
    /// # Errors
    /// The device fails.
    pub fn reconstruct(&self, method: ReconstructionMethod, planes: ViewPlanes) -> anyhow::Result<Vec<View>> {
        let request = ReconstructRequest::new(&self.set, &self.cameras, method);
        Ok(self.engine.reconstructor.reconstruct(ReconstructRequest { planes, ..request })?)
    }

    /// Milliseconds a view in one batch of `at_least` views or more: the median of `runs` after one that does not
    /// count.
    ///
    /// # Errors
    /// The device fails.
    pub fn ms_a_view(&self, method: ReconstructionMethod, at_least: usize, runs: usize) -> anyhow::Result<f64> {
        let times = at_least.div_ceil(self.cameras.len().max(1)).max(1);
        let cameras = self.cameras.repeat(times);
        let batch_s = median_seconds(runs.max(1), || {
            self.engine.reconstructor.reconstruct(ReconstructRequest::new(&self.set, &cameras, method))?;
            Ok(())
        })?;
        Ok(batch_s * 1e3 / cameras.len() as f64)
    }
}

/// The sample set as compositors decode it.
pub(crate) fn sample(engine: &GpuEngine, setup: &Setup, args: &SceneArgs) -> anyhow::Result<Vec<DepthImage>> {
    let work = SampleWork {
        scene_hash: setup.offer.hash.to_string(),
        tile_count: 1,
        wanted: (0..setup.samples.len() as u32).collect(),
        cameras: setup.samples.iter().copied().map(Into::into).collect(),
        sampling: args.sampling().to_string(),
        planes: engine.sample_planes(&args.method().to_string())?,
        lighting: args.lighting.to_string(),
        scene_time_s: 0.0,
        refinement: cluster::Refinement::default(),
        surfaces_by_rays: None,
    };
    SampleImage::depth_images(engine.sample(&work, TURN)?)?.iter().map(encoded_and_decoded).collect()
}

pub(crate) fn encoded_and_decoded(image: &DepthImage) -> anyhow::Result<DepthImage> {
    let encoded = encode_depth_image(image)?;
    Ok(decode_depth_image(&encoded.header, image.camera, &encoded.payload, &DecodeLimits::default())?)
}

/// Direct drawing of the scene at its start.
pub(crate) fn direct_work(
    setup: &Setup,
    lighting: Lighting,
    cameras: &[PinholeCamera],
    planes: ViewPlanes,
) -> DirectWork {
    DirectWork {
        scene_hash: setup.offer.hash.to_string(),
        cameras: cameras.to_vec(),
        lighting: lighting.to_string(),
        scene_time_s: 0.0,
        planes,
        surfaces_by_rays: None,
    }
}
