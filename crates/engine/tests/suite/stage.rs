//! The engine of all tests here, and sample sets of whole scenes.

use std::sync::OnceLock;

use cluster::{Refinement, SamplePlanes};
use depth_image::Camera;
use engine::GpuEngine;
use gpu::DevicePreference;
use node::{Engine, SampleSet, SampleWork, Turn, WorkClass};
use scene::{Limits, MissingTextures, Scene};

/// The engine of this program, on the software device; a test without one fails.
pub fn engine() -> &'static GpuEngine {
    static ENGINE: OnceLock<GpuEngine> = OnceLock::new();
    ENGINE.get_or_init(|| GpuEngine::open(DevicePreference::Software).expect("an engine"))
}

/// A procedural scene, which the engine has under `hash` from now on.
pub fn loaded(hash: &str, name: &str) -> Scene {
    let spec = fixtures::spec(name).expect("a name");
    let scene = spec.load(&Limits::default(), MissingTextures::Refuse).expect("a scene");
    engine().put_scene(hash, &scene).expect("a scene");
    scene
}

/// The images of these cameras, as views are made from them.
pub fn sample_set((hash, scene): (&str, &Scene), cameras: &[impl Copy + Into<Camera>], lighting: &str) -> SampleSet {
    planned_set((hash, scene), cameras, lighting, SamplePlanes::default())
}

/// Images of light in place of colour.
pub fn light_set((hash, scene): (&str, &Scene), cameras: &[impl Copy + Into<Camera>], lighting: &str) -> SampleSet {
    planned_set((hash, scene), cameras, lighting, SamplePlanes { light: true, ..SamplePlanes::default() })
}

fn planned_set(
    (hash, scene): (&str, &Scene),
    cameras: &[impl Copy + Into<Camera>],
    lighting: &str,
    planes: SamplePlanes,
) -> SampleSet {
    let work = SampleWork {
        scene_hash: hash.to_owned(),
        tile_count: 1,
        cameras: cameras.iter().copied().map(|camera| camera.into().into()).collect(),
        wanted: (0..cameras.len() as u32).collect(),
        sampling: "conventional".to_owned(),
        planes,
        lighting: lighting.to_owned(),
        scene_time_s: 0.0,
        refinement: Refinement::default(),
        surfaces_by_rays: None,
    };
    SampleSet {
        scene_hash: hash.to_owned(),
        images: engine().sample(&work, Turn::of(WorkClass::Batch)).expect("images").try_into().expect("of one kind"),
        volume: scene.bounds(),
        background: scene.background,
        illumination: scene.illumination.clone(),
        lighting: lighting.to_owned(),
        scene_time_s: 0.0,
        traced_pixel_count: None,
        is_common: false,
    }
}
