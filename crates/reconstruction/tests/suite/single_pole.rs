//! Rays in images of single-pole cameras: the walk, its twin, and the same search in steps that miss nothing.

use gpu::Turn;
use std::sync::OnceLock;

use depth_image::{Aabb, Camera, DepthImage, ProvenanceKind, Ray, SinglePoleCamera, ViewPlanes};
use fixtures::teapot_mirror;
use glam::{UVec2, Vec3};
use reconstruction::scalar::{PinholeImages, SinglePoleImages};
use reconstruction::{CurvedSearch, MirrorCell, Mirrors, RayEnd, RayWork, ReconstructRequest, ReconstructionError};
use render::{DrawWork, GpuScene, SamplePlanes};
use scene::Scene;

use crate::stage::{CARVE, description, gpu, looking, reconstruct, reconstructor, renderer, work};

const TEAPOT: Aabb = Aabb { min: Vec3::new(-3.2, 0.0, 0.5), max: Vec3::new(3.2, 3.2, 4.5) };
const MIRROR: Vec3 = Vec3::new(0.0, 3.1, -4.5);
/// Rays begin on the mirror.
const NEAR_M: f32 = 1e-3;

/// The teapot without its mirror, and images of it from both sides of the mirror.
struct Stand {
    scene: Scene,
    images: Vec<DepthImage>,
}

fn around(side: f32, side_px: u32, distortion: f32) -> Camera {
    let eye = MIRROR + Vec3::X * (1.5 * side);
    let distortion_px = distortion * 0.5 * side_px as f32;
    Camera::SinglePole(SinglePoleCamera::around(&TEAPOT, eye, distortion_px, UVec2::splat(side_px)))
}

fn stand() -> &'static Stand {
    static STAND: OnceLock<Stand> = OnceLock::new();
    STAND.get_or_init(|| {
        let scene = teapot_mirror();
        let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
        let work = work(&on_device, "shadows");
        let planes = SamplePlanes { specular: true, ..SamplePlanes::default() };
        let cameras = [around(-1.0, 256, 0.3), around(1.0, 256, 0.3)];
        let images = renderer().draw_depth_images(work, &cameras, planes).expect("images");
        Stand { scene, images }
    })
}

/// From places on a square around the mirror's middle towards places around the teapot.
fn rays(count: usize) -> Vec<Ray> {
    let spread = |number: usize, step: f64| (0.5 + step * number as f64).fract() as f32 - 0.5;
    let ray = |number| {
        let [x, y] = [0.754_877_7, 0.569_840_3].map(|step| spread(number, step));
        let [u, v, w] = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step| spread(number, step));
        let origin_in_world = MIRROR + Vec3::new(x, y, 0.0) * 4.0;
        let target = TEAPOT.center() + TEAPOT.size() * Vec3::new(u, v, w) * 1.4;
        Ray { origin_in_world, direction_in_world: (target - origin_in_world).normalize_or(Vec3::Z) }
    };
    (0..count).map(ray).collect()
}

fn followed(images: &[DepthImage], search: CurvedSearch, rays: &[Ray]) -> Vec<RayEnd> {
    let set = reconstructor().upload(images, &description(&stand().scene), Turn::default()).expect("a set");
    let work = RayWork { curved_search: search, ..RayWork::new(&set, NEAR_M) };
    reconstructor().follow(work, rays).expect("ends").0
}

fn is_hit(end: &RayEnd) -> bool {
    end.kind == ProvenanceKind::Hit
}

