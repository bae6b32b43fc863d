//! The scene and cameras of these tests.

use std::sync::{Arc, OnceLock};

use depth_image::{Camera, PinholeCamera};
use gpu::{DevicePreference, Gpu};
use render::{DrawWork, GpuScene, Lighting};
use sampling::Sampler;
use scene::Scene;

pub struct Device {
    gpu: Arc<Gpu>,
    pub sampler: Sampler,
}

/// The software device of this program; a test without one fails.
pub fn device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let renderer = Arc::new(sampling::renderer(&gpu).expect("a renderer"));
        Device { gpu, sampler: Sampler::sharing(renderer) }
    })
}

pub fn upload(scene: &Scene) -> GpuScene {
    GpuScene::upload(&device().gpu, scene).expect("a scene")
}

pub fn unlit(scene: &GpuScene) -> DrawWork<'_> {
    DrawWork::new(scene, Lighting::UNLIT)
}

pub fn pinholes(cameras: &[PinholeCamera]) -> Vec<Camera> {
    cameras.iter().copied().map(Camera::Pinhole).collect()
}
