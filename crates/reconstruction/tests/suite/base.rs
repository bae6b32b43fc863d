//! A layered depth cube beside depth images: what these leave unknown is walked in it.

use depth_image::{Antialias, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use glam::UVec2;
use gpu::Turn;
use reconstruction::{CommonSets, Mirrors, ReconstructionError, ReconstructionMethod, SampleSet};
use render::LayerSelection;

use crate::layered::CubeStage;
use crate::meshes::all_meshes;
use crate::stage::{CARVE, Stage, colors_differ_by, corpus, count, depths, kinds, psnr_db, reconstructor};

fn view(
    set: &SampleSet,
    base: Option<&SampleSet>,
    camera: &PinholeCamera,
    (method, planes): (ReconstructionMethod, ViewPlanes),
) -> Result<View, ReconstructionError> {
    let shared = CommonSets { mirrors: Mirrors::default(), base };
    let views = reconstructor().reconstruct_with(set, shared, &[*camera], method, planes, Turn::default());
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
        let (set, base, twin) = (stage.upload(), cube.upload(), cube.twin(&camera));
        let [without, with] =
            [None, Some(&base)].map(|base| view(&set, base, &camera, (CARVE, ViewPlanes::ALL)).expect("a view"));
        let is_left: Vec<bool> = kinds(&without).iter().map(|&kind| kind == ProvenanceKind::Filled).collect();
        let left = is_left.iter().filter(|&&is| is).count();
        let (mut known_alike, mut left_alike) = (true, 0);
        for (pixel, &is_left) in is_left.iter().enumerate() {
            let same = |a: &View, b: &View| colors_differ_by(a, b, pixel) <= 2;
            let (found, walked) = (kinds(&with)[pixel], kinds(&twin)[pixel]);
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
        let (set, base, truth) = (stage.upload(), cube.upload(), stage.drawn_directly(&camera));
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
    let (set, base) = (stage.upload(), cube.upload());
    let shared = CommonSets { base: Some(&base), ..CommonSets::default() };
    let moved = PinholeCamera { eye_in_world: camera.eye_in_world * 1.02, ..camera };
    let made = |cameras: &[PinholeCamera]| {
        let turn = Turn::default();
        reconstructor().reconstruct_with(&set, shared, cameras, CARVE, ViewPlanes::ALL, turn).expect("views")
    };
    assert!(made(&[camera, moved]) == [made(&[camera]), made(&[moved])].concat());
}

#[test]
fn a_base_without_a_cube_is_refused_and_views_of_a_cube_need_none() {
    let (_, stage, cube, camera) = gaps().remove(1);
    let (set, base) = (stage.upload(), cube.upload());
    let refused = view(&set, Some(&set), &camera, (CARVE, ViewPlanes::COLOR)).expect_err("no cube");
    assert_eq!(refused.to_string(), "a base needs a layered cube, which the sample set lacks");
    let walked = |beside| view(&base, beside, &camera, (ReconstructionMethod::LAYERED, ViewPlanes::ALL));
    assert!(walked(None).expect("a view") == walked(Some(&base)).expect("a view"));
}
