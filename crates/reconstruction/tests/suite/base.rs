//! A layered depth cube beside depth images: what these leave unknown is walked in it.

use depth_image::{Antialias, CubeImages, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use fixtures::teapot_spheres;
use glam::{UVec2, Vec3};
use gpu::Turn;
use reconstruction::{CommonSets, Mirrors, ReconstructRequest, ReconstructionError, ReconstructionMethod, SampleSet};
use render::LayerSelection;

use crate::layered::CubeStage;
use crate::light_field::{Gathering, GlossyFloor, changed};
use crate::meshes::all_meshes;
use crate::mirrors::images;
use crate::stage::{
    CARVE, Stage, colors_differ_by, corpus, count, depths, description, kinds, looking, psnr_db, reconstructor,
    renderer,
};

fn view(
    set: &SampleSet,
    base: Option<&SampleSet>,
    camera: &PinholeCamera,
    (method, planes): (ReconstructionMethod, ViewPlanes),
) -> Result<View, ReconstructionError> {
    let shared = CommonSets { base, ..CommonSets::default() };
    let views = reconstructor().reconstruct(ReconstructRequest {
        common: shared,
        planes,
        ..ReconstructRequest::new(set, &[*camera], method)
    });
    views.map(|mut views| views.remove(0))
}

/// Scenes of which two images leave much unknown, and a view from beside both.
fn gaps() -> Vec<(&'static str, Stage, CubeStage, PinholeCamera)> {
    let hidden = corpus().into_iter().filter(|(name, ..)| ["poles", "courtyard", "tree-terrain-30k"].contains(name));
    let stage = |(name, scene, corners): (_, scene::Scene, crate::stage::Corners)| {
        let cube = CubeStage::new(scene.clone(), 192, LayerSelection::Dominant);
        let beside = corners.camera(2.5, -0.4, UVec2::new(96, 72));
        (name, Stage::with_corners(scene, &corners.samples(2)), cube, beside)
    };
    hidden.map(stage).collect()
}

#[test]
fn what_images_leave_is_the_walk_and_all_else_stays() {
    for (name, stage, cube, camera) in gaps() {
        let set = stage.upload();
        let base = cube.upload();
        let twin = cube.twin(&camera);
        let [without, with] =
            [None, Some(&base)].map(|base| view(&set, base, &camera, (CARVE, ViewPlanes::ALL)).expect("a view"));
        let is_left: Vec<bool> = kinds(&without).iter().map(|&kind| kind == ProvenanceKind::Filled).collect();
        let left = is_left.iter().filter(|&&is| is).count();
        let mut known_alike = true;
        let mut left_alike = 0;
        for (pixel, &is_left) in is_left.iter().enumerate() {
            let same = |a: &View, b: &View| colors_differ_by(a, b, pixel) <= 2;
            let found = kinds(&with)[pixel];
            let walked = kinds(&twin)[pixel];
            let is_of_walk = (found == ProvenanceKind::Base) == (walked == ProvenanceKind::Hit);
            match is_left {
                true => left_alike += usize::from(is_of_walk && same(&with, &twin)),
                false => known_alike &= found == kinds(&without)[pixel] && same(&with, &without),
            }
        }
        let filled = count(&with, ProvenanceKind::Filled);
        println!("{name}: {left} left, {left_alike} as the twin walks, {filled} filled");
        assert!(left > 60 && known_alike, "{name}: {left}");
        assert!(left_alike as f64 > 0.97 * left as f64 && filled == 0, "{name}: {left_alike} of {left}");
        assert!(depths(&with).iter().all(|depth| depth.is_finite()), "{name}");
    }
}

#[test]
fn every_method_gains_where_it_filled_by_several_samples_a_pixel_too() {
    let methods = all_meshes().into_iter().chain([CARVE]);
    let antialias = Antialias::of(4).expect("four samples");
    for (name, stage, cube, camera) in gaps() {
        let set = stage.upload();
        let base = cube.upload();
        let truth = stage.drawn_directly(&camera);
        for (method, antialias) in methods.clone().flat_map(|method| [(method, Antialias::NONE), (method, antialias)]) {
            let made = |base| {
                view(&set, base, &camera, (method, ViewPlanes { antialias, ..ViewPlanes::ALL })).expect("a view")
            };
            let [without, with] = [None, Some(&base)].map(made);
            let filled: Vec<bool> = kinds(&without).iter().map(|&kind| kind == ProvenanceKind::Filled).collect();
            let [before, after] = [&without, &with].map(|view| psnr_db(&truth, view, &filled));
            println!("{name}, {method}, {antialias:?}: {before:.1} dB where it fills, {after:.1} dB with a base");
            assert!(after > before, "{name}, {method}, {antialias:?}: {before} and {after} dB");
            assert_eq!(count(&with, ProvenanceKind::Filled), 0, "{name}, {method}");
        }
    }
}

#[test]
fn views_together_are_those_of_each() {
    let (_, stage, cube, camera) = gaps().remove(1);
    let set = stage.upload();
    let base = cube.upload();
    let shared = CommonSets { base: Some(&base), ..CommonSets::default() };
    let moved = PinholeCamera { eye_in_world: camera.eye_in_world * 1.02, ..camera };
    let made = |cameras: &[PinholeCamera]| {
        let turn = Turn::default();
        reconstructor()
            .reconstruct(ReconstructRequest {
                common: shared,
                turn,
                planes: ViewPlanes::ALL,
                ..ReconstructRequest::new(&set, cameras, CARVE)
            })
            .expect("views")
    };
    assert!(made(&[camera, moved]) == [made(&[camera]), made(&[moved])].concat());
}

#[test]
fn a_base_without_a_cube_is_refused_and_views_of_a_cube_need_none() {
    let (_, stage, cube, camera) = gaps().remove(1);
    let set = stage.upload();
    let base = cube.upload();
    let refused = view(&set, Some(&set), &camera, (CARVE, ViewPlanes::COLOR)).expect_err("no cube");
    assert_eq!(refused.to_string(), "a base needs a layered cube, which the sample set lacks");
    let walked = |beside| view(&base, beside, &camera, (ReconstructionMethod::LAYERED, ViewPlanes::ALL));
    assert!(walked(None).expect("a view") == walked(Some(&base)).expect("a view"));
}

/// Depth images of a lit scene, from around its view.
fn set_of(stage: &Gathering) -> SampleSet {
    let eye = stage.camera.eye_in_world;
    let sample = |(x, y): (f32, f32)| {
        let aside = Vec3::new(x, y, -x);
        looking(eye + aside, Vec3::Y + aside, 44.0, UVec2::new(240, 180))
    };
    let cameras = [(-0.2, -0.2), (0.2, 0.2), (0.2, -0.2), (-0.2, 0.2)].map(sample);
    reconstructor()
        .upload(&images(&stage.on_device, &cameras), &description(&stage.scene), Turn::default())
        .expect("a sample set")
}

fn lit_view(set: &SampleSet, base: Option<&SampleSet>, stage: &Gathering, rays: (u32, u32)) -> View {
    let mirrors = Mirrors { cells: &[], reflections: rays.0, glossy_rays: rays.1 };
    let shared = CommonSets { mirrors, base, ..CommonSets::default() };
    let views = reconstructor().reconstruct(ReconstructRequest {
        common: shared,
        planes: ViewPlanes::ALL,
        ..ReconstructRequest::new(set, &[stage.camera], CARVE)
    });
    views.expect("a view").remove(0)
}

#[test]
fn rough_surfaces_of_images_show_what_a_base_holds() {
    let floor = GlossyFloor::new();
    // The view's own image: errors are those of what the floor shows.
    let own_image = images(&floor.stage.on_device, &[floor.stage.camera]);
    let set =
        reconstructor().upload(&own_image, &description(&floor.stage.scene), Turn::default()).expect("a sample set");
    let base = floor.stage.set(None);
    let plain = lit_view(&set, None, &floor.stage, (0, 0));
    assert!(lit_view(&set, None, &floor.stage, (0, 16)) == plain, "without a base all is as without the term");
    let none = floor.psnr_db(&plain);
    let of_rays = [1, 4, 16].map(|rays| {
        let view = lit_view(&set, Some(&base), &floor.stage, (0, rays));
        let from_base = kinds(&view).into_iter().zip(&floor.pixels).filter(|(k, is)| **is && *k == ProvenanceKind::Base);
        let share = from_base.count() as f64 / floor.pixels.iter().filter(|&&is| is).count() as f64;
        let [own, drawn] = [floor.psnr_db(&view), floor.direct_db(rays)];
        println!("{rays} rays: {own:.2} dB in a base, {drawn:.2} dB drawn directly, {none:.2} dB without; {share:.3} of the base");
        assert!(own > drawn.min(33.5) - 1.5 && share > 0.95, "{rays}: {own} {drawn} {share}");
        own
    });
    assert!(of_rays[2] > none + 3.0 && of_rays.is_sorted(), "{of_rays:?}, {none}");
}

#[test]
fn a_scene_without_mirrors_looks_the_same_whether_reflections_are_followed_or_not() {
    let floor = GlossyFloor::new();
    let set = set_of(&floor.stage);
    let base = floor.stage.set(None);
    let planes = ViewPlanes { antialias: Antialias::of(4).expect("offered"), ..ViewPlanes::ALL };
    let [followed, plain] = [3, 0].map(|reflections| {
        let shared = CommonSets {
            mirrors: Mirrors { reflections, ..Mirrors::default() },
            base: Some(&base),
            ..CommonSets::default()
        };
        let cameras = [floor.stage.camera];
        reconstructor()
            .reconstruct(ReconstructRequest {
                common: shared,
                planes,
                ..ReconstructRequest::new(&set, &cameras, CARVE)
            })
            .expect("a view")
    });
    assert!(followed == plain);
}

#[test]
fn rays_into_lobes_that_a_truncated_base_does_not_hold_are_guessed() {
    let floor = GlossyFloor::new();
    let mut images = floor.stage.images();
    images[0].truncated = true;
    let base = floor.stage.upload(&CubeImages { grid: floor.stage.grid, images, light_field: None });
    let view = lit_view(&set_of(&floor.stage), Some(&base), &floor.stage, (0, 8));
    let [guessed, known] = [ProvenanceKind::Guessed, ProvenanceKind::Base].map(|kind| count(&view, kind));
    println!("{guessed} guessed, {known} known");
    assert!(guessed > 1000 && known > 20, "{guessed} {known}");
}

/// Of the images, of pixels that only the base shows, and of several samples a pixel.
#[test]
fn lobes_and_mirrors_beside_images_are_those_of_direct_drawing() {
    let camera = looking(Vec3::new(8.0, 4.5, 8.0), Vec3::Y, 40.0, UVec2::new(80, 60));
    let stage = Gathering::new(teapot_spheres(), camera);
    let other = looking(Vec3::new(8.2, 4.6, 8.0), Vec3::Y, 40.0, UVec2::new(80, 60));
    let set = set_of(&stage);
    let base = stage.set(None);
    let planes = ViewPlanes { antialias: Antialias::of(4).expect("offered"), ..ViewPlanes::ALL };
    let made = |cameras: &[PinholeCamera], reflections, glossy_rays| {
        let shared = CommonSets {
            mirrors: Mirrors { cells: &[], reflections, glossy_rays },
            base: Some(&base),
            ..CommonSets::default()
        };
        reconstructor()
            .reconstruct(ReconstructRequest { common: shared, planes, ..ReconstructRequest::new(&set, cameras, CARVE) })
            .expect("views")
    };
    let views = made(&[camera, other], 2, 16);
    assert!(views[1] == made(&[other], 2, 16)[0], "views of a batch are those of each");
    let drawn = |lighting| renderer().draw_views(stage.lit(lighting), &[camera], planes).expect("a view").remove(0);
    let [none, truth] = ["shadows", "shadows, reflections 2, glossy 64"].map(drawn);
    let pixels = changed(&none, &truth);
    let [own, mirrors, without] =
        [&views[0], &made(&[camera], 2, 0)[0], &made(&[camera], 0, 0)[0]].map(|view| psnr_db(&truth, view, &pixels));
    println!("{own:.2} dB, with mirrors alone {mirrors:.2}, without mirrors and lobes {without:.2} dB");
    assert!(own > 24.0 && own > mirrors + 1.5 && mirrors > without + 1.5, "{own} {mirrors} {without}");
    let walked = views[0].provenance.as_ref().expect("provenance");
    assert!(walked.iter().any(|of| of.kind() == ProvenanceKind::Base));
}
