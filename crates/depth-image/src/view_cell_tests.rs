//! Tests against closed forms.

use super::*;

const SIZE: UVec2 = UVec2::new(40, 30);

fn at(eye: Vec3) -> PinholeCamera {
    PinholeCamera::looking_at(eye, eye - Vec3::Z, Vec3::Y, 0.8, SIZE)
}

fn towards_middle(eye: Vec3) -> PinholeCamera {
    PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, SIZE)
}

fn line() -> Vec<PinholeCamera> {
    (0..7).map(|i| at(Vec3::new(0.1 * i as f32 - 0.2, 1.0, 3.0))).collect()
}

fn block(corners: [Vec3; 2]) -> Vec<PinholeCamera> {
    let pick = |i: usize, axis: usize| corners[(i >> axis) & 1][axis];
    (0..8).map(|i| at(Vec3::new(pick(i, 0), pick(i, 1), pick(i, 2)))).collect()
}

#[test]
fn parallel_cameras_stay_parallel() {
    let camera = |x: f32, y: f32| at(Vec3::new(x, y, 2.2));
    let cell = ViewCell::between(&[camera(-0.1, 0.1), camera(0.1, 0.1), camera(-0.1, 0.4), camera(0.1, 0.4)]).unwrap();
    for view in cell.grid(3, 3, SIZE) {
        assert!(view.forward_in_world().dot(Vec3::NEG_Z) > 1.0 - 1e-6);
    }
    assert!((cell.grid(3, 3, SIZE)[0].eye_in_world - Vec3::new(-0.1, 0.1, 2.2)).length() < 1e-6);
}

#[test]
fn one_camera_gives_a_cell_of_one_point_and_no_camera_gives_none() {
    let one = towards_middle(Vec3::ONE);
    let cell = ViewCell::between(&[one]).unwrap();
    assert_eq!(cell.orbit(5, SIZE)[3].eye_in_world, Vec3::ONE);
    let [sample] = cell.sample_cameras(0.0, SIZE)[..] else { panic!("one") };
    assert!((sample.focal_px - one.focal_px).length() < 1e-3 && sample.world_from_camera == one.world_from_camera);
    assert_eq!(ViewCell::between(&[]), None);
}

#[test]
fn sample_cameras_stand_at_ends_and_corners() {
    let ends = ViewCell::between(&line()).unwrap().sample_cameras(0.01, SIZE);
    let eyes: Vec<Vec3> = ends.iter().map(|camera| camera.eye_in_world).collect();
    let expected = [Vec3::new(-0.2, 1.0, 3.0), Vec3::new(0.4, 1.0, 3.0)];
    assert!(eyes.len() == 2 && eyes.iter().zip(expected).all(|(a, b)| (*a - b).length() < 1e-6), "{eyes:?}");

    let corners = [Vec3::new(-1.0, 0.0, 2.0), Vec3::new(1.0, 0.5, 4.0)];
    let cell = ViewCell::between(&block(corners)).unwrap();
    let samples = cell.sample_cameras(0.1, SIZE);
    let is_corner = |eye: Vec3| (eye.cmpeq(corners[0]) | eye.cmpeq(corners[1])).all();
    assert!(samples.len() == 8 && samples.iter().all(|camera| is_corner(camera.eye_in_world)), "{samples:?}");
    let flat = cell.sample_cameras(0.6, SIZE);
    assert!(flat.len() == 4 && flat.iter().all(|camera| camera.eye_in_world.y == 0.25), "a short edge does not count");
}

/// Every sample camera contains the distant corners of every view.
#[test]
fn sample_cameras_contain_the_views() {
    let mut views = line();
    // One view is turned and rolled, one has another shape, one another lens shift.
    views[1].world_from_camera *= Quat::from_rotation_y(0.2) * Quat::from_rotation_z(0.3);
    views[2] = views[2].resized(UVec2::new(90, 30));
    views[2].focal_px.x = views[2].focal_px.y;
    views[3].principal_px.y += 12.0;
    let samples = ViewCell::between(&views).unwrap().sample_cameras(0.01, UVec2::new(400, 300));
    for view in &views {
        let size = view.size_px.as_vec2();
        for corner in [Vec2::ZERO, size, Vec2::new(size.x, 0.0), Vec2::new(0.0, size.y)] {
            let far = view.ray(corner).at(1e5);
            for sample in &samples {
                let pixel = sample.project(far).unwrap().pixel;
                let inside = pixel.clamp(Vec2::ZERO, sample.size_px.as_vec2());
                assert!((pixel - inside).length() < 0.05, "{view:?}: {pixel}");
            }
        }
    }
}

