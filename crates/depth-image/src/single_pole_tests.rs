use super::*;
use crate::Camera;

const SIZE_PX: UVec2 = UVec2::new(512, 512);

fn bounds() -> Aabb {
    Aabb { min: Vec3::new(-1.6, 0.0, -1.0), max: Vec3::new(1.6, 1.6, 1.0) }
}

fn around(distortion_px: f32) -> SinglePoleCamera {
    SinglePoleCamera::around(&bounds(), Vec3::new(1.0, 2.0, 6.0), distortion_px, SIZE_PX)
}

/// Shares between 0 and 1, spread evenly.
fn spread(number: usize) -> [f32; 3] {
    [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step: f64| (0.5 + step * number as f64).fract() as f32)
}

#[test]
fn a_million_points_return_to_their_pixels() {
    for distortion_px in [0.0, 40.0, 120.0] {
        let camera = around(distortion_px);
        let mut seen = 0;
        for [x, y, z] in (0..1_000_000).map(spread) {
            let pixel = Vec2::new(x, y) * SIZE_PX.as_vec2();
            let [near, far] = camera.depths_m(pixel);
            let planar_depth_m = near + (far - near) * (0.001 + 0.998 * z);
            // At the pole's axis itself a pixel's direction is lost.
            if far <= near
                || camera
                    .reference
                    .project(camera.ray(pixel).at(planar_depth_m))
                    .is_none_or(|at| at.pixel.distance(camera.pole_px) < 0.5)
            {
                continue;
            }
            let back = camera.project(camera.ray(pixel).at(planar_depth_m)).expect("between its depths");
            assert!(back.pixel.distance(pixel) < 0.01, "{distortion_px}: {pixel} at {planar_depth_m}: {back:?}");
            assert!((back.planar_depth_m / planar_depth_m - 1.0).abs() < 1e-4);
            seen += 1;
        }
        assert!(seen > 800_000, "{seen} at {distortion_px}");
    }
}

#[test]
fn without_distortion_it_is_the_pinhole() {
    let camera = around(0.0);
    for [x, y, z] in (0..10_000).map(spread) {
        let pixel = Vec2::new(x, y) * SIZE_PX.as_vec2();
        assert_eq!(camera.ray(pixel), camera.reference.ray(pixel));
        let point = camera.ray(pixel).at(camera.reference.near_m * 1.01 + z);
        assert_eq!(camera.project(point), camera.reference.project(point));
        assert_eq!(camera.depths_m(pixel), [camera.reference.near_m, camera.farthest_m]);
    }
}

#[test]
fn the_box_that_it_is_placed_around_stays_in_its_image() {
    for distortion_px in [0.0, 30.0, 100.0] {
        let camera = around(distortion_px);
        camera.validate().expect("a camera");
        let mut greatest = 0.0f32;
        for share in (0..20_000).map(|number| Vec3::from(spread(number))) {
            // On one of the faces, to which points of the inside do not come near.
            let on_face = Vec3::select(share.cmpeq(Vec3::splat(share.max_element())), Vec3::ONE, share);
            let at = camera.project(bounds().min + bounds().size() * on_face).expect("it is seen");
            assert!(camera.reference.contains(at.pixel), "{distortion_px}: {on_face} at {}", at.pixel);
            greatest = greatest.max((at.pixel - camera.pole_px).abs().max_element());
        }
        assert!(greatest > 0.6 * 256.0, "its scale is as large as the box allows: {greatest}");
    }
}

/// One image shows the far side of the box.
#[test]
fn it_sees_sides_that_turn_away_from_its_eye() {
    let eye = Vec3::new(0.0, 0.8, 5.0);
    let camera = SinglePoleCamera::around(&bounds(), eye, 120.0, SIZE_PX);
    let right_side = Vec3::new(1.6, 0.8, -0.5);
    let at = camera.project(right_side).expect("it is seen");
    let ray = camera.ray(at.pixel);
    assert!(ray.direction_in_world.dot(Vec3::X) < 0.0, "the ray comes from the right: {ray:?}");
    let as_pinhole = camera.reference.ray(camera.reference.project(right_side).expect("in front").pixel);
    assert!(as_pinhole.direction_in_world.dot(Vec3::X) > 0.0);
}

