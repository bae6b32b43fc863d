//! Sample sets of whole scenes.

use cluster::{Refinement, SamplePlanes};
use depth_image::Camera;
use node::{Engine, SampleSet, SampleWork, Turn, WorkClass};
use scene::Scene;

/// The images of these cameras, as views are made from them.
pub fn sample_set(
    engine: &dyn Engine,
    (hash, scene): (&str, &Scene),
    cameras: &[impl Copy + Into<Camera>],
    lighting: &str,
) -> SampleSet {
    let work = SampleWork {
        scene_hash: hash.to_owned(),
        cameras: cameras.iter().copied().map(|camera| camera.into().into()).collect(),
        wanted: (0..cameras.len() as u32).collect(),
        sampling: "conventional".to_owned(),
        planes: SamplePlanes::default(),
        lighting: lighting.to_owned(),
        scene_time_s: 0.0,
        temporal_reference_s: None,
        refinement: Refinement::default(),
    };
    SampleSet {
        scene_hash: hash.to_owned(),
        images: engine.sample(&work, Turn::of(WorkClass::Batch)).expect("images").try_into().expect("of one kind"),
        volume: scene.bounds(),
        background: scene.background,
        illumination: scene.illumination.clone(),
        lighting: lighting.to_owned(),
        is_common: false,
    }
}
