//! Light that surfaces send back, on the software device against closed forms and the scalar twin.

use std::f32::consts::PI;

use depth_image::{
    DepthImage, Environment, Illumination, Light, LightCacheQuality, PinholeCamera, ProvenanceKind, View, ViewPlanes,
    linear_from_rgb9e5, rgb9e5_from_linear,
};
use fixtures::{quad, uv_sphere};
use glam::{Affine3A, UVec2, Vec3};
use render::scalar::{rays, smoothed};
use render::{DrawWork, Visibility};
use scene::procedural::courtyard;
use scene::{Instance, Material, Scene};

use crate::stage::{LIGHT, device, floor_under, lamps, mean, upload, work};

const SIZE_PX: UVec2 = UVec2::new(24, 18);

/// Adds a square with a material of its own.
fn add_quad(scene: &mut Scene, (center, half_m, normal): (Vec3, f32, Vec3), material: Material) {
    let mut mesh = quad(center, half_m, normal, [255; 3]).meshes.remove(0);
    mesh.parts[0].material = scene.materials.len() as u32;
    scene.materials.push(material);
    let mesh_number = scene.meshes.len() as u32;
    scene.meshes.push(mesh);
    scene.instances.push(Instance { mesh: mesh_number, world_from_mesh: Affine3A::IDENTITY });
}

fn painted(linear: Vec3) -> Material {
    Material { base_color_linear: linear.extend(1.0).to_array(), ..Material::default() }
}

fn glowing(radiance: f32) -> Material {
    Material { emissive_linear: Vec3::splat(radiance), ..painted(Vec3::ZERO) }
}

fn point_lamp(position_in_world: Vec3, intensity: f32) -> Light {
    Light::Point { position_in_world, intensity_linear: Vec3::splat(intensity), radius_m: 0.0 }
}

fn samples(scene: &Scene, lighting: &str, camera: &PinholeCamera) -> DepthImage {
    let uploaded = upload(scene);
    let work = DrawWork { visibility: Visibility::Rays, ..work(&uploaded, lighting) };
    device().1.draw_depth_images(work, &[(*camera).into()], LIGHT).expect("samples").remove(0)
}

/// Light from all around at each surface, by place.
fn ambient_light(image: &DepthImage) -> Vec<(Vec3, Vec3)> {
    let words = &image.light.as_ref().expect("light").environment_rgb9e5;
    let places = (0..image.size_px().y).flat_map(|y| (0..image.size_px().x).map(move |x| (x, y)));
    let lit =
        places.zip(words).filter_map(|((x, y), &word)| Some((image.sample_in_world(x, y)?, linear_from_rgb9e5(word))));
    lit.collect()
}

/// Of the floor at the origin, from just below what is above it.
fn floor_light(scene: &Scene, lighting: &str) -> Vec<(Vec3, Vec3)> {
    let camera = PinholeCamera::looking_at(Vec3::Y * 0.8, Vec3::ZERO, Vec3::NEG_Z, 0.9, SIZE_PX);
    ambient_light(&samples(scene, lighting, &camera)).into_iter().filter(|(point, _)| point.y.abs() < 1e-3).collect()
}

#[test]
fn a_glowing_square_lights_by_its_form_factor() {
    let mut scene = floor_under(&[], lamps(Vec::new()));
    add_quad(&mut scene, (Vec3::Y, 0.5, Vec3::NEG_Y), glowing(1.0));
    let light = floor_light(&scene, "soft 1, indirect 4096");
    let middle = mean(light.iter().filter(|(point, _)| point.length() < 0.06).map(|(_, light)| light.y));
    let x = 0.5f32;
    let root = 1.25f32.sqrt();
    let wanted = 4.0 * x / root * (x / root).atan() / PI;
    assert!((middle - wanted).abs() < 0.01 * wanted, "{middle}, not {wanted}");
}

/// What a wall sends to a floor, integrated over the wall: one bounce of a point lamp of unit intensity.
fn from_wall(wall: (Vec3, f32, Vec3), lamp: Vec3, floor_point: Vec3) -> f32 {
    const STEPS: i32 = 200;
    let (center, half_m, normal) = wall;
    let along = normal.cross(Vec3::Y);
    let step_m = 2.0 * half_m / STEPS as f32;
    let place = |number: i32| (number as f32 + 0.5) * step_m - half_m;
    let patch = |(i, j): (i32, i32)| {
        let at = center + along * place(i) + Vec3::Y * place(j);
        let to_lamp = lamp - at;
        let from_floor = at - floor_point;
        let arriving = to_lamp.normalize_or_zero().dot(normal).max(0.0) / to_lamp.length_squared();
        let towards = from_floor.normalize_or_zero();
        arriving * towards.y.max(0.0) * -towards.dot(normal) / (PI * from_floor.length_squared()) * step_m * step_m
    };
    (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))).map(patch).sum()
}

