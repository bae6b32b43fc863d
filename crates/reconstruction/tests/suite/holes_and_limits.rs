//! Views from anywhere, and images with holes: every number is finite.

use depth_image::{HOLE_INVERSE_DEPTH, PinholeCamera, ProvenanceKind, ViewPlanes};
use fixtures::quad;
use glam::{UVec2, Vec3};
use scene::procedural::{courtyard, tree_terrain};

use crate::stage::{CARVE, Corners, SAMPLE_PX, SEARCH, Stage, VIEW_PX, assert_sane, count, looking, reconstruct};

pub fn odd_cameras() -> Vec<(&'static str, PinholeCamera)> {
    let size = UVec2::new(40, 30);
    let look = |eye: [f32; 3], target: [f32; 3]| looking(eye.into(), target.into(), 60.0, size);
    vec![
        ("above", look([0.1, 3.0, 0.1], [0.0, 0.0, 0.0])),
        ("inside", look([0.5, 0.5, 0.5], [0.0, 0.3, 0.0])),
        ("in the ground's plane", look([0.9, 0.0, 0.0], [0.0, 0.0, 0.0])),
        ("below", look([0.1, -2.0, 0.1], [0.0, 0.0, 0.0])),
        ("along the slab, at its top", look([3.0, 1.0, 0.0], [0.0, 1.0, 0.0])),
        ("along the slab, over it", look([3.0, 1.5, 0.0], [0.0, 1.5, 0.0])),
        ("outside the hull", look([-6.0, 0.6, 5.0], [0.0, 0.3, 0.0])),
        ("behind the cameras", look([0.6, 4.4, 4.4], [0.0, 0.3, 0.0])),
        ("away from everything", look([0.3, 2.2, 2.2], [0.6, 4.4, 4.4])),
        ("far off", look([0.0, 1e4, 1e4], [0.0, 0.0, 0.0])),
    ]
}

#[test]
fn views_from_anywhere_are_pictures() {
    let corners = Corners { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::Y * 0.3, half_m: 0.4 };
    let stage = Stage::new(tree_terrain(10_000, 1), &corners.samples(4));
    let (names, mut cameras): (Vec<_>, Vec<_>) = odd_cameras().into_iter().unzip();
    // And from a sample's own eye.
    cameras.push(PinholeCamera { size_px: UVec2::new(40, 30), ..corners.samples(1)[0] });
    for method in [CARVE, SEARCH] {
        for (view, name) in stage.views(&cameras, method).iter().zip(names.iter().chain([&"own eye"])) {
            assert_sane(view, &format!("{method}: {name}"));
            let [hit, filled] = [ProvenanceKind::Hit, ProvenanceKind::Filled].map(|kind| count(view, kind));
            println!("{:<24} {name:<28} {hit:>5} hit {filled:>5} filled", method.to_string());
        }
    }
}

/// Something very near beside something very far leaves few codes for what is between.
#[test]
fn near_and_far_together_are_pictures() {
    for far_m in [10.0f32, 1e2, 1e3, 1e4, 1e5] {
        let mut scene = quad(Vec3::NEG_Z * far_m, far_m, Vec3::Z, [180, 90, 40]);
        let near = quad(Vec3::new(-0.6, 0.0, -1.0), 0.3, Vec3::Z, [40, 90, 180]);
        scene.instances.push(scene::Instance { mesh: 1, ..near.instances[0] });
        scene.meshes.extend(near.meshes);
        let camera = |x: f32, size_px| looking(Vec3::X * x, Vec3::new(x, 0.0, -1.0), 60.0, size_px);
        let stage = Stage::new(scene, &[camera(-0.1, SAMPLE_PX), camera(0.1, SAMPLE_PX)]);
        for method in [CARVE, SEARCH] {
            let view = stage.view(&camera(0.02, VIEW_PX), method);
            assert_sane(&view, &format!("{method}: far at {far_m} m"));
            let hits = count(&view, ProvenanceKind::Hit);
            println!("far/near {far_m:>7}: {method} finds {hits} of {} pixels", VIEW_PX.element_product());
            // Known issue: the carve leaves the volume before it meets a surface on the far face. This is so where half
            // a code there is more than the volume's margin.
            let can_meet = method == CARVE && far_m <= 100.0;
            let roomy = Stage { volume: stage.volume.padded(far_m), ..stage.clone() };
            let with_room = count(&roomy.view(&camera(0.02, VIEW_PX), method), ProvenanceKind::Hit);
            println!("with room behind: {with_room}");
            assert!(far_m > 1e3 || with_room * 10 > VIEW_PX.element_product() as usize * 9, "{method}: {with_room}");
            assert!(!can_meet || hits * 10 > VIEW_PX.element_product() as usize * 9, "{method}: {far_m} {hits}");
        }
    }
}

