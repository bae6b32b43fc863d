//! Images around a pole: they are taken by rays.

use depth_image::{Aabb, Camera, DepthImage, PinholeCamera, PixelDepth, SinglePoleCamera};
use fixtures::teapot_mirror;
use glam::{UVec2, Vec2, Vec3};
use render::{DrawWork, RenderError, SamplePlanes, Visibility, scalar};

use crate::stage::{device, upload, work};

const SIDE_PX: u32 = 96;

/// Around the teapot, as the mirror sees it.
fn around(distortion_px: f32) -> SinglePoleCamera {
    let bounds = Aabb { min: Vec3::new(-3.2, 0.0, 0.5), max: Vec3::new(3.2, 3.2, 4.5) };
    SinglePoleCamera::around(&bounds, Vec3::new(0.0, 3.1, -4.5), distortion_px, UVec2::splat(SIDE_PX))
}

const ALL: SamplePlanes = SamplePlanes {
    antialias: depth_image::Antialias::NONE,
    normal: true,
    surface_id: true,
    specular: true,
    corners: false,
    light: false,
};

fn images(work: DrawWork<'_>, cameras: &[Camera]) -> Vec<DepthImage> {
    device().1.draw_depth_images(work, cameras, ALL).expect("images")
}

/// The pinhole takes its image by rays as well, and sees no farther.
#[test]
fn without_distortion_an_image_is_the_pinholes() {
    let scene = upload(&teapot_mirror());
    let camera = SinglePoleCamera { farthest_m: 1e6, ..around(0.0) };
    for lighting in ["unlit", "soft 4, occlusion 4"] {
        let work = DrawWork { visibility: Visibility::Rays, ..work(&scene, lighting) };
        let [bent, straight] =
            [Camera::SinglePole(camera), camera.reference.into()].map(|camera| images(work, &[camera]).remove(0));
        let bits = |image: &DepthImage| image.inverse_depth_per_m.iter().map(|d| d.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&bent), bits(&straight), "{lighting}");
        assert_eq!(bent.color_rgb9e5, straight.color_rgb9e5, "{lighting}");
        assert_eq!((&bent.normal_oct16, &bent.specular), (&straight.normal_oct16, &straight.specular));
    }
}

#[test]
fn texels_hold_what_their_twins_rays_meet() {
    let teapot = teapot_mirror();
    let scene = upload(&teapot);
    let twin = scalar::rays::Scene::of(&scene, 0.0).expect("a tree");
    for distortion_px in [4.0, 16.0, 28.0] {
        let camera = Camera::SinglePole(around(distortion_px));
        let image = images(work(&scene, "unlit"), &[camera]).remove(0);
        let pixels = (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| UVec2::new(x, y)));
        let mut seen = 0;
        let same = pixels.zip(&image.inverse_depth_per_m).filter(|(pixel, inverse_depth)| {
            let center = pixel.as_vec2() + 0.5;
            let [near, far] = camera.depths_m(center);
            let hit = if near < far { twin.closest_between(&camera.ray(center), near, far) } else { None };
            seen += usize::from(hit.is_some());
            let expected = hit.map_or(0.0, |hit| hit.t.recip());
            (expected - **inverse_depth).abs() <= 1e-4 * expected
        });
        let share = same.count() as f32 / image.inverse_depth_per_m.len() as f32;
        println!("{distortion_px} px: {share} of all texels, {seen} with a surface");
        assert!(share >= 0.999 && seen > 2000, "{share}, {seen}");
    }
}

#[test]
fn samples_lie_on_the_triangles_that_their_rays_meet() {
    let scene = upload(&teapot_mirror());
    let twin = scalar::rays::Scene::of(&scene, 0.0).expect("a tree");
    let triangles: Vec<[Vec3; 3]> = twin.triangles_in_world().collect();
    let camera = Camera::SinglePole(around(20.0));
    let image = images(work(&scene, "unlit"), &[camera]).remove(0);
    let places = (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| UVec2::new(x, y)));
    let on_triangle = places.filter_map(|place| {
        let point = image.sample_in_world(place.x, place.y)?;
        let center = place.as_vec2() + 0.5;
        let [near, far] = camera.depths_m(center);
        let [a, b, c] = triangles[twin.closest_between(&camera.ray(center), near, far)?.slot as usize];
        let off_m = (b - a).cross(c - a).normalize_or_zero().dot(point - a).abs();
        Some(off_m <= 1e-4 * camera.project(point)?.planar_depth_m)
    });
    let on_triangle: Vec<bool> = on_triangle.collect();
    let count = on_triangle.iter().filter(|is| **is).count();
    // At an edge, two rays of different rounding meet different triangles.
    assert!(count > 2000 && count as f32 > 0.999 * on_triangle.len() as f32, "{count} of {}", on_triangle.len());
}