#[test]
fn walls_send_one_bounce_of_a_lamp_in_their_colours() {
    let lamp = Vec3::new(0.1, 1.2, 0.2);
    let [white, red] = [(Vec3::new(-1.0, 1.0, 0.0), 1.0, Vec3::X), (Vec3::new(1.0, 1.0, 0.0), 1.0, Vec3::NEG_X)];
    let mut scene = floor_under(&[], lamps(vec![point_lamp(lamp, 1.0)]));
    add_quad(&mut scene, white, painted(Vec3::ONE));
    add_quad(&mut scene, red, painted(Vec3::new(0.6, 0.0, 0.0)));
    let light = floor_light(&scene, "soft 1, indirect 4096");
    assert_eq!(light.len(), SIZE_PX.element_product() as usize);
    for (point, got) in light {
        let [of_white, of_red] = [white, red].map(|wall| from_wall(wall, lamp, point));
        let wanted = Vec3::new(of_white + 0.6 * of_red, of_white, of_white);
        assert!((got - wanted).abs().max_element() < 0.01 * wanted.max_element(), "{point}: {got}, not {wanted}");
    }
}

#[test]
fn an_open_sky_lights_a_plane_as_without_rays() {
    let sky = Environment::gradient(Vec3::new(0.8, 0.9, 1.0), Vec3::splat(0.1));
    let scene = floor_under(&[], Illumination { lights: Vec::new(), environment: sky });
    let wanted = sky.diffuse_linear(Vec3::Y);
    for (point, got) in floor_light(&scene, "soft 1, indirect 4096") {
        assert!((got - wanted).abs().max_element() < 0.01 * wanted.max_element(), "{point}: {got}, not {wanted}");
    }
}

/// A floor with a sphere on it beside a red wall and a glowing one, under these lamps.
fn corner(lights: Vec<Light>) -> Scene {
    let environment = Environment::gradient(Vec3::splat(0.5), Vec3::splat(0.1));
    let mut scene = floor_under(&[], Illumination { lights, environment });
    add_quad(&mut scene, (Vec3::new(-1.0, 1.0, 0.0), 1.0, Vec3::X), painted(Vec3::new(0.9, 0.1, 0.1)));
    add_quad(&mut scene, (Vec3::new(0.0, 0.5, -1.0), 0.5, Vec3::Z), glowing(2.0));
    let mesh = scene.meshes.len() as u32;
    scene.meshes.push(uv_sphere(0.3, 24).meshes.remove(0));
    scene.instances.push(Instance { mesh, world_from_mesh: Affine3A::from_translation(Vec3::new(0.1, 0.3, 0.0)) });
    scene
}

#[test]
fn light_is_that_of_the_scalar_twin() {
    let lamp = |x: f32, intensity| Light::Point {
        position_in_world: Vec3::new(x, 2.0, 0.7),
        intensity_linear: Vec3::splat(intensity),
        radius_m: 0.1,
    };
    let few = vec![lamp(0.3, 1.0), lamp(-0.6, 0.5)];
    let many: Vec<Light> = (0..255).map(|number| lamp(0.01 * number as f32 - 1.0, 0.01)).collect();
    let camera = PinholeCamera::looking_at(Vec3::new(0.8, 1.4, 2.2), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(160, 120));
    for lights in [few, many] {
        let scene = corner(lights);
        let image = samples(&scene, "soft 1, indirect 8", &camera);
        let mut twin = rays::Scene::of(&upload(&scene), 0.0).expect("tables");
        twin.footprint = camera.focal_px.min_element().recip();
        let words = &image.light.as_ref().expect("light").environment_rgb9e5;
        let mut lit = 0;
        let mut unlike = 0;
        for (place, &word) in (0..).zip(words) {
            let pixel = UVec2::new(place % 160, place / 160);
            let Some(wanted) = twin.indirect_light(&camera, pixel, &scene.illumination, 8) else { continue };
            let got = linear_from_rgb9e5(word);
            let wanted = linear_from_rgb9e5(rgb9e5_from_linear(wanted));
            lit += 1;
            unlike += usize::from((got - wanted).abs().max_element() > 0.01 * wanted.max_element().max(0.05));
        }
        println!("{} lamps: {unlike} of {lit} pixels differ", scene.illumination.lights.len());
        assert!(lit > 8000 && unlike * 1000 <= lit, "{unlike} of {lit}");
    }
}

#[test]
fn smoothed_samples_have_a_third_of_the_noise() {
    let lamp = point_lamp(Vec3::new(0.3, 2.0, 0.7), 1.0);
    let camera = PinholeCamera::looking_at(Vec3::new(0.8, 1.4, 2.2), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(160, 120));
    let scene = corner(vec![lamp]);
    let [few, many] = ["soft 1, indirect 16", "soft 1, indirect 1024"].map(|light| samples(&scene, light, &camera));
    let smooth = smoothed(&few);
    let off = |image: &DepthImage| {
        let pairs = ambient_light(image).into_iter().zip(ambient_light(&many));
        mean(pairs.map(|((_, light), (_, wanted))| (light - wanted).length_squared())).sqrt()
    };
    let raw = off(&few);
    let smooth_off = off(&smooth);
    println!("RMSE of 16 rays beside 1,024: {raw}, smoothed {smooth_off}");
    assert!(smooth_off < 0.34 * raw, "{raw} {smooth_off}");
    let light = |image: &DepthImage| image.light.clone().expect("light");
    assert!(light(&few).lamps_rgb9e5 == light(&smooth).lamps_rgb9e5, "shadows of lamps are not smoothed");
    assert!(few.inverse_depth_per_m == smooth.inverse_depth_per_m);
}