/// A quarter of one image is holes. The other image alone decides there, and nothing is made of the holes.
#[test]
fn holes_block_nothing_and_certify_nothing() {
    let corners = Corners { eye: Vec3::new(2.0, 9.0, 9.0), target: Vec3::ZERO, half_m: 1.0 };
    let whole = Stage::new(courtyard(), &corners.samples(2));
    let mut holed = whole.clone();
    for y in 20..50 {
        holed.images[0].inverse_depth_per_m[y * 96 + 30..y * 96 + 70].fill(HOLE_INVERSE_DEPTH);
    }
    let alone = Stage { images: whole.images[1..].to_vec(), ..whole.clone() };
    let mut blind = whole.clone();
    blind.images[0].inverse_depth_per_m.fill(HOLE_INVERSE_DEPTH);
    for method in [CARVE, SEARCH] {
        let view = |stage: &Stage| stage.view(&corners.view(), method);
        assert_sane(&view(&holed), "holes");
        let hits = [&whole, &holed, &alone, &blind].map(|stage| count(&view(stage), ProvenanceKind::Hit));
        println!(
            "{method}: hits with both images {}, with holes {}, with one {}, beside all holes {}",
            hits[0], hits[1], hits[2], hits[3]
        );
        // The search asks all cameras that see a point, and so finds less with more of them.
        let least = hits[0].min(hits[2]);
        assert!(least > 1000 && hits[1] * 100 >= least * 97, "{method}: {hits:?}");
        // An image of holes only is no image. It costs the carve some of its moves, and sets with holes have more of them.
        assert!(hits[3].abs_diff(hits[2]) * 100 <= hits[2] * 4, "{method}: {hits:?}");
    }
}

#[test]
fn holes_alone_show_nothing() {
    let corners = Corners { eye: Vec3::new(2.0, 9.0, 9.0), target: Vec3::ZERO, half_m: 1.0 };
    let mut stage = Stage::new(courtyard(), &corners.samples(2));
    stage.images.iter_mut().for_each(|image| image.inverse_depth_per_m.fill(HOLE_INVERSE_DEPTH));
    for method in [CARVE, SEARCH] {
        let view = stage.view(&corners.view(), method);
        assert_sane(&view, "holes only");
        assert_eq!(count(&view, ProvenanceKind::Hit), 0, "{method}");
        assert!(count(&view, ProvenanceKind::Filled) > 1000, "{method}: holes certify nothing");
    }
}

#[test]
fn small_images_are_images() {
    for side in [2u32, 3, 4, 7, 9] {
        for size_px in [UVec2::new(side, side), UVec2::new(64, side), UVec2::new(side, 64)] {
            let camera = |x: f32, size_px| looking(Vec3::X * x, Vec3::new(x, 0.0, -1.0), 40.0, size_px);
            let wall = quad(Vec3::NEG_Z * 4.0, 4.0, Vec3::Z, [180, 90, 40]);
            let stage = Stage::new(wall, &[camera(-0.05, size_px), camera(0.05, size_px)]);
            let set = stage.upload();
            for method in [CARVE, SEARCH] {
                // Rays along the border between texels end in one or the other by rounding: five pixels have none.
                let view = camera(0.0, UVec2::new(5, 5));
                let views = reconstruct(&set, &[view], method, ViewPlanes::ALL).expect("a view");
                assert_sane(&views[0], &format!("{size_px} {method}"));
                let twin = stage.twin(&view, method);
                let hits = [&views[0], &twin].map(|v| count(v, ProvenanceKind::Hit));
                assert!(
                    hits[0].abs_diff(hits[1]) <= 1,
                    "{size_px} {method}: {hits:?} hits on the device and in the twin"
                );
            }
        }
    }
}
