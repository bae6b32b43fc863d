//! Views from layered depth cubes.

use depth_image::{CubeGrid, LayeredDepthImage, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use glam::Vec3;
use reconstruction::scalar::CubeTwin;
use reconstruction::{ReconstructionError, ReconstructionMethod, SampleSet};
use render::{GpuScene, Kept};
use scene::Scene;

use crate::stage::{Agreement, CARVE, Stage, corpus, count, gpu, matt, plainly_lit, reconstructor, renderer};

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
    }
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
            let camera = PinholeCamera {
                eye_in_world: eye,
                ..crate::stage::looking(eye, eye + towards, 60.0, corners.view().size_px)
            };
            let view = stage.view(&camera);
            assert!(view.inverse_depth_per_m.iter().flatten().all(|depth| depth.is_finite()), "{eye} {towards}");
            assert_eq!(count(&view, ProvenanceKind::Filled), 0);
        }
    }
}
