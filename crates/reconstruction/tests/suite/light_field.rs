//! What mirrors and rough surfaces show, gathered in layered light fields.

use std::time::Instant;

use depth_image::{
    CubeGrid, CubeImages, Highlight, LayeredLightField, LightDirections, LightFieldCamera, PinholeCamera, View,
    ViewPlanes,
};
use glam::{UVec2, Vec3};
use gpu::Turn;
use metrics::{Rgb8Image, psnr_db};
use reconstruction::{Mirrors, ReconstructionError, ReconstructionMethod, SampleSet, SetDescription};
use render::{DrawWork, GpuScene, LayerSelection};
use scene::Scene;
use scene::procedural::mirror_box;

use crate::stage::{gpu, looking, matt, plainly_lit, reconstructor, renderer};

const SIDE: u32 = 192;

/// A scene and its cube, with a camera.
struct Gathering {
    scene: Scene,
    on_device: GpuScene,
    grid: CubeGrid,
    camera: PinholeCamera,
}

impl Gathering {
    fn new(scene: Scene, camera: PinholeCamera) -> Self {
        let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
        let grid = CubeGrid::around(&scene.bounds(), SIDE).expect("a grid");
        Self { scene, on_device, grid, camera }
    }

    fn mirror_box() -> Self {
        Self::new(mirror_box(), looking(Vec3::new(0.4, 2.0, 6.5), Vec3::Y * 1.2, 40.0, UVec2::new(120, 90)))
    }

    fn lit(&self, lighting: &str) -> DrawWork<'_> {
        DrawWork { lighting: lighting.parse().expect(lighting), ..plainly_lit(&self.on_device) }
    }

    fn light_field(&self, directions: LightDirections, lighting: &str) -> LayeredLightField {
        let camera = LightFieldCamera::around(self.scene.bounds(), directions, 64);
        let field = renderer().draw_light_field(self.lit(lighting), &camera).expect("a light field");
        field.validate().expect("a light field");
        field
    }

    fn set(&self, light_field: Option<LayeredLightField>) -> SampleSet {
        let image = |axis| {
            let camera = self.grid.camera(axis);
            renderer().draw_layers(self.lit("shadows"), &camera, LayerSelection::Dominant).expect("layers")
        };
        let description = SetDescription {
            illumination: &self.scene.illumination,
            highlight: Some(Highlight::Ggx),
            ..matt(self.scene.bounds(), self.scene.background)
        };
        let cube = CubeImages { grid: self.grid, images: [image(0), image(1), image(2)], light_field };
        reconstructor().upload_cube_in_turn(&cube, &description, Turn::default()).expect("a cube")
    }

    fn view(&self, set: &SampleSet, method: &str, mirrors: Mirrors<'_>) -> View {
        let method: ReconstructionMethod = method.parse().expect(method);
        let views = reconstructor().reconstruct_with(
            set,
            mirrors,
            &[self.camera],
            method,
            ViewPlanes::ALL,
            Turn::default(),
        );
        views.expect("a view").remove(0)
    }

    fn direct(&self, lighting: &str) -> View {
        renderer().draw_views(self.lit(lighting), &[self.camera], ViewPlanes::ALL).expect("a view").remove(0)
    }
}

fn psnr(a: &View, b: &View, pixels: &[bool]) -> f64 {
    let [a, b] = [a, b].map(|view| Rgb8Image::of_view(view).expect("a picture"));
    psnr_db(&a, &b, Some(pixels)).expect("of one size").expect("pixels")
}

/// Pixels that two views show differently.
fn changed(a: &View, b: &View) -> Vec<bool> {
    let is_other = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 2);
    a.srgb8.chunks(3).zip(b.srgb8.chunks(3)).map(is_other).collect()
}

#[test]
fn gathered_mirrors_are_blurred_and_more_directions_are_sharper() {
    let stage = Gathering::mirror_box();
    let lighting = "shadows, reflections 7";
    let [none, truth] = ["shadows", lighting].map(|lighting| stage.direct(lighting));
    let pixels = changed(&none, &truth);
    let mirrors = Mirrors { cells: &[], reflections: 7, glossy: false };
    for directions in LightDirections::ALL {
        let start = Instant::now();
        let field = stage.light_field(directions, lighting);
        let samples = field.sample_count();
        println!("{directions:?}: {samples} samples in {:?}", start.elapsed());
        let set = stage.set(Some(field));
        for method in ["layered:0", "layered:1", "layered"] {
            let view = stage.view(&set, method, mirrors);
            let start = Instant::now();
            stage.view(&set, method, mirrors);
            println!("{method}: {:.2} dB in {:?}", psnr(&truth, &view, &pixels), start.elapsed());
        }
    }
}
