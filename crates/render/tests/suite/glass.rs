//! Glass against closed forms and the scalar reference: directions, shares, light through it, and shared light behind it.

use depth_image::{
    Camera, Environment, Illumination, Light, LightCacheQuality, PinholeCamera, Ray, View, ViewPlanes,
    environment_reflectance_linear, linear_from_rgb9e5,
};
use fixtures::{clear_glass, glass, quad, unit_cube, uv_sphere};
use glam::{Affine3A, UVec2, Vec3};
use metrics::flip_map;
use render::scalar::glass::{Passage, fresnel};
use render::{GpuScene, scalar};
use scene::{Instance, Material, Scene, Volume};

use crate::reflections::{ROUNDING, code_of, dark, floor_mirror, glowing, linear_at, of_parts, pixels, view_of};
use crate::stage::{LIGHT, device, floor_light, floor_under, image, mean, upload, work};

const IOR: f32 = 1.5;
const AMBER: Vec3 = Vec3::new(1.0, 0.6, 0.2);

fn body(ior: f32) -> Material {
    clear_glass("body", ior, Some(Volume::CLEAR))
}

fn amber_pane() -> Material {
    let [r, g, b] = AMBER.to_array();
    Material { base_color_linear: [r, g, b, 1.0], double_sided: true, ..clear_glass("pane", IOR, None) }
}

/// A cuboid of these sides around the origin.
fn block(sides: Vec3, material: Material) -> (Scene, Material, Affine3A) {
    let mut cube = unit_cube();
    cube.meshes[0].vertices.iter_mut().for_each(|vertex| vertex.color_srgba8 = [255; 4]);
    (cube, material, Affine3A::from_scale(sides))
}

/// A square that shows light of this strength, whatever shines on it.
fn glow(center: Vec3, half_size_m: f32, normal: Vec3, strength: f32) -> (Scene, Material, Affine3A) {
    let material = Material { base_color_linear: [strength, strength, strength, 1.0], ..glowing() };
    (quad(center, half_size_m, normal, [255; 3]), material, Affine3A::IDENTITY)
}

fn twin(scene: &Scene) -> scalar::rays::Scene {
    scalar::rays::Scene::of(&upload(scene), 0.0).expect("a tree")
}

fn passage(twin: &scalar::rays::Scene, origin_in_world: Vec3, direction_in_world: Vec3) -> Passage {
    let ray = Ray { origin_in_world, direction_in_world };
    let hit = twin.closest(&ray, 0.0).expect("glass");
    twin.through_glass(&ray, hit, 1)
}

fn looking_down_z(size_px: u32) -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, 0.5, UVec2::splat(size_px))
}

#[test]
fn a_slab_shifts_rays_and_keeps_their_direction() {
    let thickness_m = 0.2;
    for ior in [1.05, 1.33, 1.5, 2.4] {
        let twin = twin(&of_parts(vec![block(Vec3::new(40.0, 40.0, thickness_m), body(ior))]));
        for tenths in (0..=890).step_by(5).chain([895]) {
            let angle = (tenths as f32 * 0.1).to_radians();
            let (sin, cos) = angle.sin_cos();
            let direction = Vec3::new(sin, 0.0, -cos);
            let origin = Vec3::new(0.0, 0.0, 0.5 * thickness_m) - direction * 5.0;
            let passage = passage(&twin, origin, direction);
            assert_eq!(passage.interfaces, 2, "{ior} {angle}");
            assert!(passage.ray.direction_in_world.angle_between(direction) < 2e-3, "{ior} {angle}");
            let along = passage.ray.origin_in_world - origin;
            let shift_m = (along - direction * along.dot(direction)).length();
            let expected_m = thickness_m * sin * (1.0 - cos / (ior * ior - sin * sin).sqrt());
            assert!((shift_m - expected_m).abs() < 1e-4, "{ior} {angle}: {shift_m}, not {expected_m}");
            let share = (1.0 - fresnel(cos, 1.0 / ior)).powi(2);
            assert!((passage.throughput_linear.x - share).abs() < 0.01, "{ior} {angle}: {}", passage.throughput_linear);
        }
    }
}

