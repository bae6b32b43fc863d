use depth_image::Aabb;
use glam::Vec3;

use super::*;
use crate::graph::behind::behind;
use crate::graph::test_support::Zigzag;

const SIZE_PX: UVec2 = UVec2::new(320, 200);

/// From 0 to 1, without order.
fn noise(number: u32) -> f64 {
    (f64::from(number) * 0.618_033_988_7).fract()
}

fn view() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(0.0, 1.6, 8.0), Vec3::new(0.0, 0.5, -0.2), Vec3::Y, 0.7, SIZE_PX)
}

fn behind_block() -> GraphPlan {
    let block = Aabb::around([Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.5)]);
    behind(&view(), &block, 0.3)
}

fn cameras() -> Vec<GraphCamera> {
    let zigzag = Zigzag::new(4, SIZE_PX);
    let parts_px = vec![UVec2::new(160, 100); 4];
    let behind = GraphCamera::new(&behind_block(), &Layout::Nested).unwrap();
    vec![zigzag.camera(&Layout::Nested), zigzag.camera(&Layout::Apart(parts_px)), behind]
}

/// A point in a frustum's region, on a ray of its face.
fn point_in(frustum: &Frustum, number: u32) -> DVec3 {
    let corners = frustum.corners();
    let shares: Vec<f64> = (0..corners.len() as u32).map(|corner| 0.02 + noise(number * 31 + corner)).collect();
    let all: f64 = shares.iter().sum();
    corners.iter().zip(&shares).map(|(corner, share)| corner * (share / all)).sum()
}

#[test]
fn points_come_back_to_their_places() {
    for camera in cameras() {
        for number in 0..4000 {
            let frustum = number as usize % camera.frusta.len();
            let point = point_in(&camera.frusta[frustum], number);
            let place = camera.project(point).unwrap();
            assert_eq!(place.frustum, frustum);
            assert!(place.w_m > 0.0);
            let back = camera.project_in(frustum, camera.unproject(place).as_vec3().as_dvec3());
            assert!(back.pixel.distance(place.pixel) < 0.01, "{place:?} {back:?}");
        }
    }
}

#[test]
fn the_nested_image_is_continuous_at_faces() {
    let [nested, _, behind] = cameras().try_into().unwrap();
    for camera in [nested, behind] {
        for (number, child) in camera.frusta.iter().enumerate().skip(1) {
            for at in 0..200 {
                let across = child.face[0].lerp(child.face[1], noise(at));
                let point = across.lerp(child.face[3].lerp(child.face[2], noise(at)), noise(5 * at));
                let [before, after] = [-1e-6, 1e-6].map(|off| point + child.entry.inwards * off);
                let parent = camera.project_in(child.parent.unwrap(), before);
                let own = camera.project_in(number, after);
                assert!(parent.pixel.distance(own.pixel) < 0.02, "{parent:?} {own:?}");
            }
        }
    }
}

/// A texel's ray is one line of points that project to the texel, in all of its frusta.
#[test]
fn rays_of_texels_are_straight_in_each_frustum_and_joined_at_faces() {
    let zigzag = Zigzag::new(4, SIZE_PX);
    let camera = zigzag.camera(&Layout::Nested);
    let mut deepest = 0;
    for number in 0..3000 {
        let pixel = DVec2::new(noise(number), noise(7 * number)) * SIZE_PX.as_dvec2();
        let pieces = camera.pieces(0, pixel);
        deepest = deepest.max(pieces.len());
        for piece in &pieces {
            for share in [0.0, 0.4, 1.0] {
                let w_m = piece.span_m[0] + (piece.span_m[1] - piece.span_m[0]) * share;
                let place = camera.project_in(piece.frustum, piece.eye_in_world + piece.direction_in_world * w_m);
                assert!(place.pixel.distance(pixel) < 1e-6 && (place.w_m - w_m).abs() < 1e-9);
            }
        }
        for pair in pieces.windows(2) {
            let end = pair[0].eye_in_world + pair[0].direction_in_world * pair[0].span_m[1];
            let start = pair[1].eye_in_world + pair[1].direction_in_world * pair[1].span_m[0];
            assert!(end.distance(start) < 1e-9, "{pair:?}");
            assert_eq!(camera.frusta[pair[1].frustum].parent, Some(pair[0].frustum));
        }
    }
    assert_eq!(deepest, 4);
}

