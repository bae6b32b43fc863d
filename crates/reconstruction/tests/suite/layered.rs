//! Views from layered depth cubes.

use depth_image::{
    Aabb, CubeGrid, CubeImages, Highlight, LayeredDepthImage, PinholeCamera, ProvenanceKind, View, ViewPlanes,
};
use fixtures::{mirror_box, quad};
use glam::{Affine3A, Quat, UVec2, Vec3};
use gpu::Turn;
use metrics::psnr_db;
use reconstruction::scalar::CubeTwin;
use reconstruction::{
    Mirrors, ReconstructRequest, ReconstructionError, ReconstructionMethod, SampleSet, SetDescription,
};
use render::{DrawWork, GpuScene, LayerSelection};
use scene::{Instance, Scene};

use crate::stage::{
    Agreement, CARVE, Stage, corpus, count, depths, gpu, looking, matt, plainly_lit, reconstruct, reconstructor,
    renderer,
};

const LAYERED: ReconstructionMethod = ReconstructionMethod::LAYERED;

pub struct CubeStage {
    pub scene: Scene,
    pub grid: CubeGrid,
    pub images: [LayeredDepthImage; 3],
}

impl CubeStage {
    pub fn new(scene: Scene, side: u32, kept: LayerSelection) -> Self {
        let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
        let grid = CubeGrid::around(&scene.bounds(), side).expect("a grid");
        let images = [0, 1, 2]
            .map(|axis| renderer().draw_layers(plainly_lit(&on_device), &grid.camera(axis), kept).expect("layers"));
        Self { scene, grid, images }
    }

    pub fn upload(&self) -> SampleSet {
        let set = matt(self.scene.bounds(), self.scene.background);
        let cube = CubeImages { grid: self.grid, images: self.images.clone(), light_field: None };
        reconstructor().upload_cube(&cube, &set, Turn::default()).expect("a cube")
    }

    pub fn view(&self, camera: &PinholeCamera) -> View {
        let views = reconstruct(&self.upload(), &[*camera], LAYERED, ViewPlanes::ALL);
        views.expect("a view").remove(0)
    }

    pub fn twin(&self, camera: &PinholeCamera) -> View {
        let set = matt(self.scene.bounds(), self.scene.background);
        CubeTwin::new(&self.grid, &self.images).reconstruct(&set, camera)
    }
}