/// Were triangles drawn through the bend, their edges would stay straight. The true ones bow, which is why images are taken by
/// rays.
#[test]
fn an_edge_bows_by_the_square_of_its_length() {
    let camera = around(120.0);
    let depth_m = 0.5 * (camera.reference.near_m + camera.farthest_m);
    let rho_px = 100.0f32;
    let shift_px = camera.shift_px(depth_m.recip());
    for edge_px in [4.0f32, 8.0, 16.0, 32.0, 64.0] {
        let point = |along_px: f32| {
            let pixel = camera.pole_px + Vec2::new(rho_px, along_px);
            camera.project(camera.reference.ray(pixel).at(depth_m)).expect("it is seen").pixel
        };
        let drawn = 0.5 * (point(-0.5 * edge_px) + point(0.5 * edge_px));
        let bow_px = drawn.distance(point(0.0));
        let expected_px = shift_px * edge_px * edge_px / (8.0 * rho_px * rho_px);
        assert!((bow_px - expected_px).abs() < 0.2 * expected_px, "{edge_px} px: {bow_px}, {expected_px}");
    }
}

#[test]
fn rays_end_at_the_axis_of_the_pole() {
    let camera = around(60.0);
    let near_pole = camera.pole_px + Vec2::new(3.0, -2.0);
    let [near_m, far_m] = camera.depths_m(near_pole);
    assert!(near_m < far_m && far_m < camera.farthest_m);
    let end = camera.reference.project(camera.ray(near_pole).at(far_m)).expect("in front");
    assert!(end.pixel.distance(camera.pole_px) < 0.01, "{end:?}");
    let [near_m, far_m] = camera.depths_m(camera.pole_px);
    assert!(far_m <= near_m * 1.0001, "the pole's own pixel sees nothing");
    assert!(camera.ray(camera.pole_px).direction_in_world.is_finite());
}

#[test]
fn other_sizes_offsets_and_tiles_keep_their_rays() {
    let camera = Camera::SinglePole(around(80.0));
    let apart = |a: Camera, at: Vec2, b: Camera, other: Vec2| a.ray(at).at(5.0).distance(b.ray(other).at(5.0));
    for [x, y, _] in (0..1000).map(spread) {
        let pixel = Vec2::new(x, y) * SIZE_PX.as_vec2();
        assert!(apart(camera, pixel, camera.resized(SIZE_PX / 2), pixel * 0.5) < 1e-4);
        let offset = Vec2::new(0.25, -0.125);
        assert!(apart(camera, pixel, camera.with_offset(offset), pixel - offset) < 1e-4);
        let tile = camera.tile(1, 4);
        assert!(apart(camera, pixel, tile, pixel - Vec2::new(0.0, 128.0)) < 1e-4);
        assert_eq!((tile.size_px(), tile.model_name()), (UVec2::new(512, 128), "single_pole"));
    }
}

#[test]
fn an_invalid_camera_is_refused_with_its_field() {
    let good = around(50.0);
    let reference = PinholeCamera { near_m: -1.0, ..good.reference };
    let bad = [
        (SinglePoleCamera { reference, ..good }, "near_m"),
        (SinglePoleCamera { pole_px: Vec2::NAN, ..good }, "pole_px"),
        (SinglePoleCamera { pole_px: Vec2::splat(2e6), ..good }, "pole_px"),
        (SinglePoleCamera { distortion_px: -1.0, ..good }, "distortion_px"),
        (SinglePoleCamera { distortion_px: f32::NAN, ..good }, "distortion_px"),
        (SinglePoleCamera { distortion_px: 20_000.0, ..good }, "distortion_px"),
        (SinglePoleCamera { farthest_m: good.reference.near_m, ..good }, "farthest_m"),
        (SinglePoleCamera { farthest_m: good.reference.near_m.next_up(), distortion_px: 0.0, ..good }, "farthest_m"),
        (SinglePoleCamera { reference: PinholeCamera { near_m: 1e-40, ..good.reference }, ..good }, "near_m"),
        (SinglePoleCamera { farthest_m: f32::INFINITY, ..good }, "farthest_m"),
    ];
    for (camera, field) in bad {
        let error = Camera::SinglePole(camera).validate().expect_err(field);
        assert!(error.to_string().contains(field), "{error}");
    }
}
