//! What these tests sample with.

use std::sync::{Arc, OnceLock};

use gpu::{DevicePreference, Gpu};
use render::GpuScene;
use sampling::Sampler;
use scene::Scene;

/// The software device of this program; a test without one fails.
pub fn device() -> &'static (Arc<Gpu>, Sampler) {
    static DEVICE: OnceLock<(Arc<Gpu>, Sampler)> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let sampler = Sampler::new(&gpu).expect("a sampler");
        (gpu, sampler)
    })
}

pub fn upload(scene: &Scene) -> GpuScene {
    GpuScene::upload(&device().0, scene).expect("a scene")
}
