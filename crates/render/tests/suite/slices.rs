//! A shared device: pictures that are drawn in slices are those that are drawn at once, to the byte.

use std::sync::Arc;

use depth_image::{Antialias, Camera, DepthImage, PinholeCamera, View, ViewPlanes};
use fixtures::mirror_pair;
use glam::{UVec2, Vec3};
use gpu::{CompiledOutside, DevicePreference, Gpu};
use render::{DrawWork, GpuScene, Refinement, Renderer, SamplePlanes, Visibility};
use scene::Scene;
use scene::procedural::courtyard;

const PLANES: SamplePlanes = SamplePlanes {
    antialias: Antialias::NONE,
    normal: true,
    surface_id: true,
    specular: true,
    corners: true,
    light: false,
};
/// Rows of a piece are eight, and a draw has one triangle.
const FEW_UNITS: u64 = 1;

/// A device of its own, whose slices no other test counts.
struct Shared {
    gpu: Arc<Gpu>,
    renderer: Renderer,
    scene: GpuScene,
    cameras: Vec<PinholeCamera>,
}

impl Shared {
    fn new() -> Self {
        let camera = |x: f32, size: [u32; 2]| {
            PinholeCamera::looking_at(Vec3::new(x, 2.0, 6.0), Vec3::Y, Vec3::Y, 0.9, UVec2::from(size))
        };
        Self::of(&courtyard(), vec![camera(0.0, [67, 61]), camera(1.0, [40, 48])])
    }

    fn of(scene: &Scene, cameras: Vec<PinholeCamera>) -> Self {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        Self {
            renderer: Renderer::new(&gpu, render::templates(&[]).expect("templates")),
            scene: GpuScene::upload(&gpu, scene).expect("a scene"),
            cameras,
            gpu,
        }
    }

    fn work(&self, lighting: &str, visibility: Visibility) -> DrawWork<'_> {
        let lighting = lighting.parse().expect(lighting);
        let scene_time_s = 0.0;
        let refinement = Refinement::default();
        DrawWork { scene_time_s, visibility, refinement, ..DrawWork::new(&self.scene, lighting) }
    }

    /// Pictures, and the slices that they took.
    fn counted<T>(&self, make: impl Fn() -> T) -> (T, u64) {
        let before = self.gpu.device_queue.slices();
        let made = make();
        (made, self.gpu.device_queue.slices() - before)
    }

    fn views(&self, work: DrawWork<'_>) -> Vec<View> {
        self.views_with(work, ViewPlanes::ALL)
    }

    fn views_with(&self, work: DrawWork<'_>, planes: ViewPlanes) -> Vec<View> {
        self.renderer.draw_views(work, &self.cameras, planes).expect("views")
    }

    fn images(&self, work: DrawWork<'_>) -> Vec<DepthImage> {
        let cameras: Vec<Camera> = self.cameras.iter().copied().map(Camera::Pinhole).collect();
        self.renderer.draw_depth_images(work, &cameras, PLANES).expect("images")
    }

    fn check<T: PartialEq>(&self, what: &str, make: impl Fn() -> T) {
        let (whole, few) = self.counted(&make);
        assert!(few <= 2, "{what}: {few} slices, but nobody watches");
        let live = self.gpu.device_queue.force_slices(FEW_UNITS);
        let (cut, many) = self.counted(&make);
        drop(live);
        assert!(many > 30, "{what}: {many} slices");
        assert!(cut == whole, "{what}: bytes differ in slices");
    }
}

#[test]
fn a_picture_in_slices_is_the_whole_picture_with_every_light() {
    let shared = Shared::new();
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        for lighting in ["phong", "shadows", "soft 2, occlusion 2", "soft 40, occlusion 3"] {
            let work = shared.work(lighting, visibility);
            shared.check(&format!("views, {lighting}, {visibility}"), || shared.views(work));
            shared.check(&format!("images, {lighting}, {visibility}"), || shared.images(work));
        }
    }
}

#[test]
fn mirror_images_in_slices_are_the_whole_ones_with_several_samples_a_pixel() {
    let camera = |x: f32, size: [u32; 2]| {
        PinholeCamera::looking_at(Vec3::new(x, 1.9, 2.6), Vec3::new(0.6, 0.8, -0.4), Vec3::Y, 0.9, UVec2::from(size))
    };
    let shared = Shared::of(&mirror_pair(), vec![camera(-1.6, [67, 61]), camera(-1.2, [40, 48])]);
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        let work = shared.work("soft 2, occlusion 2, reflections 3", visibility);
        for antialias in [Antialias::NONE, Antialias::of(4).expect("four samples")] {
            let planes = ViewPlanes { antialias, ..ViewPlanes::ALL };
            shared.check(&format!("mirrors, {visibility}, {antialias}"), || shared.views_with(work, planes));
        }
        // A picture among others is the picture alone.
        let together = shared.views(work);
        let alone = shared.renderer.draw_views(work, &shared.cameras[1..], ViewPlanes::ALL).expect("a view");
        assert!(together[1..] == alone, "{visibility}");
    }
}

#[test]
fn light_that_is_refined_in_slices_is_that_which_is_refined_at_once() {
    let shared = Shared::new();
    let lit = shared.work("soft 4, occlusion 4", Visibility::Rays);
    let steps = 3;
    let refined = || {
        let images = (0..steps).map(|step| shared.images(DrawWork { refinement: Refinement { step, steps }, ..lit }));
        images.collect::<Vec<_>>()
    };
    let whole = refined();
    let live = shared.gpu.device_queue.force_slices(FEW_UNITS);
    assert!(refined() == whole);
    drop(live);
}

#[test]
fn shaders_are_compiled_outside_the_queue_beside_a_live_stream() {
    let shared = Shared::new();
    let _live = shared.gpu.device_queue.live_stream();
    let lightings = [
        ("soft 2, occlusion 2", Visibility::Rays),
        ("shadows", Visibility::Triangles),
        ("unlit", Visibility::Triangles),
    ];
    for (lighting, visibility) in lightings {
        let before = shared.gpu.compiled_outside();
        shared.images(shared.work(lighting, visibility));
        let CompiledOutside { compiled, failed } = shared.gpu.compiled_outside();
        assert!(compiled > before.compiled && failed == 0, "{lighting}: {compiled} compiled, {failed} failed");
    }
}