/// Texels on both sides of a shadow's edge disagree by lamps alone: the view asks lamps, and takes indirect light from samples.
#[test]
fn at_the_edges_of_shadows_indirect_light_is_that_of_samples() {
    let renderer = &device().1;
    let scene = upload(&corner(vec![point_lamp(Vec3::new(0.3, 2.0, 0.7), 2.0)]));
    let camera =
        |x: f32| PinholeCamera::looking_at(Vec3::new(x, 1.4, 2.2), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(160, 120));
    let [many, few] = ["soft 1, indirect 256", "soft 1, indirect 1"].map(|lighting| work(&scene, lighting));
    let images = renderer.draw_depth_images(many, &[camera(0.6).into(), camera(1.0).into()], LIGHT).expect("samples");
    let cache = renderer.upload_light(&scene, few.lighting, &images, few.turn).expect("a cache");
    let view_camera = [camera(0.8)];
    let view = renderer.draw_cached_views(few, &cache, LightCacheQuality::Balanced, &view_camera, ViewPlanes::ALL);
    let view = view.expect("a view").remove(0);
    let [wanted, noisy] =
        [many, few].map(|work| renderer.draw_views(work, &view_camera, ViewPlanes::ALL).expect("a view"));
    let provenance = view.provenance.as_ref().expect("provenance");
    let unknown = (0..provenance.len()).filter(|&pixel| provenance[pixel].kind() == ProvenanceKind::LitHere);
    let unknown: Vec<usize> = unknown.collect();
    let off = |other: &View| {
        let channels = unknown.iter().flat_map(|&pixel| 3 * pixel..3 * pixel + 3);
        let squares = channels.map(|at| (f32::from(other.srgb8[at]) - f32::from(wanted[0].srgb8[at])).powi(2));
        mean(squares).sqrt()
    };
    let own = off(&view);
    let traced = off(&noisy[0]);
    println!("{} unknown pixels: RMSE {own}, with rays of their own {traced}", unknown.len());
    assert!(unknown.len() > 100, "{}", unknown.len());
    assert!(own < 0.5 * traced, "{own} {traced}");
}

#[test]
fn more_rays_than_a_dispatch_traces_keep_the_mean_brightness() {
    let scene = courtyard();
    let camera = PinholeCamera::looking_at(Vec3::new(3.0, 4.0, 6.0), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(96, 72));
    let uploaded = upload(&scene);
    let light = |lighting: &str| {
        let image = device().1.draw_depth_images(work(&uploaded, lighting), &[camera.into()], LIGHT).expect("an image");
        ambient_light(&image[0])
    };
    let few = light("shadows, indirect 64");
    let many = light("shadows, indirect 1024");
    let brightness = |light: &[(Vec3, Vec3)]| mean(light.iter().map(|(_, light)| light.y));
    let few = brightness(&few);
    let many = brightness(&many);
    assert!((few - many).abs() < 2e-3 * many, "{few} {many}");
}

/// Whatever a scene has of lamps and emission, light is a number, and none is made of nothing.
#[test]
fn light_without_bound_or_without_lamps_makes_no_nan() {
    let closed = |material: Material, lights: Vec<Light>| {
        let mut scene = floor_under(&[], lamps(lights));
        for out in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::Z, Vec3::NEG_Z] {
            add_quad(&mut scene, (out, 2.0, -out), material.clone());
        }
        floor_light(&scene, "soft 1, indirect 32")
    };
    let white = painted(Vec3::ONE);
    let brightest = |light: Vec<(Vec3, Vec3)>| {
        assert!(light.iter().all(|(_, light)| light.is_finite()), "no number");
        light.iter().map(|(_, light)| light.max_element()).fold(0.0, f32::max)
    };
    assert_eq!(brightest(closed(white.clone(), Vec::new())), 0.0, "no lamps");
    assert_eq!(brightest(closed(white.clone(), vec![point_lamp(Vec3::Y * 0.5, 0.0)])), 0.0, "a lamp of no power");
    let both = vec![point_lamp(Vec3::Y * 0.5, 0.0), point_lamp(Vec3::Y * 0.5, 1.0)];
    assert!(brightest(closed(white.clone(), both)) > 0.1, "one of two lamps has power");
    // One bounce, so that a closed white room has a bound.
    assert!(brightest(closed(white.clone(), vec![point_lamp(Vec3::Y * 0.5, 1.0)])) < 10.0);
    brightest(closed(white, vec![point_lamp(Vec3::Y, 1e30)]));
    // As much as samples hold.
    assert!(brightest(closed(glowing(1e6), Vec::new())) > 6e4);
}