/// March and carve in images of pinholes, of one and of many, which look one way and all ways.
#[test]
fn marched_and_carved_rays_end_where_their_twins_do() {
    let Stand { scene, .. } = stand();
    let on_device = GpuScene::upload(gpu(), scene).expect("a scene");
    let six = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let six = six.map(|towards| Camera::from(looking(MIRROR, MIRROR + towards, 94.0, UVec2::splat(96))));
    let aside = |x: f32, y: f32| {
        let eye = MIRROR + Vec3::new(x, y, 0.0);
        Camera::from(looking(eye, eye + Vec3::Z, 80.0, UVec2::splat(128)))
    };
    let four = [aside(-1.0, -1.0), aside(1.0, 1.0), aside(1.0, -1.0), aside(-1.0, 1.0)];
    for cameras in [&four[..1], &four, &six] {
        let planes = SamplePlanes::default();
        let images = renderer().draw_depth_images(work(&on_device, "unlit"), cameras, planes).expect("images");
        let rays = rays(6000);
        let twin = PinholeImages::of(&images, &scene.bounds());
        let ends = followed(&images, CurvedSearch::default(), &rays);
        let agree = |(ray, end): (&Ray, &RayEnd)| {
            let expected = twin.follow(ray, NEAR_M);
            let near = !is_hit(end) || (end.way_m - expected.way_m).abs() <= 1e-3 * expected.way_m;
            let color = !is_hit(end) || (end.color_linear - expected.color_linear).abs().max_element() < 0.02;
            end.kind == expected.kind && near && color
        };
        let same = rays.iter().zip(&ends).filter(|pair| agree(*pair)).count() as f32 / rays.len() as f32;
        let hits = ends.iter().filter(|end| is_hit(end)).count();
        println!("{} pinholes: {same} of the rays end alike, {hits} hits", cameras.len());
        assert!(same >= 0.995 && hits > 2000, "{same}, {hits}");
    }
}

#[test]
fn the_walk_ends_where_its_twin_does() {
    let Stand { scene, images } = stand();
    for (count, search) in [
        (1, CurvedSearch::default()),
        (2, CurvedSearch::default()),
        (2, CurvedSearch { coarse_px: 4.0, fine_px: 0.25 }),
        (1, CurvedSearch { coarse_px: 1.0, fine_px: 1.0 }),
    ] {
        let images = &images[..count];
        let rays = rays(6000);
        let twin = SinglePoleImages::of(images, &scene.bounds());
        let ends = followed(images, search, &rays);
        let agree = |(ray, end): (&Ray, &RayEnd)| {
            let expected = twin.curved_search(ray, NEAR_M, search);
            let near = !is_hit(end) || (end.way_m - expected.way_m).abs() <= 1e-3 * expected.way_m;
            let color = !is_hit(end) || (end.color_linear - expected.color_linear).abs().max_element() < 0.02;
            end.kind == expected.kind && near && color
        };
        let same = rays.iter().zip(&ends).filter(|pair| agree(*pair)).count() as f32 / rays.len() as f32;
        let hits = ends.iter().filter(|end| is_hit(end)).count();
        println!("{count} images, {search:?}: {same} of the rays end alike, {hits} hits");
        assert!(same >= 0.999 && hits > 2000, "{same}, {hits}");
    }
}

/// It meets almost all that an exhaustive search meets.
#[test]
fn coarse_steps_miss_little() {
    let Stand { scene, images } = stand();
    let images = &images[..1];
    let rays = rays(3000);
    let twin = SinglePoleImages::of(images, &scene.bounds());
    let exhaustive: Vec<RayEnd> = rays.iter().map(|ray| twin.every_eighth_texel(ray, NEAR_M)).collect();
    let hits = exhaustive.iter().filter(|end| is_hit(end)).count() as f32;
    let mut found = Vec::new();
    for coarse_px in [2.0, 6.0, 24.0] {
        let ends = followed(images, CurvedSearch { coarse_px, fine_px: 0.5 }, &rays);
        let both = ends
            .iter()
            .zip(&exhaustive)
            .filter(|(a, b)| is_hit(a) && is_hit(b) && (a.way_m - b.way_m).abs() < 0.02 * b.way_m);
        found.push(both.count() as f32 / hits);
        println!("coarse {coarse_px}: {} of {hits} hits", found[found.len() - 1]);
    }
    assert!(found[0] > 0.97 && found[1] > 0.95, "{found:?}");
    assert!(found.is_sorted_by(|a, b| a + 0.005 >= *b), "longer steps miss more: {found:?}");
}

/// A pole of some columns at 5 m before nothing, in an image without distortion.
fn pole(columns: u32) -> (DepthImage, SinglePoleCamera) {
    let bounds = Aabb { min: Vec3::new(-4.0, -4.0, -6.0), max: Vec3::new(4.0, 4.0, -4.0) };
    let camera = SinglePoleCamera::around(&bounds, Vec3::ZERO, 0.0, UVec2::splat(256));
    let is_pole = |texel: u32| (128..128 + columns).contains(&(texel % 256));
    let image = DepthImage {
        camera: Camera::SinglePole(camera),
        inverse_depth_per_m: (0..256 * 256).map(|texel| if is_pole(texel) { 0.2 } else { 0.0 }).collect(),
        color_rgb9e5: vec![0; 256 * 256],
        normal_oct16: None,
        surface_id: None,
        specular: None,
        passed: None,
        corner_inverse_depth_per_m: None,
        light: None,
    };
    (image, camera)
}

