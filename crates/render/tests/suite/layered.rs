//! Layered images: all surfaces on the lines of a parallel camera.

use depth_image::{Aabb, CubeGrid, Environment, LayeredDepthImage, Light, PinholeCamera, Ray, linear_from_rgb9e5};
use fixtures::{teapot_mirror, uv_sphere};
use glam::{UVec2, Vec3};
use render::{LayerSelection, RenderError, scalar};
use scene::Scene;

use crate::stage::{device, floor_under, image, lamps, upload, work};

fn layers(scene: &Scene, side: u32, kept: LayerSelection, lighting: &str) -> [LayeredDepthImage; 3] {
    let scene_on_device = upload(scene);
    let grid = CubeGrid::around(&scene.bounds(), side).expect("a grid");
    [0, 1, 2].map(|axis| {
        let image = device().1.draw_layers(work(&scene_on_device, lighting), &grid.camera(axis), kept).expect("layers");
        image.validate().unwrap_or_else(|error| panic!("{axis}: {error}"));
        image
    })
}

/// Front after front along a line, towards the camera's far side: depths and normals.
pub fn fronts(twin: &scalar::rays::Scene, ray: Ray, range_m: f32) -> Vec<f32> {
    let mut from_m = 0.0;
    let next = || {
        let hit = twin.closest_between(&ray, from_m, range_m)?;
        from_m = hit.t + 1e-4 * range_m;
        Some(hit.t)
    };
    std::iter::from_fn(next).take(64).collect()
}

/// Sides towards the camera are met on the way there, the others on the way back.
#[test]
fn lines_hold_what_their_twins_rays_meet() {
    let scene = teapot_mirror();
    let on_device = upload(&scene);
    let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    for (axis, image) in layers(&scene, 64, LayerSelection::All, "unlit").into_iter().enumerate() {
        let camera = image.camera;
        let mut same = 0;
        let mut lines = 0;
        let mut samples = 0;
        for line in 0..camera.pixel_count() {
            let pixel = UVec2::new(line as u32 % camera.size_px.x, line as u32 / camera.size_px.x).as_vec2() + 0.5;
            let ray = camera.ray(pixel);
            let back = Ray { origin_in_world: ray.at(camera.range_m), direction_in_world: -ray.direction_in_world };
            let mut expected = fronts(&twin, ray, camera.range_m);
            expected.extend(fronts(&twin, back, camera.range_m).iter().map(|depth_m| camera.range_m - depth_m));
            expected.sort_by(f32::total_cmp);
            let found = &image.planar_depth_m[image.line(line)];
            let is_near = |(a, b): (&f32, &f32)| (a - b).abs() < 2e-3 * camera.range_m;
            same += usize::from(found.len() == expected.len() && found.iter().zip(&expected).all(is_near));
            lines += 1;
            samples += found.len();
        }
        println!("axis {axis}: {same} of {lines} lines, {samples} samples");
        assert!(same as f64 >= 0.98 * f64::from(lines) && samples > 400, "{axis}: {same} of {lines}, {samples}");
    }
}

#[test]
fn a_sphere_has_two_sides_and_each_axis_its_own_part_of_them() {
    let scene = uv_sphere(1.0, 96);
    let bounds = Aabb::around(scene.bounds().corners());
    let center = bounds.center();
    let radius = 0.5 * bounds.size().max_element();
    let [all, dominant] = [LayerSelection::All, LayerSelection::Dominant].map(|kept| layers(&scene, 64, kept, "unlit"));
    let counts =
        |images: &[LayeredDepthImage; 3]| images.iter().map(LayeredDepthImage::sample_count).sum::<usize>() as f32;
    for image in &dominant {
        let [right, down, forward] = image.camera.axes_in_world();
        for line in 0..image.camera.pixel_count() {
            let columns = image.camera.size_px.x;
            let pixel = UVec2::new(line as u32 % columns, line as u32 / columns).as_vec2() + 0.5;
            for sample in image.line(line) {
                let normal = image.plane_normal_in_world(sample);
                let point = image.camera.ray(pixel).at(image.planar_depth_m[sample]);
                assert!((point.distance(center) - radius).abs() < 0.01 * radius, "{point}");
                assert!(normal.dot((point - center) / radius) > 0.99, "outward: {normal} at {point}");
                let own = normal.dot(forward).abs();
                assert!(own >= 0.85 * normal.dot(right).abs().max(normal.dot(down).abs()), "{normal}");
            }
        }
    }
    // The greatest of a unit vector's components over their sum, in the mean: 0.555; with the overlap 0.605.
    let share = counts(&dominant) / counts(&all);
    println!("dominant over all: {share}");
    assert!((0.58..0.63).contains(&share), "{share}");
}