/// Angles between the directions of rays through a ball and the closed form's, in degrees, sorted.
fn ball_errors(segments: u32, ior: f32, most: f32) -> Vec<f32> {
    let twin = twin(&of_parts(vec![(uv_sphere(1.0, segments), body(ior), Affine3A::IDENTITY)]));
    let mut errors = Vec::new();
    for number in 0..4000 {
        let place = scalar::sequence::point_of(number, 3) * 2.0 - 1.0;
        let b = place.length();
        if b > most || b < 1e-3 {
            continue;
        }
        let passage = passage(&twin, place.extend(5.0), Vec3::NEG_Z);
        assert_eq!(passage.interfaces, 2, "{place}");
        let turn = 2.0 * (b.asin() - (b / ior).asin());
        let towards_axis = -place.extend(0.0) / b;
        let expected = Vec3::NEG_Z * turn.cos() + towards_axis * turn.sin();
        // The sine is exact for small angles.
        errors.push(passage.ray.direction_in_world.cross(expected).length().asin().to_degrees());
    }
    errors.sort_by(f32::total_cmp);
    errors
}

#[test]
fn a_ball_sends_rays_where_its_closed_form_does() {
    for ior in [1.05, 1.33, 1.5, 2.0, 2.4] {
        let errors = ball_errors(512, ior, 0.95);
        let at = |share: f32| errors[((errors.len() - 1) as f32 * share) as usize];
        println!("ball, n = {ior}, within 0.95 r: median {:.4}°, 95 % {:.4}°, most {:.4}°", at(0.5), at(0.95), at(1.0));
        assert!(at(0.5) < 0.02 && at(0.95) < 0.1, "{ior}: {} {}", at(0.5), at(0.95));
    }
    // Few triangles send rays elsewhere: the comparison can fail.
    assert!(ball_errors(24, IOR, 0.95)[1000] > 0.1);
}

#[test]
fn a_block_reflects_all_light_beyond_the_critical_angle() {
    let twin = twin(&of_parts(vec![block(Vec3::ONE, body(IOR))]));
    let direction = Vec3::new(1.0, 0.0, -1.0).normalize_or_zero();
    // Into the front, off the right side, out of the back.
    let passage = passage(&twin, Vec3::new(0.4, 0.1, 0.5) - direction, direction);
    assert_eq!(passage.interfaces, 3);
    let expected = Vec3::new(-1.0, 0.0, -1.0).normalize_or_zero();
    assert!(passage.ray.direction_in_world.distance(expected) < 1e-5, "{}", passage.ray.direction_in_world);
    let share = (1.0 - fresnel(0.5_f32.sqrt(), 1.0 / IOR)).powi(2);
    assert!((passage.throughput_linear.x - share).abs() < 1e-4);
}

/// The scene of glass whose matt surfaces are shown as they are, so that their light needs no twin.
fn shown_as_it_is() -> Scene {
    let mut scene = glass();
    scene.materials[0].unlit = true;
    scene.illumination = dark();
    scene
}

fn before_the_glass(size_px: UVec2) -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(0.3, 1.7, 6.0), Vec3::new(0.1, 0.9, 0.0), Vec3::Y, 0.75, size_px)
}

#[test]
fn pixels_of_glass_show_what_their_twins_meet() {
    let scene = shown_as_it_is();
    let camera = before_the_glass(UVec2::new(192, 144));
    let on_device = upload(&scene);
    let mut twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    twin.footprint = camera.focal_px.min_element().recip();
    let view = view_of(&on_device, "shadows", &camera);
    let mut compared = 0;
    let mut same = 0;
    for pixel in pixels(camera.size_px) {
        let ray = scalar::rays::pixel_ray(&camera, pixel);
        let Some(hit) = twin.closest(&ray, camera.near_m).filter(|hit| twin.look(hit).reflector.is_some()) else {
            continue;
        };
        let passage = twin.through_glass(&ray, hit, 0);
        let end = match passage.hit {
            Some(hit) => twin.look(&hit).base_linear,
            None => scene.background.radiance_linear(passage.ray.direction_in_world),
        };
        let want = code_of(end * passage.throughput_linear);
        compared += 1;
        same += i32::from((code_of(linear_at(&view, pixel)) - want).abs().max_element() <= ROUNDING as f32);
    }
    println!("glass: {same} of {compared} pixels show what their twins meet");
    assert!(compared > 5000, "{compared}");
    assert!(same * 200 >= compared * 197, "{same} of {compared}");
}