/// The share of rays through the pole that find it (Rosen et al., section 7.2: only the tip of the spout is as thin).
fn found_of_pole(columns: u32, end: impl Fn(&SinglePoleImages, &Ray) -> RayEnd) -> f32 {
    let (image, camera) = pole(columns);
    let volume = Aabb { min: Vec3::new(-4.0, -4.0, -5.9), max: Vec3::new(4.0, 4.0, -4.1) };
    let images = SinglePoleImages::of(&[image], &volume);
    let count = 600;
    let is_found = |number: &u32| {
        let [x, y, slope] =
            [0.754_877_7, 0.569_840_3, 0.819_172_5].map(|step: f64| (0.5 + step * f64::from(*number)).fract() as f32);
        let pixel = glam::Vec2::new(128.0 + x * columns as f32, 60.0 + 130.0 * y);
        let through = camera.ray(pixel).at(5.0);
        // Crosses some forty columns on its way from 4.1 to 5.9 m.
        let direction_in_world = Vec3::new(0.9 + 0.4 * slope, 0.1, -1.0).normalize_or(Vec3::Z);
        let ray = Ray { origin_in_world: through - direction_in_world * 3.0, direction_in_world };
        is_hit(&end(&images, &ray))
    };
    (0..count).filter(is_found).count() as f32 / count as f32
}

/// A ray is found where a coarse step looks at the pole, less half a fine step: where it ends a step before the pole's surface and
/// the next beyond the pole.
#[test]
fn coarse_steps_meet_a_thin_pole_as_often_as_they_look_at_it() {
    for columns in 1..=6 {
        let lost = |fine_px: f32| 1.0 - 0.5 * fine_px / columns as f32;
        let coarse = |coarse_px: f32| {
            let search = CurvedSearch { coarse_px, fine_px: 1.0 };
            found_of_pole(columns, |images, ray| images.curved_search(ray, NEAR_M, search))
        };
        let found = [1.0, 3.0, 6.0, 12.0].map(|coarse_px| (coarse_px, coarse(coarse_px)));
        let all = found_of_pole(columns, |images, ray| images.every_eighth_texel(ray, NEAR_M));
        println!("{columns} columns: {found:?}, in steps of an eighth {all}");
        assert!((all - lost(0.125)).abs() < 0.05, "{columns}: {all}");
        for (coarse_px, share) in found {
            let expected = (columns as f32 / coarse_px).min(1.0) * lost(1.0);
            assert!((share - expected).abs() < 0.1, "{columns} columns, steps of {coarse_px}: {share}, {expected}");
        }
    }
}

/// From both sides.
#[test]
fn a_second_image_finds_more() {
    let Stand { images, .. } = stand();
    let rays = rays(3000);
    let hits =
        |images: &[DepthImage]| followed(images, CurvedSearch::default(), &rays).iter().filter(|e| is_hit(e)).count();
    let [one, two] = [hits(&images[..1]), hits(images)];
    println!("{one} hits in one image, {two} in two");
    assert!(two > one);
}

#[test]
fn no_ray_ends_at_what_is_not_a_number() {
    let Stand { images, .. } = stand();
    let Camera::SinglePole(camera) = images[0].camera else { panic!("a single-pole camera") };
    let axis = camera.reference.ray(camera.pole_px);
    let along = axis.direction_in_world.normalize_or(Vec3::Z);
    let across = along.any_orthonormal_vector();
    let from = |origin_in_world, direction_in_world| Ray { origin_in_world, direction_in_world };
    let rays = [
        from(camera.reference.eye_in_world, along),
        from(camera.reference.eye_in_world, across),
        from(camera.reference.eye_in_world, -along),
        from(TEAPOT.center() - across * 8.0, across),
        from(TEAPOT.center() + along * 50.0, along),
        from(TEAPOT.center(), Vec3::Y),
    ];
    for end in followed(images, CurvedSearch::default(), &rays) {
        assert!(end.way_m.is_finite() || !is_hit(&end), "{end:?}");
        assert!(end.color_linear.is_finite(), "{end:?}");
    }
}