/// What the pinhole sees of the pot ends at its silhouette.
#[test]
fn more_distortion_shows_more_of_the_sides() {
    let scene = upload(&teapot_mirror());
    // Surfaces of the teapot's far half.
    let behind = |distortion_px: f32| {
        let image = images(work(&scene, "unlit"), &[Camera::SinglePole(around(distortion_px))]).remove(0);
        let places = (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| (x, y)));
        let samples = places.filter_map(|(x, y)| image.sample_in_world(x, y));
        samples.filter(|point| point.z > 2.5 && point.y > 0.01).count()
    };
    let [none, some, much] = [0.0, 14.0, 28.0].map(behind);
    println!("texels of the far half: {none}, {some}, {much}");
    assert!(none < some && some < much, "{none}, {some}, {much}");
}

#[test]
fn tiles_and_smaller_batches_are_the_image() {
    let scene = upload(&teapot_mirror());
    let camera = Camera::SinglePole(around(20.0));
    let lit = work(&scene, "soft 1, occlusion 1");
    let pinhole: Camera = PinholeCamera::looking_at(Vec3::Y * 5.0, Vec3::ZERO, Vec3::Z, 0.8, UVec2::splat(32)).into();
    // Models take turns.
    let [first, whole, last]: [DepthImage; 3] =
        images(lit, &[pinhole, camera, pinhole]).try_into().map_err(|_| ()).expect("three images");
    assert!(first == last && whole.camera == camera);
    let tiles = (0..3).map(|tile| images(lit, &[camera.tile(tile, 3)]).remove(0)).collect();
    let tiled = DepthImage::from_tiles(camera, tiles).expect("an image");
    let near = |a: &f32, b: &f32| (a - b).abs() <= 1e-5 * a.abs().max(1e-6);
    let pairs = whole.inverse_depth_per_m.iter().zip(&tiled.inverse_depth_per_m);
    let share = pairs.filter(|(a, b)| near(a, b)).count() as f32 / whole.inverse_depth_per_m.len() as f32;
    let lit_alike = whole.color_rgb9e5.iter().zip(&tiled.color_rgb9e5).filter(|(a, b)| a == b).count();
    println!("{share} of depths are alike, {lit_alike} colours of {}", whole.color_rgb9e5.len());
    assert!(share > 0.999 && lit_alike as f32 > 0.95 * whole.color_rgb9e5.len() as f32);
}

#[test]
fn what_needs_a_pinhole_refuses_others_by_name() {
    let scene = upload(&teapot_mirror());
    let camera = Camera::SinglePole(around(20.0));
    let planes = SamplePlanes { corners: true, ..SamplePlanes::default() };
    let error = device().1.draw_depth_images(work(&scene, "unlit"), &[camera], planes).expect_err("corners");
    assert!(matches!(error, RenderError::Model { index: 0, model: "single_pole", .. }), "{error}");
    let spoilt = Camera::SinglePole(SinglePoleCamera { distortion_px: f32::NAN, ..around(20.0) });
    let error = device().1.draw_depth_images(work(&scene, "unlit"), &[spoilt], ALL).expect_err("no number");
    assert!(error.to_string().contains("distortion_px"), "{error}");
}

#[test]
fn no_depth_is_not_a_number_at_the_pole() {
    let scene = upload(&teapot_mirror());
    // A texel's middle is the pole.
    let camera = SinglePoleCamera { pole_px: Vec2::splat(48.5), ..around(40.0) };
    let image = images(work(&scene, "soft 1"), &[Camera::SinglePole(camera)]).remove(0);
    assert!(image.inverse_depth_per_m.iter().all(|depth| depth.is_finite() && *depth >= 0.0));
    let at = PixelDepth { pixel: camera.pole_px, planar_depth_m: 5.0 };
    assert!(Camera::SinglePole(camera).unproject(at).is_finite());
}