/// Without lamps and environment glass has no highlights, which are not in samples.
#[test]
fn samples_of_glass_show_what_their_cameras_see_through_it() {
    let on_device = upload(&shown_as_it_is());
    let camera = before_the_glass(UVec2::new(192, 144));
    let view = view_of(&on_device, "shadows", &camera);
    let samples = image(work(&on_device, "shadows"), &camera);
    let glass = glass_pixels(&on_device, &camera);
    let colors = pixels(camera.size_px).zip(&samples.color_rgb9e5).zip(&glass).filter(|(_, is_glass)| **is_glass);
    let off = colors.map(|((pixel, color), _)| {
        let off = code_of(linear_from_rgb9e5(*color)) - code_of(linear_at(&view, pixel));
        off.abs().max_element()
    });
    let off: Vec<f32> = off.collect();
    let same = off.iter().filter(|off| **off <= ROUNDING as f32).count();
    assert!(off.len() > 5000 && same * 200 >= off.len() * 199, "{same} of {}", off.len());
    // Views go through the glass of samples of light themselves.
    let light = device().1.draw_depth_images(work(&on_device, "shadows"), &[camera.into()], LIGHT).expect("light");
    let lamps = &light[0].light.as_ref().expect("light").lamps_rgb9e5;
    assert!(lamps.iter().all(|light| *light == 0));
}

#[test]
fn a_thin_pane_shows_what_is_straight_behind_it() {
    let parts = |material: Material| {
        let pane = (quad(Vec3::Z * 0.5, 2.0, Vec3::Z, [255; 3]), material, Affine3A::IDENTITY);
        of_parts(vec![pane, glow(Vec3::new(0.2, 0.1, -1.0), 0.4, Vec3::Z, 0.8)])
    };
    let camera = looking_down_z(64);
    let seen = view_of(&upload(&parts(amber_pane())), "shadows", &camera);
    let mut without = parts(amber_pane());
    without.instances.remove(0);
    let bare = view_of(&upload(&without), "shadows", &camera);
    for pixel in pixels(camera.size_px) {
        let cosine = -scalar::rays::pixel_ray(&camera, pixel).direction_in_world.normalize_or_zero().z;
        let expected = linear_at(&bare, pixel) * AMBER * (1.0 - fresnel(cosine, 1.0 / IOR));
        let off = (code_of(linear_at(&seen, pixel)) - code_of(expected)).abs().max_element();
        assert!(off < 2.1, "{pixel}: {off}");
    }
    let depth = seen.inverse_depth_per_m.expect("depth");
    assert!(depth.iter().all(|&inverse| (inverse - 1.0 / 2.5).abs() < 1e-4), "the picture's depth is the pane's");
}

#[test]
fn a_volume_takes_light_by_its_thickness() {
    let attenuation_color_linear = Vec3::new(0.5, 0.9, 0.25);
    for (thickness_m, distance_m) in [(0.3, 0.3), (0.6, 0.3), (0.3, 1.2)] {
        let volume = Some(Volume { attenuation_color_linear, attenuation_distance_m: distance_m });
        let slab = block(Vec3::new(4.0, 4.0, thickness_m), clear_glass("slab", IOR, volume));
        let scene = of_parts(vec![slab, glow(Vec3::Z * -1.0, 4.0, Vec3::Z, 0.9)]);
        let view = view_of(&upload(&scene), "shadows", &looking_down_z(9));
        let left = attenuation_color_linear.map(|share| share.powf(thickness_m / distance_m));
        let expected = code_of(left * 0.9 * (1.0 - fresnel(1.0, IOR)).powi(2));
        let got = code_of(linear_at(&view, UVec2::splat(4)));
        assert!((got - expected).abs().max_element() < 2.0, "{thickness_m} {distance_m}: {got}, not {expected}");
    }
}

