//! The scene and cameras of these tests.

use std::sync::{Arc, OnceLock};

use depth_image::{Camera, DepthImage, PinholeCamera};
use gpu::{DevicePreference, Gpu};
use render::{
    DrawWork, GpuScene, Lighting, RedundancyTest, Refinement, Renderer, SamplePlanes, TemporalReference, Visibility,
};
use sampling::{Redundancy, Sampler, SamplingMethod};
use scene::Scene;

pub struct Device {
    gpu: Arc<Gpu>,
    renderer: Arc<Renderer>,
    pub sampler: Sampler,
}

/// The software device of this program; a test without one fails.
pub fn device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let renderer = Arc::new(sampling::renderer(&gpu).expect("a renderer"));
        Device { gpu, sampler: Sampler::sharing(renderer.clone()), renderer }
    })
}

pub fn upload(scene: &Scene) -> GpuScene {
    GpuScene::upload(&device().gpu, scene).expect("a scene")
}

pub fn unlit(scene: &GpuScene) -> DrawWork<'_> {
    DrawWork {
        scene,
        lighting: Lighting::UNLIT,
        scene_time_s: 0.0,
        visibility: Visibility::Measured,
        refinement: Refinement::default(),
        turn: Default::default(),
    }
}

pub fn pinholes(cameras: &[PinholeCamera]) -> Vec<Camera> {
    cameras.iter().copied().map(Camera::Pinhole).collect()
}

fn tolerance() -> RedundancyTest {
    SamplingMethod::NonRedundant(Redundancy::Tolerance).redundancy_test().expect("a test")
}

/// The contents of a set by tolerance.
pub fn reference(scene: &GpuScene, cameras: &[PinholeCamera]) -> TemporalReference {
    device().renderer.temporal_reference(unlit(scene), &pinholes(cameras), tolerance()).expect("a set")
}

/// A set by tolerance, which keeps on to another's samples.
pub fn after(scene: &GpuScene, cameras: &[PinholeCamera], reference: Option<&TemporalReference>) -> Vec<DepthImage> {
    let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
    let work = unlit(scene);
    let cameras = pinholes(cameras);
    let planes = SamplePlanes::default();
    let images = device().renderer.draw_image_sequence(work, &cameras, &wanted, planes, tolerance(), reference);
    images.expect("images")
}
