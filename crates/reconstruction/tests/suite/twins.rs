//! The device's views are the scalar twins'.

use depth_image::{ProvenanceKind, View};
use fixtures::quad;
use glam::{UVec2, Vec3};
use reconstruction::{ReconstructionMethod, scalar};
use scene::{Instance, Scene};

use crate::stage::{Agreement, CARVE, Corners, SEARCH, Stage, VIEW_PX, corpus, depths, kinds, looking};

fn check(method: ReconstructionMethod) {
    let mut bad = Vec::new();
    println!("{:<20} {:>7} {:>9} {:>6} {:>8}", method.to_string(), "cameras", "same kind", "hits", "close");
    for (name, scene, corners) in corpus() {
        let whole = Stage::new(scene, &corners.samples(4));
        for cameras in [1, 2, 4] {
            let stage = Stage { images: whole.images[..cameras].to_vec(), ..whole.clone() };
            let agreement = Agreement::of(&stage.view(&corners.view(), method), &stage.twin(&corners.view(), method));
            let Agreement { kind, hits, close } = agreement;
            println!("{name:<20} {cameras:>7} {kind:>9.5} {hits:>6} {close:>8.5}");
            bad.extend((!agreement.is_good()).then(|| format!("{name}, {cameras} cameras: {agreement:?}")));
        }
    }
    assert!(bad.is_empty(), "{method}: {bad:#?}");
}

#[test]
fn the_carve_is_its_twin() {
    check(CARVE);
}

#[test]
fn the_carve_cut_short_is_its_twin() {
    check(ReconstructionMethod::JointCarve { stop_level: 2 });
}

#[test]
fn the_search_is_its_twin() {
    check(SEARCH);
}

/// One pixel to the left.
fn shifted(view: &View) -> View {
    let mut other = view.clone();
    other.srgb8.rotate_left(3);
    other.inverse_depth_per_m.as_mut().expect("depth").rotate_left(1);
    other.provenance.as_mut().expect("provenance").rotate_left(1);
    other
}

#[test]
fn a_shift_by_a_pixel_is_seen() {
    for (name, scene, corners) in corpus().into_iter().filter(|(name, ..)| *name != "quad") {
        let stage = Stage::new(scene, &corners.samples(2));
        let twin = stage.twin(&corners.view(), CARVE);
        assert!(Agreement::of(&twin, &twin).is_good(), "{name}");
        assert!(!Agreement::of(&stage.view(&corners.view(), CARVE), &shifted(&twin)).is_good(), "{name}");
    }
}

fn corpus_without_thin_things() -> impl Iterator<Item = (&'static str, Scene, Corners)> {
    corpus().into_iter().filter(|(name, ..)| ["uv-sphere", "courtyard", "quad"].contains(name))
}

#[test]
fn tiles_start_before_every_surface() {
    for (name, scene, corners) in corpus_without_thin_things() {
        let stage = Stage::new(scene, &corners.samples(4));
        let camera = corners.view();
        let starts = scalar::tile_starts_m(&stage.images, &stage.volume, &camera);
        let truth = stage.drawn_directly(&camera);
        let across = camera.size_px.x as usize;
        let ahead = depths(&truth).iter().enumerate().filter(|(_, inverse)| **inverse > 0.0).map(|(i, inverse)| {
            let tile = (i / across / 8) * across.div_ceil(8) + i % across / 8;
            (inverse.recip(), starts[tile])
        });
        let mut covered = 0;
        let mut skipped = 0;
        for (depth_m, start_m) in ahead {
            covered += 1;
            skipped += usize::from(start_m > depth_m * 1.002);
        }
        assert!(covered > 100 && skipped == 0, "{name}: {skipped} of {covered} surfaces lie before their tile's start");
        assert!(starts.iter().any(|&start| start > 1.0), "{name}: nothing is skipped");
    }
}