#[test]
fn what_is_not_transmitted_is_scattered() {
    for transmission in [0.25, 0.6] {
        let pane = Material { transmission, dielectric_reflectance_linear: Vec3::ZERO, roughness: 0.9, ..amber_pane() };
        let pane = (quad(Vec3::Z * 0.5, 2.0, Vec3::Z, [255; 3]), pane, Affine3A::IDENTITY);
        let mut scene = of_parts(vec![pane, glow(Vec3::Z * -1.0, 4.0, Vec3::Z, 0.7)]);
        scene.illumination.environment = Environment::uniform(Vec3::splat(0.4));
        let view = view_of(&upload(&scene), "shadows", &looking_down_z(9));
        let behind = 0.7 * (1.0 - fresnel(1.0, IOR)) * transmission;
        let expected = AMBER * (behind + 0.4 * (1.0 - transmission));
        let off = code_of(linear_at(&view, UVec2::splat(4))) - code_of(expected);
        // The fit of the environment's highlight leaves a little where there is no reflectance.
        assert!(off.min_element() > -2.0 && off.max_element() < 8.0, "{transmission}: {off}");
    }
}

#[test]
fn glass_of_a_white_furnace_is_nearly_as_bright_as_the_furnace() {
    let mut scene = of_parts(vec![(uv_sphere(1.0, 192), body(IOR), Affine3A::IDENTITY)]);
    scene.illumination.environment = Environment::uniform(Vec3::splat(0.5));
    scene.background = Environment::uniform(Vec3::splat(0.5));
    let on_device = upload(&scene);
    let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    let camera = looking_down_z(96);
    for lighting in ["shadows", "shadows, reflections 1"] {
        let view = view_of(&on_device, lighting, &camera);
        let mut shares = Vec::new();
        for pixel in pixels(camera.size_px) {
            let ray = scalar::rays::pixel_ray(&camera, pixel);
            let Some(hit) = twin.closest(&ray, camera.near_m) else { continue };
            let towards_eye = -ray.direction_in_world.normalize_or_zero();
            let normal = twin.normal_in_world(&hit);
            let reflector = twin.look(&hit).reflector.expect("a reflector");
            let reflected = environment_reflectance_linear(normal, towards_eye, &reflector);
            let passed = twin.through_glass(&ray, hit, 0).throughput_linear;
            let got = linear_at(&view, pixel);
            let off = (code_of(got) - code_of((reflected + passed) * 0.5)).abs().max_element();
            // A surface seen edge-on reflects to where it is hidden by itself.
            assert!(off < 3.0 || normal.dot(towards_eye) < 0.1, "{lighting}, {pixel}: {off}");
            shares.push(got.y / 0.5);
        }
        let least = shares.iter().copied().fold(f32::INFINITY, f32::min);
        let mean = mean(shares);
        println!("ball in a white furnace, {lighting}: {mean:.3} of its light, {least:.3} at the darkest pixel");
        // What is reflected inside the ball is lost, most near the rim.
        assert!(mean > 0.9 && least > 0.7, "{mean} {least}");
    }
}

