//! Meshes of images without planes or samples, and meshes that are asked for again.

use crate::stage::reconstruct;
use depth_image::{BACKGROUND_INVERSE_DEPTH, HOLE_INVERSE_DEPTH, ProvenanceKind, ViewPlanes};
use fixtures::uv_sphere;
use glam::{UVec2, Vec3};
use reconstruction::{MeshStatistics, ReconstructionError};
use scene::procedural::tree_terrain;

use crate::{
    holes_and_limits::odd_cameras,
    meshes::{HYBRID, MESH, all_meshes, merged},
    stage::{Agreement, CARVE, Corners, Stage, VIEW_PX, assert_sane, count, reconstructor},
};

fn corners() -> Corners {
    Corners { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.6 }
}

fn stage(cameras: usize) -> Stage {
    Stage::with_corners(uv_sphere(1.0, 24), &corners().samples(cameras))
}

#[test]
fn a_missing_plane_is_named() {
    let mut without_normals = stage(2);
    without_normals.images[1].normal_oct16 = None;
    let mut without_corners = stage(2);
    without_corners.images[0].corner_inverse_depth_per_m = None;
    for (stage, expected) in [(without_normals, (1, "normal")), (without_corners, (0, "corner_inverse_depth"))] {
        let set = stage.upload();
        for method in [HYBRID, merged(1.0)] {
            let error = reconstruct(&set, &[corners().view()], method, ViewPlanes::ALL).expect_err("a plane");
            let ReconstructionError::MissingPlane { index, plane } = error else { panic!("{error}") };
            assert_eq!((index, plane), expected, "{method}");
        }
        // Others need none of them.
        for method in [MESH, CARVE] {
            assert!(reconstruct(&set, &[corners().view()], method, ViewPlanes::ALL).is_ok(), "{method}");
        }
    }
}

#[test]
fn nothing_seen_is_nothing_shown() {
    for (depth, kind) in
        [(HOLE_INVERSE_DEPTH, ProvenanceKind::Filled), (BACKGROUND_INVERSE_DEPTH, ProvenanceKind::Empty)]
    {
        let mut stage = stage(2);
        for image in &mut stage.images {
            image.inverse_depth_per_m.fill(depth);
            image.corner_inverse_depth_per_m.as_mut().expect("corners").fill(depth);
        }
        for method in all_meshes() {
            let found = reconstructor().mesh_statistics(&stage.upload(), method).expect("statistics").expect("a mesh");
            assert_eq!(MeshStatistics { device_s: 0.0, ..found }, MeshStatistics::default(), "{method}");
            let view = stage.view(&corners().view(), method);
            assert_sane(&view, &method.to_string());
            // Parts of a view miss the volume.
            let [hit, of_kind] = [ProvenanceKind::Hit, kind].map(|kind| count(&view, kind));
            println!("{depth} {method}: {hit} hits, {of_kind} {kind:?}");
            assert!(hit == 0 && of_kind * 2 > view.size_px.element_product() as usize, "{depth} {method}");
        }
    }
}

/// Bounds are free to choose: old cuts make room, and come back the same.
#[test]
fn many_bounds_take_turns() {
    let set = stage(2).upload();
    let counts = |px| reconstructor().mesh_statistics(&set, merged(px)).expect("statistics").map(|found| found.quads);
    let bounds = [0.1, 0.2, 0.4, 0.8, 1.6, 3.2];
    let first = bounds.map(counts);
    assert!(first.is_sorted_by(|a, b| a >= b) && first[0] > first[5], "{first:?}");
    assert_eq!(bounds.map(counts), first);
}

/// From below, from within, from afar: quads before and behind the eye.
#[test]
fn drawn_views_from_anywhere_are_pictures() {
    let corners = Corners { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::Y * 0.3, half_m: 0.4 };
    let stage = Stage::with_corners(tree_terrain(10_000, 1), &corners.samples(4));
    let (names, cameras): (Vec<_>, Vec<_>) = odd_cameras().into_iter().unzip();
    for method in all_meshes() {
        for ((view, camera), name) in stage.views(&cameras, method).iter().zip(&cameras).zip(&names) {
            assert_sane(view, &format!("{method}: {name}"));
            let Agreement { kind, hits, close } = Agreement::of(view, &stage.twin(camera, method));
            println!("{method:<16} {name:<28} {kind:.4} same kind, {hits} hits, {close:.4} close");
            assert!(kind >= 0.99 && (hits == 0 || close >= 0.97), "{method} {name}: {kind} {close}");
        }
    }
}

#[test]
fn searches_have_no_mesh() {
    let set = stage(1).upload();
    assert!(reconstructor().mesh_statistics(&set, CARVE).expect("no error").is_none());
    assert!(reconstructor().read_quads(&set, CARVE).expect("no error").is_empty());
}

#[test]
fn the_same_set_gives_the_same_quads_and_views() {
    let stage = stage(4);
    for method in all_meshes() {
        let [a, b] = [stage.upload(), stage.upload()];
        let quads = |set| reconstructor().read_quads(set, method).expect("quads");
        assert!(quads(&a) == quads(&b), "{method}");
        let view = |set| reconstruct(set, &[corners().view()], method, ViewPlanes::ALL).expect("a view");
        assert!(view(&a) == view(&a) && view(&a) == view(&b), "{method}");
    }
}

#[test]
fn many_views_of_many_sizes_are_single_views() {
    let set = stage(3).upload();
    let sizes = [VIEW_PX, VIEW_PX, UVec2::new(31, 17), UVec2::ONE, VIEW_PX, UVec2::new(8, 100)];
    let cameras: Vec<_> =
        sizes.iter().enumerate().map(|(i, &size_px)| corners().camera(i as f32 / 6.0, -0.3, size_px)).collect();
    for method in all_meshes() {
        let views = reconstruct(&set, &cameras, method, ViewPlanes::ALL).expect("views");
        for (camera, view) in cameras.iter().zip(&views) {
            let single = reconstruct(&set, &[*camera], method, ViewPlanes::ALL).expect("a view");
            assert!(single[0] == *view, "{method} {:?}", camera.size_px);
        }
    }
}