/// A floor is seen from both sides; its lower side is dark.
#[test]
fn sides_are_lit_by_themselves() {
    let lamp =
        Light::Directional { towards_light_in_world: Vec3::Y, irradiance_linear: Vec3::ONE, angular_radius_rad: 0.0 };
    let mut scene = floor_under(&[], lamps(vec![lamp]));
    scene.materials[0].double_sided = true;
    scene.illumination.environment =
        Environment { zenith_linear: Vec3::ZERO, nadir_linear: Vec3::ZERO, is_mapped: false };
    let image = layers(&scene, 16, LayerSelection::Dominant, "shadows")[1].clone();
    assert_eq!(image.layer_count(), 2);
    let mut bright = 0;
    for (sample, &color) in image.color_rgb9e5.iter().enumerate() {
        let up = image.plane_normal_in_world(sample).y;
        let linear = linear_from_rgb9e5(color);
        assert!(up.abs() > 0.99);
        assert_eq!(linear.x > 0.1, up > 0.0, "{linear} {up}");
        bright += usize::from(up > 0.0);
    }
    assert_eq!(2 * bright, image.sample_count());
}

/// The light at a sample is that of the same point in a depth image.
#[test]
fn light_is_that_of_depth_images() {
    let scene = teapot_mirror();
    let on_device = upload(&scene);
    for lighting in ["unlit", "phong", "shadows", "soft 64, occlusion 64"] {
        let above = layers(&scene, 128, LayerSelection::Dominant, lighting)[1].clone();
        let bounds = scene.bounds();
        let eye = bounds.center() + Vec3::Y * 200.0;
        let camera = PinholeCamera::looking_at(eye, bounds.center(), Vec3::NEG_Z, 0.05, UVec2::splat(256));
        let seen = image(work(&on_device, lighting), &camera);
        let mut off = Vec::new();
        for line in 0..above.camera.pixel_count() {
            let columns = above.camera.size_px.x;
            let pixel = UVec2::new(line as u32 % columns, line as u32 / columns).as_vec2() + 0.5;
            let Some(sample) = above.line(line).next() else { continue };
            let point = above.camera.ray(pixel).at(above.planar_depth_m[sample]);
            let Some(at) = camera.project(point).filter(|at| camera.contains(at.pixel)) else { continue };
            let texel = (at.pixel.y as u32 * 256 + at.pixel.x as u32) as usize;
            if (seen.inverse_depth_per_m[texel].recip() - at.planar_depth_m).abs() > 0.01 {
                continue;
            }
            let [own, others] = [above.color_rgb9e5[sample], seen.color_rgb9e5[texel]].map(linear_from_rgb9e5);
            off.push((own - others).abs().element_sum() / 3.0);
        }
        // Between two checks, points of one texel have different colours.
        off.sort_by(f32::total_cmp);
        let [median, most] = [off.len() / 2, off.len() * 9 / 10].map(|place| off[place]);
        println!("{lighting}: {median}, of nine tenths {most}, over {} samples", off.len());
        assert!(off.len() > 500 && median < 0.005 && most < 0.05, "{lighting}: {median} {most} {}", off.len());
    }
}

#[test]
fn light_does_not_depend_on_how_often_it_is_made_and_a_part_has_the_light_of_the_whole() {
    let scene = teapot_mirror();
    let on_device = upload(&scene);
    let camera = CubeGrid::around(&scene.bounds(), 48).expect("a grid").camera(2);
    let draw = |camera| {
        device().1.draw_layers(work(&on_device, "soft 4, occlusion 4"), &camera, LayerSelection::All).expect("layers")
    };
    let once = draw(camera);
    let again = draw(camera);
    assert_eq!(once, again);
    let part = depth_image::ViewPart { first_px: UVec2::new(0, 4), size_px: UVec2::new(camera.size_px.x, 8) };
    let part = draw(camera.part(&part));
    let line = |row: usize| once.first[row * camera.size_px.x as usize] as usize;
    let own = line(4)..line(12);
    let same = |&(a, b): &(&u32, &u32)| a == b;
    let equal = part.color_rgb9e5.iter().zip(&once.color_rgb9e5[own.clone()]).filter(same).count();
    assert_eq!(part.sample_count(), own.len());
    assert!(equal as f64 > 0.98 * own.len() as f64, "{equal} of {}", own.len());
}

#[test]
fn a_camera_that_cannot_be_used_is_refused() {
    let on_device = upload(&teapot_mirror());
    let good = CubeGrid::around(&teapot_mirror().bounds(), 16).expect("a grid").camera(0);
    for camera in [
        depth_image::ParallelCamera { spacing_m: f32::NAN, ..good },
        depth_image::ParallelCamera { range_m: 0.0, ..good },
        depth_image::ParallelCamera { size_px: UVec2::new(4, 0), ..good },
    ] {
        let drawn = device().1.draw_layers(work(&on_device, "unlit"), &camera, LayerSelection::All);
        assert!(matches!(drawn, Err(RenderError::Camera { index: 0, .. })), "{camera:?}");
    }
}
