//! Light of an environment map on the software device: closed forms, and the error of few rays.

use depth_image::{Environment, EnvironmentLight, EnvironmentMap, Illumination, PinholeCamera, Ray, ViewPlanes};
use glam::{UVec2, Vec2, Vec3};
use render::{DrawWork, scalar};
use scene::Scene;

use crate::stage::{SIZE_PX, device, down_from, floor_light, floor_under, image, lamps, mean, upload, work};

const MAP_PX: UVec2 = UVec2::new(512, 256);

/// A map of a radiance for each texel.
fn map(radiance: impl Fn(UVec2) -> f32) -> EnvironmentMap {
    let places = (0..MAP_PX.y).flat_map(|y| (0..MAP_PX.x).map(move |x| UVec2::new(x, y)));
    let radiances: Vec<Vec3> = places.map(|place| Vec3::splat(radiance(place))).collect();
    EnvironmentMap::new(MAP_PX, &radiances).expect("a map")
}

/// A small sun in the east, 45 degrees high, over a dim sky.
const SUN_PX: UVec2 = UVec2::new(384, 64);

fn sun() -> EnvironmentMap {
    let is_sun = |place: UVec2| place.cmpge(SUN_PX - 1).all() && place.cmple(SUN_PX).all();
    map(|place| if is_sun(place) { 5000.0 } else { 0.1 })
}

/// Tables over a floor, under a sky of 0.5.
fn tables() -> Scene {
    let quads = [(-0.5, 0.3, -0.4), (0.4, 0.2, 0.3), (0.5, 0.5, -0.5), (-0.3, 0.15, 0.5)];
    let quads = quads.map(|(x, y, z)| (Vec3::new(x, y, z), 0.25, Vec3::Y));
    let environment = Environment::uniform(Vec3::splat(0.5));
    Scene {
        background: Environment::uniform(Vec3::splat(0.5)),
        ..floor_under(&quads, Illumination { environment, ..lamps(vec![]) })
    }
}

fn aside() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(0.6, 0.9, 2.0), Vec3::Y * 0.2, Vec3::Y, 0.9, SIZE_PX)
}

/// The codes of a view.
fn seen(scene: &Scene, lighting: &str) -> Vec<f32> {
    let on_device = upload(scene);
    let views = device().1.draw_views(work(&on_device, lighting), &[aside()], ViewPlanes::default());
    views.expect("a view").remove(0).srgb8.into_iter().map(f32::from).collect()
}

fn psnr_db(a: &[f32], b: &[f32]) -> f32 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    10.0 * (255.0 * 255.0 / mean(squares).max(1e-9)).log10()
}

#[test]
fn a_uniform_map_equals_the_constant_environment() {
    let constant = tables();
    let reference = seen(&constant, "occlusion 1024 1m");
    let uniform = constant.clone().surrounded_by(map(|_| 0.5));
    let almost = constant.clone().surrounded_by(map(|place| if place == SUN_PX { 0.505 } else { 0.5 }));
    for scene in [uniform, almost] {
        for lighting in ["phong", "soft 4", "occlusion 16 1m", "soft 16, occlusion 16 1m"] {
            let [mapped, plain] = [&scene, &constant].map(|scene| seen(scene, lighting));
            let share = mean(mapped.iter().copied()) / mean(plain.iter().copied());
            assert!((share - 1.0).abs() < 5e-3 && psnr_db(&mapped, &plain) > 50.0, "{lighting}: {share}");
        }
        let error_db = [16, 64, 256].map(|rays| psnr_db(&seen(&scene, &format!("occlusion {rays} 1m")), &reference));
        println!("PSNR of 16, 64 and 256 rays: {error_db:?} dB");
        assert!(error_db[0] >= 28.0, "{error_db:?}");
        assert!(error_db[1] >= error_db[0] + 5.0 && error_db[2] >= error_db[1] + 5.0, "{error_db:?}");
    }
}

#[test]
fn a_gradients_map_lights_as_the_gradient() {
    let gradient = Environment::gradient(Vec3::splat(0.9), Vec3::splat(0.1));
    let height = |row: u32| (std::f32::consts::PI * (row as f32 + 0.5) / MAP_PX.y as f32).cos();
    let scene = floor_under(&[], lamps(vec![])).surrounded_by(map(|place| 0.5 + 0.4 * height(place.y)));
    for lighting in ["phong", "soft 4", "occlusion 256 10m", "soft 4, occlusion 256 10m"] {
        let light = mean(floor_light(&image(work(&upload(&scene), lighting), &down_from(3.0))).iter().map(|(_, l)| *l));
        let wanted = gradient.diffuse_linear(Vec3::Y).y;
        assert!((light / wanted - 1.0).abs() < 5e-3, "{lighting}: {light}, not {wanted}");
    }
}

