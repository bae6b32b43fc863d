//! A shared device: sets that are sampled in slices are those that are sampled at once, to the byte.

use std::sync::Arc;

use depth_image::PinholeCamera;
use fixtures::poles;
use glam::{UVec2, Vec3};
use gpu::{DevicePreference, Gpu};
use render::{DrawWork, GpuScene, SamplePlanes, Visibility};
use sampling::{SampleWork, Sampler, SamplingMethod};

use crate::stage::pinholes;

#[test]
fn a_set_in_slices_is_the_whole_set_with_every_method() {
    let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
    let sampler = Sampler::sharing(Arc::new(sampling::renderer(&gpu).expect("a renderer")));
    let scene = GpuScene::upload(&gpu, &poles(0.1)).expect("a scene");
    let rig = [-0.4, 0.0, 0.4]
        .map(|x| PinholeCamera::looking_at(Vec3::new(x, 0.5, 3.0), Vec3::ZERO, Vec3::Y, 0.9, UVec2::new(67, 61)));
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        // Tests that trace rays find surfaces by rays.
        let is_possible = |method: &SamplingMethod| {
            let takes_images = method.layer_selection().is_none();
            let is_drawn = method.images_are_sequential() || method.images_are_independent();
            takes_images && (visibility == Visibility::Rays || is_drawn)
        };
        for method in SamplingMethod::all().filter(is_possible) {
            let cameras = pinholes(&method.cameras(rig.to_vec()));
            let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
            let draw =
                DrawWork { visibility, ..DrawWork::new(&scene, "soft 2, occlusion 2".parse().expect("a lighting")) };
            let planes = SamplePlanes { normal: true, specular: true, corners: true, ..SamplePlanes::default() };
            let work = SampleWork { draw, cameras: &cameras, tile_count: 1, wanted: &wanted, method, planes };
            let whole = sampler.sample(&work).expect("images");
            let before = gpu.device_queue.slices();
            let live = gpu.device_queue.force_slices(1);
            let cut = sampler.sample(&work).expect("images");
            drop(live);
            assert!(gpu.device_queue.slices() - before > 30, "{method}");
            assert!(cut == whole, "{method}, {visibility}: bytes differ in slices");
        }
    }
}
