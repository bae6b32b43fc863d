//! Views from layered depth cubes.

use depth_image::{CubeGrid, Highlight, LayeredDepthImage, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use glam::{UVec2, Vec3};
use gpu::Turn;
use metrics::{Rgb8Image, psnr_db};
use reconstruction::scalar::CubeTwin;
use reconstruction::{Mirrors, ReconstructionError, ReconstructionMethod, SampleSet, SetDescription};
use render::{DrawWork, GpuScene, Kept};
use scene::Scene;
use scene::procedural::mirror_box;

use crate::stage::{Agreement, CARVE, Stage, corpus, count, gpu, looking, matt, plainly_lit, reconstructor, renderer};

const LAYERED: ReconstructionMethod = ReconstructionMethod::Layered;

struct CubeStage {
    scene: Scene,
    grid: CubeGrid,
    images: [LayeredDepthImage; 3],
}

impl CubeStage {
    fn new(scene: Scene, side: u32, kept: Kept) -> Self {
        let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
        let grid = CubeGrid::around(&scene.bounds(), side).expect("a grid");
        let images = [0, 1, 2]
            .map(|axis| renderer().draw_layers(plainly_lit(&on_device), &grid.camera(axis), kept).expect("layers"));
        Self { scene, grid, images }
    }

    fn upload(&self) -> SampleSet {
        let set = matt(self.scene.bounds(), self.scene.background);
        reconstructor().upload_cube(&self.grid, &self.images, &set).expect("a cube")
    }

    fn view(&self, camera: &PinholeCamera) -> View {
        let views = reconstructor().reconstruct(&self.upload(), &[*camera], LAYERED, ViewPlanes::ALL);
        views.expect("a view").remove(0)
    }

    fn twin(&self, camera: &PinholeCamera) -> View {
        let set = matt(self.scene.bounds(), self.scene.background);
        CubeTwin::new(&self.grid, &self.images).reconstruct(&set, camera)
    }
}

#[test]
fn the_walk_is_its_twin() {
    let mut bad = Vec::new();
    for (name, scene, corners) in corpus() {
        for kept in [Kept::Dominant, Kept::All] {
            let stage = CubeStage::new(scene.clone(), 64, kept);
            let agreement = Agreement::of(&stage.view(&corners.view()), &stage.twin(&corners.view()));
            let Agreement { kind, hits, close } = agreement;
            let samples: usize = stage.images.iter().map(LayeredDepthImage::sample_count).sum();
            println!("{name:<20} {kept:?} {samples:>7} samples {kind:>9.5} {hits:>6} {close:>8.5}");
            // Steep planes, which only `All` keeps, turn small differences of depth into large ones.
            let is_good = agreement.is_good() || kept == Kept::All && kind > 0.99 && close > 0.97;
            bad.extend((!is_good).then(|| format!("{name}, {kept:?}: {agreement:?}")));
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

#[test]
fn views_show_the_scene() {
    for (name, scene, corners) in corpus() {
        let stage = CubeStage::new(scene.clone(), 256, Kept::Dominant);
        let direct = Stage::new(scene, &corners.samples(1)).drawn_directly(&corners.view());
        let agreement = Agreement::of(&stage.view(&corners.view()), &direct);
        println!("{name}: {agreement:?}");
        // Poles and leaves are thinner than a few spacings.
        assert!(agreement.kind > 0.99 && agreement.hits > 500 && agreement.close > 0.75, "{name}: {agreement:?}");
    }
}

/// Seven mirrors on a ray's way: the ball and the post see one another, and both see the box.
#[test]
fn mirrors_show_what_direct_drawing_shows() {
    let scene = mirror_box();
    let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
    let lit = |lighting: &str| DrawWork { lighting: lighting.parse().expect(lighting), ..plainly_lit(&on_device) };
    let grid = CubeGrid::around(&scene.bounds(), 192).expect("a grid");
    let images = [0, 1, 2]
        .map(|axis| renderer().draw_layers(lit("shadows"), &grid.camera(axis), Kept::Dominant).expect("layers"));
    let description = SetDescription {
        illumination: &scene.illumination,
        highlight: Some(Highlight::Ggx),
        ..matt(scene.bounds(), scene.background)
    };
    let set = reconstructor().upload_cube(&grid, &images, &description).expect("a cube");
    let camera = looking(Vec3::new(0.4, 2.0, 6.5), Vec3::Y * 1.2, 40.0, UVec2::new(120, 90));
    let view = |reflections| {
        let mirrors = Mirrors { cells: &[], reflections };
        let views =
            reconstructor().reconstruct_mirrored(&set, mirrors, &[camera], LAYERED, ViewPlanes::ALL, Turn::default());
        views.expect("a view").remove(0)
    };
    let psnr = |a: &View, b: &View| {
        let [a, b] = [a, b].map(|view| Rgb8Image::of_view(view).expect("a picture"));
        psnr_db(&a, &b, None).expect("of one size").expect("pixels")
    };
    let direct =
        |lighting: &str| renderer().draw_views(lit(lighting), &[camera], ViewPlanes::ALL).expect("a view").remove(0);
    let [none, one, all] = [direct("shadows"), direct("shadows, reflections 1"), direct("shadows, reflections 7")];
    let own = [psnr(&view(0), &none), psnr(&view(1), &one), psnr(&view(7), &all)];
    let crossed = [psnr(&view(0), &all), psnr(&view(1), &all)];
    println!("as many mirrors: {own:.1?} dB; fewer than the seven: {crossed:.1?} dB");
    assert!(own.into_iter().all(|psnr_db| psnr_db > 25.0), "{own:?}");
    assert!(own[2] > crossed[1] + 1.0 && crossed[1] > crossed[0] + 2.0, "{own:?} {crossed:?}");
}

#[test]
fn loads_are_counted_and_several_views_are_those_of_each() {
    let (_, scene, corners) = corpus().remove(4);
    let set = CubeStage::new(scene, 64, Kept::Dominant).upload();
    let cameras = [corners.view(), corners.camera(-0.5, 0.5, corners.view().size_px)];
    let made = |cameras: &[PinholeCamera], counted| {
        reconstructor().reconstruct_measured(&set, cameras, LAYERED, ViewPlanes::ALL, counted).expect("views")
    };
    let (both, statistics) = made(&cameras, true);
    let loads = statistics.fetches_per_ray.expect("counted");
    println!("{loads} loads a ray");
    assert!((2.0..60.0).contains(&loads), "{loads}");
    let each: Vec<View> = cameras.iter().flat_map(|camera| made(&[*camera], false).0).collect();
    assert_eq!(both, each);
}

#[test]
fn sets_and_methods_that_do_not_belong_together_are_refused() {
    let (_, scene, corners) = corpus().remove(0);
    let cube = CubeStage::new(scene.clone(), 32, Kept::Dominant);
    let images = Stage::new(scene, &corners.samples(2)).upload();
    let refused =
        |set: &SampleSet, method| match reconstructor().reconstruct(set, &[corners.view()], method, ViewPlanes::ALL) {
            Err(error @ ReconstructionError::NoSamples { .. }) => error.to_string(),
            other => panic!("{other:?}"),
        };
    assert_eq!(refused(&images, LAYERED), "layered reconstructs views from a layered cube, which the sample set lacks");
    assert_eq!(
        refused(&cube.upload(), CARVE),
        "joint_carve reconstructs views from depth images, which the sample set lacks"
    );
}

#[test]
fn images_of_other_lines_are_refused_and_rays_from_anywhere_have_no_nan() {
    let (_, scene, corners) = corpus().remove(2);
    let stage = CubeStage::new(scene, 32, Kept::Dominant);
    let set = matt(stage.scene.bounds(), stage.scene.background);
    let [x, y, z] = stage.images.clone();
    let swapped = reconstructor().upload_cube(&stage.grid, &[y, x, z], &set);
    assert!(matches!(swapped, Err(ReconstructionError::Sample { index: 0, .. })));
    let center = stage.scene.bounds().center();
    // From within a wall, along an axis, along a texel's edge.
    for eye in [center, stage.grid.corner_in_world, stage.grid.corner_in_world + 4.0 * stage.grid.spacing_m] {
        for towards in [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::ONE, Vec3::new(-1.0, 1e-8, 0.0)] {
            let camera =
                PinholeCamera { eye_in_world: eye, ..looking(eye, eye + towards, 60.0, corners.view().size_px) };
            let view = stage.view(&camera);
            assert!(view.inverse_depth_per_m.iter().flatten().all(|depth| depth.is_finite()), "{eye} {towards}");
            assert_eq!(count(&view, ProvenanceKind::Filled), 0);
        }
    }
}
