//! Rays into the lobes of glossy surfaces against closed forms, the scalar reference, and many rays.

use depth_image::{Antialias, Environment, PinholeCamera, View, ViewPlanes, environment_reflectance_linear};
use fixtures::{mirror_pair, quad, teapot_floor};
use glam::{Affine3A, UVec2, Vec2, Vec3};
use render::scalar::{self, lobe::lobe_ray, sequence::point_of};
use render::{DrawWork, Visibility};
use scene::Material;

use crate::reflections::{
    ROUNDING, between_the_pair, code_of, dark, floor_mirror, glowing, linear_at, of_parts, pixels, view_of,
};
use crate::stage::{SIZE_PX, device, upload, work};

fn before_the_floor() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(4.0, 3.0, 6.5), Vec3::new(0.0, 0.6, 0.5), Vec3::Y, 0.8, SIZE_PX)
}

fn greatest_difference(a: &View, b: &View) -> u8 {
    a.srgb8.iter().zip(&b.srgb8).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

/// The share and the mean direction of what a lobe reflects, by its formula on a grid over the hemisphere.
fn integrated(towards_eye: Vec3, alpha: f32) -> [Vec3; 2] {
    let rows = 600;
    let columns = 600;
    let n_v = towards_eye.z;
    let squared = alpha * alpha;
    let spread = |cosine: f32| (cosine * cosine * (1.0 - squared) + squared).sqrt();
    let solid_angle = std::f32::consts::TAU / (rows * columns) as f32;
    let mut sums = [Vec3::ZERO; 2];
    for place in 0..rows * columns {
        let up = ((place / columns) as f32 + 0.5) / rows as f32;
        let (sin, cos) = f32::sin_cos(std::f32::consts::TAU * ((place % columns) as f32 + 0.5) / columns as f32);
        let light = (Vec2::new(cos, sin) * (1.0 - up * up).sqrt()).extend(up);
        let n_h = (light + towards_eye).normalize_or_zero().z;
        let distribution = squared / (std::f32::consts::PI * (n_h * n_h * (squared - 1.0) + 1.0).powi(2));
        let shadowing = 2.0 * up * n_v / (n_v * spread(up) + up * spread(n_v));
        let reflected = distribution * shadowing / (4.0 * n_v) * solid_angle;
        sums = [sums[0] + reflected, sums[1] + light * reflected];
    }
    sums
}

#[test]
fn rays_of_a_lobe_lie_as_its_formula_says() {
    for roughness in [0.4, 0.7, 1.0_f32] {
        for slant in [0.1, 0.8, 1.4_f32] {
            let towards_eye = Vec3::new(slant.sin(), 0.0, slant.cos());
            let rays = (0..1 << 14).map(|number| lobe_ray([Vec3::Z, towards_eye], roughness, point_of(number, 7)));
            let sampled = rays.fold([Vec3::ZERO; 2], |[share, mean], ray| {
                [share + ray.weight, mean + ray.direction_in_world * ray.weight]
            });
            for (sampled, expected) in
                sampled.map(|sum| sum / (1 << 14) as f32).into_iter().zip(integrated(towards_eye, roughness.powi(2)))
            {
                let off = (sampled - expected).abs().max_element();
                assert!(off < 0.01, "{roughness}, {slant}: {sampled}, not {expected}");
            }
        }
    }
}

#[test]
fn glossy_pixels_show_what_their_twins_meet() {
    let mut scene = teapot_floor();
    // Matt surfaces are shown as they are, so that their light needs no twin.
    scene.materials[0].unlit = true;
    scene.illumination = dark();
    let camera = before_the_floor();
    let on_device = upload(&scene);
    let mut twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    twin.footprint = camera.focal_px.min_element().recip();
    for rays in [1, 8] {
        let view = view_of(&on_device, &format!("shadows, glossy {rays}"), &camera);
        let expected = |pixel: UVec2| {
            let lobe = twin.lobe(&camera, pixel, rays);
            let arriving = |ray: &scalar::reflections::Bounce| {
                ray.hit.map_or(Vec3::ZERO, |hit| twin.look(&hit).base_linear) * ray.throughput_linear
            };
            (!lobe.is_empty()).then(|| lobe.iter().map(arriving).sum::<Vec3>())
        };
        let glossy: Vec<(UVec2, Vec3)> = pixels(SIZE_PX).filter_map(|pixel| Some((pixel, expected(pixel)?))).collect();
        let same = glossy.iter().filter(|(pixel, want)| {
            (code_of(linear_at(&view, *pixel)) - code_of(*want)).abs().max_element() <= ROUNDING as f32
        });
        let same = same.count();
        assert!(glossy.len() > 1500, "{}", glossy.len());
        assert!(same * 100 >= glossy.len() * 99, "{rays}: {same} of {}", glossy.len());
    }
}

#[test]
fn a_white_furnace_shows_the_reflectance() {
    let mut scene = of_parts(vec![floor_mirror(0.8)]);
    scene.illumination.environment = Environment::uniform(Vec3::splat(0.5));
    for (height_m, roughness) in [(1.5, 0.0), (1.5, 0.33), (0.2, 0.33), (0.2, 1.0), (1.5, 1.0)] {
        scene.materials[0].roughness = roughness;
        let on_device = upload(&scene);
        let eye = Vec3::new(0.0, height_m, 3.0);
        let camera = PinholeCamera::looking_at(eye, Vec3::new(0.0, -0.5, 0.0), Vec3::Y, 0.7, SIZE_PX);
        let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
        for rays in [1, 7] {
            let view = view_of(&on_device, &format!("shadows, glossy {rays}"), &camera);
            for pixel in pixels(SIZE_PX) {
                let ray = scalar::rays::pixel_ray(&camera, pixel);
                let Some(hit) = twin.closest(&ray, camera.near_m) else { continue };
                let reflector = twin.look(&hit).reflector.expect("a reflector");
                let towards_eye = -ray.direction_in_world.normalize_or_zero();
                let expected = code_of(environment_reflectance_linear(Vec3::Y, towards_eye, &reflector) * 0.5);
                let got = code_of(linear_at(&view, pixel));
                assert!((got - expected).abs().max_element() < 1.1, "{roughness}, {rays}: {got}, not {expected}");
            }
        }
    }
}

#[test]
fn a_smooth_reflector_is_a_mirror() {
    let scene = mirror_pair();
    let on_device = upload(&scene);
    let camera = between_the_pair();
    let [mirrored, glossy, both, without] =
        ["shadows, reflections 1", "shadows, glossy 4", "shadows, reflections 1, glossy 4", "shadows"]
            .map(|lighting| view_of(&on_device, lighting, &camera));
    assert!(both == mirrored, "mirrors leave nothing to rays of lobes");
    let differ = |other: &View| {
        let far = |pixel: &UVec2| {
            let off = code_of(linear_at(&mirrored, *pixel)) - code_of(linear_at(other, *pixel));
            off.abs().max_element() > ROUNDING as f32
        };
        pixels(SIZE_PX).filter(far).count()
    };
    // A lobe of the least roughness is about a pixel wide: edges are softer.
    assert!(differ(&glossy) * 10 < differ(&without), "{} of {}", differ(&glossy), differ(&without));
}

#[test]
fn a_mirror_and_its_lobe_share_what_a_bright_ceiling_sends() {
    let glow = 0.5;
    let ceiling = quad(Vec3::Y * 2.0, 400.0, Vec3::NEG_Y, [255; 3]);
    let bright = Material { base_color_linear: [glow, glow, glow, 1.0], ..glowing() };
    let mut scene = of_parts(vec![floor_mirror(0.9), (ceiling, bright, Affine3A::IDENTITY)]);
    scene.illumination.environment = Environment::uniform(Vec3::splat(0.1));
    let camera = PinholeCamera::looking_at(Vec3::new(0.0, 1.0, 2.0), Vec3::ZERO, Vec3::Y, 0.4, UVec2::splat(16));
    for roughness in [0.0, 0.125, 0.15, 0.2, 0.5] {
        scene.materials[0].roughness = roughness;
        let on_device = upload(&scene);
        let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
        let view = view_of(&on_device, "shadows, reflections 1, glossy 8", &camera);
        let ray = scalar::rays::pixel_ray(&camera, UVec2::splat(8));
        let hit = twin.closest(&ray, camera.near_m).expect("the floor");
        let reflector = twin.look(&hit).reflector.expect("a reflector");
        let towards_eye = -ray.direction_in_world.normalize_or_zero();
        let expected = code_of(environment_reflectance_linear(Vec3::Y, towards_eye, &reflector) * glow);
        let got = code_of(linear_at(&view, UVec2::splat(8)));
        assert!((got - expected).abs().max_element() < 4.0, "{roughness}: {got}, not {expected}");
    }
}

#[test]
fn errors_fall_with_the_root_of_the_number_of_rays() {
    let on_device = upload(&teapot_floor());
    let camera = before_the_floor();
    let drawn = |rays: u32| view_of(&on_device, &format!("shadows, glossy {rays}"), &camera);
    let truth = drawn(256);
    let error = |rays: u32| {
        let view = drawn(rays);
        let squares =
            pixels(SIZE_PX).map(|pixel| (linear_at(&view, pixel) - linear_at(&truth, pixel)).length_squared());
        squares.sum::<f32>().sqrt()
    };
    let errors = [1, 4, 16, 64].map(error);
    println!("errors by 1, 4, 16 and 64 rays: {errors:?}");
    // Points of a sequence do better than the root where the lobe sees one surface.
    let gains = [0, 1, 2].map(|i| errors[i] / errors[i + 1]);
    assert!(gains.iter().all(|gain| (1.6..4.0).contains(gain)), "{errors:?}");
}

#[test]
fn only_pixels_with_reflectors_change_and_repeats_are_equal() {
    let on_device = upload(&teapot_floor());
    let camera = before_the_floor();
    let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    let [without, with, again] = ["", ", glossy 2", ", glossy 2"]
        .map(|glossy| view_of(&on_device, &format!("soft 2, occlusion 2{glossy}"), &camera));
    assert_eq!(greatest_difference(&with, &again), 0);
    let mut changed = 0;
    for pixel in pixels(SIZE_PX) {
        let differs = linear_at(&without, pixel) != linear_at(&with, pixel);
        let hit = twin.closest(&scalar::rays::pixel_ray(&camera, pixel), camera.near_m);
        let is_glossy = hit.is_some_and(|hit| twin.look(&hit).reflector.is_some());
        assert!(is_glossy || !differs, "{pixel}");
        changed += u32::from(differs);
    }
    assert!(changed > 1500, "{changed}");
}

#[test]
fn samples_of_a_pixel_share_its_rays() {
    let scene = upload(&teapot_floor());
    let planes = ViewPlanes { antialias: Antialias::of(4).expect("four samples"), ..ViewPlanes::COLOR };
    let drawn = |rays: u32| {
        let work = DrawWork { visibility: Visibility::Rays, ..work(&scene, &format!("shadows, glossy {rays}")) };
        device().1.draw_views(work, &[before_the_floor()], planes).expect("a view").remove(0)
    };
    let [one, four, five] = [1, 4, 5].map(drawn);
    assert!(one == four && five != four, "one ray for each sample, and two");
}