#[test]
fn the_sun_of_a_map_casts_its_shadow_at_the_projected_place() {
    // At half a metre's height the shadow falls half a metre to -x.
    let map = sun();
    let sun_irradiance = EnvironmentLight::of(&map).bright_irradiance;
    let scene = floor_under(&[(Vec3::Y * 0.5, 0.2, Vec3::Y)], lamps(vec![])).surrounded_by(map);
    let on_device = upload(&scene);
    for lighting in ["shadows", "soft 16", "occlusion 16 0.01m", "soft 16, occlusion 16 0.01m"] {
        let mut lit = 0;
        let mut dark = 0;
        for (point, light) in floor_light(&image(work(&on_device, lighting), &down_from(4.0))) {
            let from_edge = (point.x + 0.5).abs().max(point.z.abs()) - 0.2;
            if from_edge.abs() > 0.04 {
                let wanted = 0.1 + if from_edge < 0.0 { 0.0 } else { sun_irradiance * 0.5f32.sqrt() };
                // A ray of occlusion may meet what the sun has below the limit.
                assert!((light - wanted).abs() < 0.02 * wanted + 0.02, "{lighting} {point}: {light}, not {wanted}");
                *(if from_edge < 0.0 { &mut dark } else { &mut lit }) += 1;
            }
        }
        assert!(lit > 500 && dark > 20, "{lighting}: {lit} lit, {dark} dark");
    }
}

#[test]
fn rays_to_a_small_sun_have_a_fifth_of_the_error_of_uniform_directions() {
    let map = sun();
    let scene = Scene { illumination: lamps(vec![]), ..tables() }.surrounded_by(map.clone());
    let on_device = upload(&scene);
    let light = |lighting: &str| floor_light(&image(work(&on_device, lighting), &down_from(3.0)));
    let reference = light("soft 1024, occlusion 1024 10m");
    let found = light("soft 16, occlusion 16 10m");
    assert!(reference.len() > 1000 && reference.len() == found.len());
    let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    let uniform = |number: usize, point: Vec3| {
        let ray = |i| {
            let place = scalar::sequence::point_of(i, scalar::sequence::hashed(number as u32));
            let up = 2.0 * place.x - 1.0;
            let turn = Vec2::from_angle(std::f32::consts::TAU * place.y);
            let flat = turn * (1.0 - up * up).sqrt();
            let direction_in_world = Vec3::new(flat.x, up, flat.y);
            let ray = Ray { origin_in_world: point + Vec3::Y * 1e-4, direction_in_world };
            let is_open = up > 0.0 && !twin.is_blocked(&ray, 1e9);
            // The density is 1/4π.
            if is_open { 4.0 * up * map.radiance_linear(direction_in_world).y } else { 0.0 }
        };
        mean((0..16).map(ray))
    };
    let rms = |errors: Vec<f32>| mean(errors.into_iter().map(|error| error * error)).sqrt();
    let own = rms(reference.iter().zip(&found).map(|((_, a), (_, b))| a - b).collect());
    let other = rms(reference.iter().enumerate().map(|(n, (point, a))| a - uniform(n, *point)).collect());
    println!("RMS error of 16 rays: {own} to the sun, {other} in uniform directions");
    assert!(own <= 0.2 * other, "{own} {other}");
}

#[test]
fn a_picture_shows_the_map_where_it_shows_no_surface() {
    let map = map(|place| (place.x % 100) as f32 / 100.0);
    let scene = floor_under(&[], lamps(vec![])).surrounded_by(map.clone());
    let on_device = upload(&scene);
    let camera = aside();
    for lighting in ["unlit", "phong", "soft 2"] {
        let depths = ViewPlanes::WITH_DEPTH;
        let lit: DrawWork<'_> = work(&on_device, lighting);
        let view = device().1.draw_views(lit, &[camera], depths).expect("a view").remove(0);
        let pixels = (0..SIZE_PX.y).flat_map(|y| (0..SIZE_PX.x).map(move |x| Vec2::new(x as f32, y as f32) + 0.5));
        let depths = view.inverse_depth_per_m.expect("depth");
        let mut open = 0;
        for ((pixel, found), depth) in pixels.zip(view.srgb8.as_chunks::<3>().0).zip(depths) {
            if depth > 0.0 {
                continue;
            }
            let radiance = map.radiance_linear(camera.ray(pixel).direction_in_world.normalize_or_zero());
            let wanted = depth_image::srgb8_from_linear(radiance.y);
            assert!(found[1].abs_diff(wanted) <= 3, "{lighting} at {pixel}: {found:?}, not {wanted}");
            open += 1;
        }
        assert!(open > 500, "{lighting}: {open}");
    }
}