#[test]
fn what_cannot_use_the_images_says_so() {
    let Stand { scene, images } = stand();
    let set = reconstructor().upload(images, &description(scene), Turn::default()).expect("a set");
    let view = looking(Vec3::new(9.0, 7.0, 12.5), Vec3::Y, 28.0, UVec2::splat(16));
    let error = reconstruct(&set, &[view], CARVE, ViewPlanes::COLOR).expect_err("bent images");
    assert!(matches!(error, ReconstructionError::Model { model: "single_pole" }), "{error}");
    let pinhole =
        DepthImage { camera: looking(MIRROR, Vec3::ZERO, 60.0, images[0].size_px()).into(), ..images[0].clone() };
    let mixed = [images[0].clone(), pinhole];
    let error = reconstructor().upload(&mixed, &description(scene), Turn::default()).map(drop).expect_err("two models");
    assert!(matches!(error, ReconstructionError::Sample { index: 1, .. }), "{error}");
    let Camera::SinglePole(camera) = images[0].camera else { panic!("a single-pole camera") };
    let beside = Camera::SinglePole(SinglePoleCamera { pole_px: camera.pole_px * 3.0, ..camera });
    let beside = DepthImage { camera: beside, ..images[0].clone() };
    let error =
        reconstructor().upload(&[beside], &description(scene), Turn::default()).map(drop).expect_err("a pole outside");
    assert!(error.to_string().contains("pole"), "{error}");
    for (coarse_px, fine_px) in [(0.0, 0.0), (1.0, 2.0), (f32::NAN, 1.0), (65.0, 1.0), (6.0, 0.01)] {
        let curved_search = CurvedSearch { coarse_px, fine_px };
        let work = RayWork { curved_search, ..RayWork::new(&set, NEAR_M) };
        let error = reconstructor().follow(work, &rays(1)).expect_err("no such steps");
        assert!(matches!(error, ReconstructionError::CurvedSearch { .. }), "{error}");
    }
}

/// The same view with and without what the mirror shows.
#[test]
fn a_view_shows_the_teapot_in_its_mirror() {
    let Stand { scene, images } = stand();
    let set = reconstructor().upload(images, &description(scene), Turn::default()).expect("a set");
    let on_device = GpuScene::upload(gpu(), scene).expect("a scene");
    let work = work(&on_device, "shadows");
    let view = looking(Vec3::new(9.1, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, UVec2::new(192, 144));
    let samples = Camera::from(view.resized(view.size_px * 2));
    let planes = SamplePlanes { specular: true, ..SamplePlanes::default() };
    let samples = renderer().draw_depth_images(work, &[samples], planes).expect("an image");
    let samples = reconstructor().upload(&samples, &description(scene), Turn::default()).expect("a set");
    let cells = [MirrorCell { bounds: Aabb { min: MIRROR - 3.6, max: MIRROR + 3.6 }, surroundings: &set }];
    let shown = |reflections| {
        let mirrors = Mirrors { cells: &cells, reflections, glossy_rays: 0 };
        let views = reconstructor().reconstruct(ReconstructRequest {
            common: mirrors.into(),
            planes: ViewPlanes::ALL,
            ..ReconstructRequest::new(&samples, &[view], CARVE)
        });
        views.expect("a view").remove(0)
    };
    let lit: DrawWork<'_> = DrawWork { lighting: "shadows, reflections 1".parse().expect("a lighting"), ..work };
    let truth = renderer().draw_views(lit, &[view], ViewPlanes::ALL).expect("a view").remove(0);
    let [with, without] = [shown(2), shown(0)];
    // Where rays found anything: the image shows the teapot alone, not the floor.
    let pixels = with.srgb8.chunks_exact(3).zip(without.srgb8.chunks_exact(3)).zip(truth.srgb8.chunks_exact(3));
    let apart = |a: &[u8], b: &[u8]| a.iter().zip(b).map(|(a, b)| f32::from(a.abs_diff(*b))).sum::<f32>() / 3.0;
    let found: Vec<[f32; 2]> = pixels
        .filter(|((with, without), _)| apart(with, without) > 8.0)
        .map(|((with, without), truth)| [apart(with, truth), apart(without, truth)])
        .collect();
    let mean = |number: usize| found.iter().map(|pair| pair[number]).sum::<f32>() / found.len() as f32;
    let [error, error_without] = [mean(0), mean(1)];
    println!("{} pixels: mean difference {error}, without rays {error_without}", found.len());
    assert!(found.len() > 250 && error < 0.6 * error_without, "{}: {error}, {error_without}", found.len());
}