#[test]
fn light_goes_straight_through_glass_tinted() {
    let lamp = Light::Directional {
        towards_light_in_world: Vec3::new(0.6, 0.8, 0.0),
        irradiance_linear: Vec3::ONE,
        angular_radius_rad: 0.0,
    };
    let illumination = Illumination { lights: vec![lamp], environment: Environment::uniform(Vec3::ZERO) };
    let volume = Volume { attenuation_color_linear: Vec3::splat(0.5), attenuation_distance_m: 0.2 };
    let slab = clear_glass("slab", IOR, Some(volume));
    let reflected = fresnel(0.8, 1.0 / IOR);
    let green_pane = Material { base_color_linear: [0.2, 0.7, 0.3, 1.0], ..amber_pane() };
    for (material, thickness_m, expected) in [
        (green_pane, 1e-4, 0.7 * (1.0 - reflected).powi(2) * 0.7),
        (slab, 0.2, (1.0 - reflected).powi(2) * 0.5_f32.powf(1.0 / 0.8)),
    ] {
        let mut scene = floor_under(&[], illumination.clone());
        let (cube, _, _) = block(Vec3::ONE, material.clone());
        let world_from_mesh =
            Affine3A::from_scale_rotation_translation(Vec3::new(8.0, thickness_m, 8.0), glam::Quat::IDENTITY, Vec3::Y);
        scene.meshes.push(cube.meshes[0].clone());
        scene.meshes[1].parts[0].material = 1;
        scene.instances.push(Instance { mesh: 1, world_from_mesh });
        scene.materials.push(material);
        let below = PinholeCamera::looking_at(Vec3::Y * 0.9, Vec3::ZERO, Vec3::NEG_Z, 0.9, UVec2::splat(16));
        for lighting in ["shadows", "soft 4"] {
            let seen = floor_light(&image(work(&upload(&scene), lighting), &below));
            assert!(seen.len() > 200, "{}", seen.len());
            for (point, light) in seen {
                assert!((light / 0.8 - expected).abs() < 0.01, "{lighting}, {point}: {light}, not {expected}");
            }
        }
    }
}

#[test]
fn mirrors_show_what_is_behind_glass() {
    let pane = (quad(Vec3::Y, 40.0, Vec3::NEG_Y, [255; 3]), amber_pane(), Affine3A::IDENTITY);
    let scene = of_parts(vec![floor_mirror(0.9), pane, glow(Vec3::Y * 2.0, 400.0, Vec3::NEG_Y, 0.8)]);
    let camera = PinholeCamera::looking_at(Vec3::new(0.0, 0.8, 0.8), Vec3::ZERO, Vec3::Y, 0.3, UVec2::splat(16));
    let view = view_of(&upload(&scene), "shadows, reflections 1", &camera);
    let twin = twin(&scene);
    let pixel = UVec2::splat(8);
    let ray = scalar::rays::pixel_ray(&camera, pixel);
    let towards_eye = -ray.direction_in_world.normalize_or_zero();
    let hit = twin.closest(&ray, camera.near_m).expect("the mirror");
    let reflector = twin.look(&hit).reflector.expect("a mirror");
    let mirrored = environment_reflectance_linear(Vec3::Y, towards_eye, &reflector);
    let expected = code_of(AMBER * 0.8 * (1.0 - fresnel(towards_eye.y, 1.0 / IOR)) * mirrored);
    let got = code_of(linear_at(&view, pixel));
    assert!((got - expected).abs().max_element() < 3.0, "{got}, not {expected}");
}

#[test]
fn no_pixel_of_glass_is_black_from_inside_along_faces_or_at_grazing_incidence() {
    let ball = (uv_sphere(1.0, 64), body(IOR), Affine3A::from_translation(Vec3::new(0.0, 0.0, -3.0)));
    let pane = (quad(Vec3::new(3.0, 0.0, 0.0), 1.0, Vec3::X, [255; 3]), amber_pane(), Affine3A::IDENTITY);
    let mut scene = of_parts(vec![block(Vec3::new(2.0, 2.0, 0.5), body(2.4)), ball, pane]);
    scene.illumination.environment = Environment::uniform(Vec3::splat(0.5));
    scene.background = Environment::uniform(Vec3::splat(0.5));
    let on_device = upload(&scene);
    let eyes = [
        // Inside the block and the ball; in the planes of a face and of the pane; just above a face.
        (Vec3::ZERO, Vec3::new(0.3, 0.2, -1.0)),
        (Vec3::new(0.0, 0.0, -3.0), Vec3::new(1.0, 0.0, 0.3)),
        (Vec3::new(0.0, 0.0, 0.25), Vec3::new(1.0, 0.0, 0.0)),
        (Vec3::new(3.0, 0.0, 2.0), Vec3::new(0.0, 0.0, -1.0)),
        (Vec3::new(-4.0, 0.0, 0.2501), Vec3::new(1.0, 0.0, 0.0)),
        (Vec3::new(0.0, 3.0, -2.0), Vec3::new(0.0, -1.0, 0.0)),
    ];
    for (eye, towards) in eyes {
        let camera = PinholeCamera::looking_at(eye, eye + towards, Vec3::Y, 1.2, UVec2::splat(64));
        for lighting in ["shadows", "soft 2, occlusion 2, reflections 2"] {
            let view = view_of(&on_device, lighting, &camera);
            let darkest = pixels(camera.size_px).map(|pixel| linear_at(&view, pixel).x).fold(f32::INFINITY, f32::min);
            let brightest = pixels(camera.size_px).map(|pixel| linear_at(&view, pixel).x).fold(0.0, f32::max);
            assert!(darkest > 0.05 && brightest < 1.0, "{eye}, {lighting}: {darkest} to {brightest}");
        }
    }
}