/// A wall, and a square of this half edge before it.
fn wall_behind(near_x_m: f32, half_edge_m: f32) -> Scene {
    let mut scene = quad(Vec3::NEG_Z * 10.0, 8.0, Vec3::Z, [180, 90, 40]);
    let near = quad(Vec3::new(near_x_m, 0.0, -4.0), half_edge_m, Vec3::Z, [40, 90, 180]);
    scene.instances.push(Instance { mesh: 1, ..near.instances[0] });
    scene.meshes.extend(near.meshes);
    scene
}

/// A tile of a coarse view is wider in a strip of samples than the coarsest nodes of their pyramid: all of it counts.
#[test]
fn tiles_start_before_every_surface_of_a_strip() {
    for near_x_m in [-2.0, -1.0, 0.5, 1.5] {
        let scene = wall_behind(near_x_m, 0.2);
        let camera = |x: f32, size_px| looking(Vec3::X * x, Vec3::new(x, 0.0, -1.0), 5.0, size_px);
        let stage = Stage::new(scene, &[camera(-0.1, UVec2::new(1024, 64)), camera(0.1, UVec2::new(1024, 64))]);
        let view = camera(0.0, UVec2::new(64, 4));
        let starts = scalar::tile_starts_m(&stage.images, &stage.volume, &view);
        let drawn = stage.drawn_directly(&view);
        let truth = depths(&drawn);
        let nearest_m = |tile: usize| {
            let pixels = (0..4).flat_map(|row| (0..8).map(move |column| row * 64 + tile * 8 + column));
            pixels.map(|pixel| truth[pixel].recip()).fold(f32::INFINITY, f32::min)
        };
        assert!((0..8).any(|tile| nearest_m(tile) < 4.1), "the near quad is seen");
        for (tile, &start_m) in starts.iter().enumerate() {
            assert!(start_m <= nearest_m(tile) * 1.002, "near at {near_x_m} m, tile {tile}: {start_m} m");
        }
        for method in [CARVE, SEARCH] {
            let agreement = Agreement::of(&stage.view(&view, method), &stage.twin(&view, method));
            assert!(agreement.close >= 0.95, "near at {near_x_m} m, {method}: {agreement:?}");
        }
    }
}

#[test]
fn starting_at_the_volume_finds_the_same_surfaces() {
    for (name, scene, corners) in corpus_without_thin_things() {
        let stage = Stage::new(scene, &corners.samples(4));
        for method in [CARVE, SEARCH] {
            let camera = corners.view();
            let from_entry = scalar::reconstruct_from_entry(&stage.images, &stage.description(), &camera, method);
            let tiled = stage.twin(&camera, method);
            let hit = |view: &View| kinds(view).into_iter().map(|k| k == ProvenanceKind::Hit).collect::<Vec<_>>();
            let differ = hit(&tiled).into_iter().zip(hit(&from_entry)).filter(|(a, b)| a != b).count();
            let agreement = Agreement::of(&tiled, &from_entry);
            println!("{name} {method}: {differ} pixels hit in one only, {agreement:?}");
            assert!(differ * 200 <= kinds(&tiled).len() && agreement.close >= 0.98, "{name} {method}: {agreement:?}");
        }
    }
}

/// The coarsest level of a wide image has two nodes: a near surface in the second is not lost.
#[test]
fn the_coarsest_levels_of_wide_images_are_whole() {
    let mut bad = Vec::new();
    for near_x_m in [-1.0, 1.0] {
        let scene = wall_behind(near_x_m, 0.5);
        let camera = |x: f32, size_px| looking(Vec3::X * x, Vec3::new(x, 0.0, -1.0), 45.0, size_px);
        let stage = Stage::new(scene, &[camera(-0.1, UVec2::new(96, 60)), camera(0.1, UVec2::new(96, 60))]);
        for stop_level in [0, 6, 8] {
            let method = ReconstructionMethod::JointCarve { stop_level };
            // Off every symmetry: a silhouette right between two columns is a tie that rounding decides.
            let view = camera(0.0371, VIEW_PX);
            let agreement = Agreement::of(&stage.view(&view, method), &stage.twin(&view, method));
            println!("near at {near_x_m} m, {method}: {agreement:?}");
            bad.extend((!agreement.is_good()).then(|| format!("near at {near_x_m} m, {method}: {agreement:?}")));
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}