/// The projection of a child is the parent's of the point on the face that the child's eye sees the point at.
#[test]
fn the_map_of_a_child_is_the_projection_onto_its_face_and_then_its_parents_map() {
    let camera = &cameras()[0];
    for number in 0..300 {
        let frustum = 1 + number as usize % 3;
        let child = &camera.frusta[frustum];
        let point = point_in(child, number);
        let share = child.entry.depth_m(child.eye_in_world)
            / (child.entry.depth_m(child.eye_in_world) - child.entry.depth_m(point));
        let on_face = child.eye_in_world.lerp(point, share);
        let of_parent = camera.project_in(child.parent.unwrap(), on_face);
        assert!(of_parent.pixel.distance(camera.project_in(frustum, point).pixel) < 1e-6);
    }
}

#[test]
fn a_camera_of_one_frustum_is_the_pinhole() {
    let root = RootPlan { camera: view(), walls: Vec::new(), far_m: 30.0 };
    let camera = GraphCamera::new(&GraphPlan { root, frusta: Vec::new() }, &Layout::Nested).unwrap();
    for number in 0..300 {
        let point = point_in(&camera.frusta[0], number);
        let expected = view().project(point.as_vec3()).unwrap();
        let place = camera.project(point).unwrap();
        assert!(place.pixel.distance(expected.pixel.as_dvec2()) < 0.01, "{place:?} {expected:?}");
        assert!((place.w_m - f64::from(expected.planar_depth_m)).abs() < 1e-4);
    }
}

#[test]
fn parts_of_frusta_that_are_apart_are_filled_by_their_faces() {
    let camera = &cameras()[1];
    for frustum in 1..camera.frusta.len() {
        let face = camera.frusta[frustum].face.clone();
        let places: Vec<DVec2> = face.iter().map(|corner| camera.project_in(frustum, *corner).pixel).collect();
        let size = camera.parts_px()[frustum].as_dvec2();
        for corner in [DVec2::ZERO, DVec2::new(size.x, 0.0), size, DVec2::new(0.0, size.y)] {
            assert!(places.iter().any(|place| place.distance(corner) < 1e-6), "{places:?}");
        }
    }
}

#[test]
fn no_ray_along_a_face_or_through_an_eye_gives_nan() {
    let camera = &cameras()[0];
    for child in &camera.frusta[1..] {
        let along = (child.face[1] - child.face[0]).normalize_or_zero();
        let eye = child.eye_in_world;
        for (origin, direction) in [(child.face[0], along), (child.face[3], DVec3::Y), (eye, child.entry.inwards)] {
            for frustum in &camera.frusta {
                let span = frustum.span(origin, direction, [0.0, f64::INFINITY]);
                assert!(span.is_none_or(|ends| !ends[0].is_nan() && !ends[1].is_nan()), "{span:?}");
            }
        }
        assert!(camera.project(child.face[0]).is_none_or(|place| place.pixel.is_finite()));
    }
    let outside = camera.project(DVec3::splat(1e3));
    assert_eq!(outside, None);
}

fn refused(change: impl FnOnce(&mut GraphPlan)) -> GraphCameraError {
    let mut plan = Zigzag::new(4, SIZE_PX).plan;
    change(&mut plan);
    GraphCamera::new(&plan, &Layout::Nested).unwrap_err()
}

#[test]
fn trees_that_are_none_are_refused() {
    let many = refused(|plan| plan.frusta = vec![plan.frusta[0].clone(); 64]);
    assert_eq!(many, GraphCameraError::TooManyFrusta { frusta: 65 });
    let unknown = refused(|plan| plan.frusta[0].parent = 9);
    assert_eq!(unknown, GraphCameraError::NoSuchParent { frustum: 1, parent: 9 });
    let own = refused(|plan| plan.frusta[0].parent = 1);
    assert_eq!(own, GraphCameraError::Cycle { frustum: 1 });
    let circle = refused(|plan| (plan.frusta[0].parent, plan.frusta[1].parent) = (2, 1));
    assert!(matches!(circle, GraphCameraError::Cycle { .. }), "{circle}");
    let late = refused(|plan| plan.frusta.swap(0, 1));
    assert_eq!(late, GraphCameraError::Cycle { frustum: 1 }, "its parent is its own place");
    let late = refused(|plan| (plan.frusta[0].parent, plan.frusta[1].parent) = (2, 0));
    assert_eq!(late, GraphCameraError::ParentAfterChild { frustum: 1, parent: 2 });
}