#[test]
fn the_walk_is_its_twin() {
    let mut bad = Vec::new();
    for (name, scene, corners) in corpus() {
        for kept in [LayerSelection::Dominant, LayerSelection::All] {
            let stage = CubeStage::new(scene.clone(), 64, kept);
            let agreement = Agreement::of(&stage.view(&corners.view()), &stage.twin(&corners.view()));
            let Agreement { kind, hits, close } = agreement;
            let samples: usize = stage.images.iter().map(LayeredDepthImage::sample_count).sum();
            println!("{name:<20} {kept:?} {samples:>7} samples {kind:>9.5} {hits:>6} {close:>8.5}");
            // Steep planes, which only `All` keeps, turn small differences of depth into large ones.
            let is_good = agreement.is_good() || kept == LayerSelection::All && kind > 0.99 && close > 0.97;
            bad.extend((!is_good).then(|| format!("{name}, {kept:?}: {agreement:?}")));
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

#[test]
fn views_show_the_scene() {
    for (name, scene, corners) in corpus() {
        let stage = CubeStage::new(scene.clone(), 256, LayerSelection::Dominant);
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
    let images = [0, 1, 2].map(|axis| {
        renderer().draw_layers(lit("shadows"), &grid.camera(axis), LayerSelection::Dominant).expect("layers")
    });
    let description = SetDescription {
        illumination: &scene.illumination,
        highlight: Some(Highlight::Ggx),
        ..matt(scene.bounds(), scene.background)
    };
    let cube = CubeImages { grid, images, light_field: None };
    let set = reconstructor().upload_cube(&cube, &description, Turn::default()).expect("a cube");
    let camera = looking(Vec3::new(0.4, 2.0, 6.5), Vec3::Y * 1.2, 40.0, UVec2::new(120, 90));
    let view = |reflections| {
        let mirrors = Mirrors { cells: &[], reflections, glossy_rays: 0 };
        let views = reconstructor().reconstruct(ReconstructRequest {
            common: mirrors.into(),
            planes: ViewPlanes::ALL,
            ..ReconstructRequest::new(&set, &[camera], LAYERED)
        });
        views.expect("a view").remove(0)
    };
    let psnr = |a: &View, b: &View| psnr_db(a, b, None).expect("of one size").expect("pixels");
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
fn several_views_are_those_of_each() {
    let (_, scene, corners) = corpus().remove(4);
    let set = CubeStage::new(scene, 64, LayerSelection::Dominant).upload();
    let cameras = [corners.view(), corners.camera(-0.5, 0.5, corners.view().size_px)];
    let made = |cameras: &[PinholeCamera]| reconstruct(&set, cameras, LAYERED, ViewPlanes::ALL).expect("views");
    let both = made(&cameras);
    let each: Vec<View> = cameras.iter().flat_map(|camera| made(&[*camera])).collect();
    assert_eq!(both, each);
}

#[test]
fn sets_and_methods_that_do_not_belong_together_are_refused() {
    let (_, scene, corners) = corpus().remove(0);
    let cube = CubeStage::new(scene.clone(), 32, LayerSelection::Dominant);
    let images = Stage::new(scene, &corners.samples(2)).upload();
    let refused = |set: &SampleSet, method| match reconstruct(set, &[corners.view()], method, ViewPlanes::ALL) {
        Err(error @ ReconstructionError::NoSamples { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    assert_eq!(refused(&images, LAYERED), "layered needs a layered cube, which the sample set lacks");
    assert_eq!(refused(&cube.upload(), CARVE), "joint_carve needs depth images, which the sample set lacks");
}

#[test]
fn images_of_other_lines_are_refused() {
    let (_, scene, _) = corpus().remove(2);
    let stage = CubeStage::new(scene, 32, LayerSelection::Dominant);
    let set = matt(stage.scene.bounds(), stage.scene.background);
    let [x, y, z] = stage.images.clone();
    let cube = CubeImages { grid: stage.grid, images: [y, x, z], light_field: None };
    let swapped = reconstructor().upload_cube(&cube, &set, Turn::default());
    assert!(matches!(swapped, Err(ReconstructionError::Sample { index: 0, .. })));
}

/// From a face between voxels along an axis, from within a wall, from a corner, and from so far away that a spacing is a rounding.
#[test]
fn rays_from_anywhere_end_where_their_twins_do() {
    let (_, scene, _) = corpus().remove(2);
    let stage = CubeStage::new(scene, 32, LayerSelection::Dominant);
    let bounds = stage.scene.bounds();
    let grid = stage.grid;
    let middle = grid.corner_in_world + (grid.size / 2).as_vec3() * grid.spacing_m;
    let extent_m = bounds.size().max_element();
    let mut places =
        vec![(middle, 60.0_f32), (grid.corner_in_world, 60.0), (bounds.center() + 0.1 * grid.spacing_m, 60.0)];
    places.extend([Vec3::X, Vec3::Y, Vec3::new(0.6, 0.5, 0.62)].map(|away| (middle + away * 3000.0 * extent_m, 0.03)));
    let mut hits = 0;
    for (eye, fov_y_deg) in places {
        let is_within = eye.distance(middle) < 2.0 * extent_m;
        let within = [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_X, Vec3::ONE, Vec3::new(-1.0, 1e-7, 1e-6)];
        let towards = if is_within { within.to_vec() } else { vec![middle - eye] };
        for towards in towards {
            let camera = looking(eye, eye + towards, fov_y_deg, UVec2::new(33, 25));
            let camera = PinholeCamera { near_m: 0.25 * grid.spacing_m, ..camera };
            let view = stage.view(&camera);
            let twin = stage.twin(&camera);
            let Agreement { kind, hits: own, .. } = Agreement::of(&view, &twin);
            println!("{eye} {towards}: {kind} of a kind, {own} hits");
            assert!(depths(&view).iter().all(|depth| depth.is_finite()), "{eye} {towards}");
            assert_eq!(count(&view, ProvenanceKind::Filled), 0, "{eye} {towards}: the walk came to no end");
            assert!(kind > 0.97, "{eye} {towards}: {kind}");
            hits += own;
        }
    }
    assert!(hits > 4000, "{hits}");
}

/// Lines that run aslant through the scene.
#[test]
fn a_turned_cube_is_its_twin() {
    let (_, scene, corners) = corpus().remove(2);
    let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
    let bounds = scene.bounds();
    let around = Aabb {
        min: bounds.center() - 0.9 * bounds.size().max_element(),
        max: bounds.center() + 0.9 * bounds.size().max_element(),
    };
    let turned = Quat::from_rotation_y(0.5) * Quat::from_rotation_x(0.3);
    let straight = CubeGrid::around(&around, 96).expect("a grid");
    let half_m = straight.size.as_vec3() * (0.5 * straight.spacing_m);
    let grid = CubeGrid { world_from_cube: turned, corner_in_world: bounds.center() - turned * half_m, ..straight };
    let images = [0, 1, 2].map(|axis| {
        renderer().draw_layers(plainly_lit(&on_device), &grid.camera(axis), LayerSelection::Dominant).expect("layers")
    });
    let stage = CubeStage { scene, grid, images };
    let agreement = Agreement::of(&stage.view(&corners.view()), &stage.twin(&corners.view()));
    println!("{agreement:?}");
    assert!(agreement.kind > 0.99 && agreement.close > 0.97 && agreement.hits > 1000, "{agreement:?}");
}

/// Of 300 sheets above one another a line holds 255: from below nothing is known of the others.
#[test]
fn lines_with_too_many_surfaces_leave_pixels_unknown() {
    let sheet = quad(Vec3::ZERO, 1.0, Vec3::Y, [200, 60, 40]);
    let placed = |number: u32| Instance {
        mesh: 0,
        world_from_mesh: Affine3A::from_translation(Vec3::Y * (number as f32 * 0.01)),
    };
    let scene = Scene { instances: (0..300).map(placed).collect(), ..sheet };
    let stage = CubeStage::new(scene, 16, LayerSelection::Dominant);
    let above = &stage.images[1];
    assert_eq!((above.layer_count(), above.truncated), (255, true));
    assert!(stage.images.iter().all(|image| image.validate().is_ok()));
    let beside = looking(Vec3::new(0.0, 6.0, 4.0), Vec3::Y * 1.5, 40.0, UVec2::new(32, 24));
    let view = stage.view(&beside);
    println!("{} hits, {} filled", count(&view, ProvenanceKind::Hit), count(&view, ProvenanceKind::Filled));
    assert!(count(&view, ProvenanceKind::Hit) > 50 && count(&view, ProvenanceKind::Filled) > 50);
    assert_eq!(count(&view, ProvenanceKind::Empty), 0);
}