#[test]
fn glass_is_opaque_where_no_light_is_traced() {
    let pane = (quad(Vec3::Z * 0.5, 2.0, Vec3::Z, [255; 3]), amber_pane(), Affine3A::IDENTITY);
    let mut scene = of_parts(vec![pane, glow(Vec3::Z * -1.0, 4.0, Vec3::Z, 0.7)]);
    scene.illumination.environment = Environment::uniform(Vec3::splat(0.4));
    let on_device = upload(&scene);
    for (lighting, light) in [("unlit", 1.0), ("phong", 0.4)] {
        let view = view_of(&on_device, lighting, &looking_down_z(9));
        let off = code_of(linear_at(&view, UVec2::splat(4))) - code_of(AMBER * light);
        assert!(off.abs().max_element() < 2.0, "{lighting}: {off}");
    }
}

/// The pixels that show glass.
fn glass_pixels(on_device: &GpuScene, camera: &PinholeCamera) -> Vec<bool> {
    let twin = scalar::rays::Scene::of(on_device, 0.0).expect("a tree");
    let shows_glass = pixels(camera.size_px).map(|pixel| {
        let hit = twin.closest(&scalar::rays::pixel_ray(camera, pixel), camera.near_m);
        hit.is_some_and(|hit| twin.look(&hit).reflector.is_some())
    });
    shows_glass.collect()
}

#[test]
fn glass_with_shared_light_looks_like_glass_that_is_drawn_directly() {
    let on_device = upload(&glass());
    let camera = before_the_glass(UVec2::new(320, 180));
    let renderer = &device().1;
    let samples: Vec<Camera> = [-0.7, 0.7]
        .map(|x| {
            let eye = camera.eye_in_world + Vec3::X * x;
            PinholeCamera::looking_at(eye, Vec3::new(0.1, 0.9, 0.0), Vec3::Y, 0.9, UVec2::new(320, 180)).into()
        })
        .into();
    let shows_glass = glass_pixels(&on_device, &camera);
    for lighting in ["soft 16, occlusion 16", "soft 16, occlusion 16, reflections 2", "soft 64, occlusion 64"] {
        let work = work(&on_device, lighting);
        let plain = render::DrawWork { lighting: work.lighting.without_reflections().unwrap_or(work.lighting), ..work };
        let images = renderer.draw_depth_images(plain, &samples, LIGHT).expect("samples");
        let cache = renderer.upload_light(work.scene, work.lighting, &images, work.turn).expect("a cache");
        let direct = renderer.draw_views(work, &[camera], ViewPlanes::ALL).expect("a view").remove(0);
        let flip = |view: &View| {
            let mean = flip_map(&direct, view).expect("pictures of one size").mean(Some(&shows_glass));
            mean.expect("a mask").expect("glass")
        };
        for quality in [LightCacheQuality::Fast, LightCacheQuality::Balanced, LightCacheQuality::Fine] {
            let views = renderer.draw_cached_views(work, &cache, quality, &[camera], ViewPlanes::ALL);
            let error = flip(&views.expect("a view").remove(0));
            println!("glass, {lighting}, {quality}: FLIP {error:.4} over glass");
            assert!(error <= 0.03 || quality == LightCacheQuality::Fast, "{lighting}, {quality}: {error}");
        }
        let opaque = view_of(&on_device, "phong", &camera);
        assert!(flip(&opaque) > 0.1, "opaque glass differs: {}", flip(&opaque));
    }
}