#[test]
fn faces_that_are_none_are_refused() {
    let bent = refused(|plan| plan.frusta[1].face[0] += DVec3::X * 0.1);
    assert!(matches!(bent, GraphCameraError::NotPlanar { frustum: 2, .. }), "{bent}");
    let two = refused(|plan| plan.frusta[1].face.truncate(2));
    assert_eq!(two, GraphCameraError::Corners { frustum: 2, corners: 2 });
    let crossed = refused(|plan| plan.frusta[1].face.swap(0, 1));
    assert!(matches!(crossed, GraphCameraError::NotConvex { .. } | GraphCameraError::NotPlanar { .. }), "{crossed}");
    let outside = refused(|plan| plan.frusta[1].face.iter_mut().for_each(|corner| *corner += DVec3::Y * 0.5));
    assert!(matches!(outside, GraphCameraError::NotInParent { frustum: 2, .. }), "{outside}");
    let flat = refused(|plan| plan.frusta[1].eye_in_world = plan.frusta[1].face[0]);
    assert_eq!(flat, GraphCameraError::EyeInFace { frustum: 2 });
}

#[test]
fn regions_and_numbers_that_cannot_be_are_refused() {
    let twice = refused(|plan| plan.frusta.push(plan.frusta[2].clone()));
    assert_eq!(twice, GraphCameraError::Overlap { first: 3, second: 4 });
    let open = refused(|plan| plan.root.walls.clear());
    assert!(matches!(open, GraphCameraError::Overlap { .. }), "the root goes on behind the face: {open}");
    let near = refused(|plan| plan.frusta[0].far_m = 0.1);
    assert_eq!(near, GraphCameraError::Far { frustum: 1, far_m: 0.1 });
    let lost = refused(|plan| plan.frusta[0].eye_in_world.x = f64::NAN);
    assert_eq!(lost, GraphCameraError::NotFinite { frustum: 1, what: "its eye" });
    let walled = refused(|plan| plan.frusta[0].walls = vec![plan.frusta[0].walls[0]; 9]);
    assert_eq!(walled, GraphCameraError::TooManyWalls { frustum: 1, walls: 9 });
    let shut = refused(|plan| plan.frusta[2].walls.push(Plane::through(DVec3::splat(1e3), DVec3::X)));
    assert_eq!(shut, GraphCameraError::Empty { frustum: 3 });
    let root = refused(|plan| plan.root.camera.size_px = UVec2::ZERO);
    assert!(matches!(root, GraphCameraError::Root(_)), "{root}");
}

/// The halves behind a block see its back, which the view does not.
#[test]
fn the_camera_behind_a_block_sees_what_the_view_does_not() {
    let camera = GraphCamera::new(&behind_block(), &Layout::Nested).unwrap();
    let hidden = DVec3::new(-0.4, 0.5, -1.0);
    let place = camera.project(hidden).unwrap();
    assert_eq!(place.frustum, 1);
    let pieces = camera.pieces(0, place.pixel);
    let crosses_block = pieces.iter().any(|piece| {
        (0..=100).any(|step| {
            let w_m = piece.span_m[0] + (piece.span_m[1] - piece.span_m[0]) * f64::from(step) / 100.0;
            let point = piece.eye_in_world + piece.direction_in_world * w_m;
            let from_middle = (point - DVec3::new(0.0, 0.5, 0.0)).abs().max_element();
            from_middle < 0.5 && (piece.frustum == 0 || w_m < place.w_m)
        })
    });
    assert!(!crosses_block);
    let to_hidden = (hidden - view().eye_in_world.as_dvec3()).normalize_or_zero();
    let at_front = view().eye_in_world.as_dvec3() + to_hidden * ((8.0 - 0.49) / -to_hidden.z);
    assert!(at_front.x.abs() < 0.5 && at_front.y < 1.0, "the view's own line is blocked: {at_front}");
}