#[test]
fn converging_views_keep_their_field_of_view() {
    let views: Vec<_> =
        [-0.3f32, -0.1, 0.1, 0.3].map(|x| towards_middle(Vec3::new(3.0 * x.sin(), 1.0, 3.0 * x.cos()))).to_vec();
    let samples = ViewCell::between(&views).unwrap().sample_cameras(0.2, SIZE);
    assert_eq!(samples.len(), 2);
    for sample in samples {
        assert!((sample.focal_px / views[0].focal_px - 1.0).abs().max_element() < 0.02, "{sample:?}");
        assert!(sample.project(Vec3::ZERO).is_some_and(|at| (at.pixel - Vec2::new(20.0, 15.0)).length() < 0.1));
    }
}

#[test]
fn views_around_an_axis_form_a_circle() {
    let cell = ViewCell::between(&[towards_middle(Vec3::new(0.0, 1.0, 3.0))]).unwrap();
    let views = cell.around(Vec3::ZERO, 8, SIZE);
    for view in &views {
        assert!((view.eye_in_world.length() - 10f32.sqrt()).abs() < 1e-5, "{view:?}");
        assert!(view.forward_in_world().dot(-view.eye_in_world) > (1.0 - 1e-5) * view.eye_in_world.length());
    }
    assert!((views[4].eye_in_world - Vec3::new(0.0, 1.0, -3.0)).length() < 1e-5);
}

#[test]
fn diverging_views_give_valid_cameras() {
    let apart = [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::Y]
        .map(|aim| PinholeCamera::looking_at(Vec3::ZERO, aim, Vec3::Y, 1.0, SIZE));
    for sample in ViewCell::between(&apart).unwrap().sample_cameras(0.0, SIZE) {
        sample.validate().unwrap();
    }
}

#[test]
fn nested_cameras_are_prefixes_of_each_other_and_see_all_views() {
    let corners = [(-0.5, -0.4), (0.5, -0.4), (-0.5, 0.4), (0.5, 0.4)];
    let at = |(x, y): (f32, f32)| {
        let eye = Vec3::new(x, y, 4.0);
        PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(80, 60))
    };
    let rig = corners.map(at);
    let cell = ViewCell::between(&rig).unwrap();
    let size_px = UVec2::new(40, 30);
    let nested = |count| cell.nested_cameras(count, size_px);
    assert!(nested(8).starts_with(&nested(4)) && nested(4).starts_with(&nested(2)));
    assert_eq!((nested(1)[0], nested(1).len()), (nested(8)[4], 1), "one camera stands in the middle");
    for camera in nested(9) {
        assert_eq!(camera.size_px, size_px);
        assert!(rig.iter().all(|view| cell.sees_all_of(view)));
    }
    let eyes: Vec<Vec3> = nested(4).iter().map(|camera| camera.eye_in_world).collect();
    assert!(rig.iter().all(|corner| eyes.iter().any(|eye| (*eye - corner.eye_in_world).length() < 1e-5)), "{eyes:?}");
}

#[test]
fn a_cell_grows_about_its_middle_and_views_of_it_keep_their_aim() {
    let view = PinholeCamera::looking_at(Vec3::new(0.0, 1.0, 4.0), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(80, 60));
    let one = ViewCell::between(&[view]).unwrap();
    let grown = one.grown_to(0.6);
    let at = |x, y, z| grown.view_at(Vec3::new(x, y, z), &view);
    assert_eq!(at(0.0, 0.0, 0.0), view);
    for (place, axis) in [(Vec3::X, Vec3::X), (Vec3::Y, Vec3::Y), (Vec3::Z, Vec3::Z)] {
        let moved = grown.view_at(place, &view);
        let step = moved.eye_in_world - view.eye_in_world;
        assert!((step - view.world_from_camera * axis * 0.3).length() < 1e-5, "{step}");
        assert_eq!((moved.focal_px, moved.size_px), (view.focal_px, view.size_px));
    }
    let wide = grown.grown_to(0.1);
    assert_eq!(wide, grown, "edges that are long enough stay");
}
