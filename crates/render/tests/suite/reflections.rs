//! Mirror images of the scene against closed forms and the scalar reference.

use depth_image::{
    Camera, Environment, EnvironmentMap, Illumination, Light, PinholeCamera, PixelDepth, Ray, Reflector, View,
    ViewPlanes, environment_reflectance_linear, linear_from_srgb8,
};
use fixtures::{mirror_pair, quad, teapot_mirror, unit_cube, uv_sphere};
use glam::{Affine3A, UVec2, Vec2, Vec3};
use render::scalar::reflections::Bounce;
use render::{DrawWork, GpuScene, Visibility, scalar};
use scene::{Instance, Material, Scene};

use crate::stage::{SIZE_PX, device, lamps, upload, work};

/// Codes of 8-bit sRGB that two roundings and the tables of a device make.
pub const ROUNDING: i32 = 3;

pub fn mirror(reflectance: f32) -> Material {
    let base_color_linear = [reflectance, reflectance, reflectance, 1.0];
    Material { name: "mirror".into(), base_color_linear, metallic: 1.0, roughness: 0.0, ..Material::default() }
}

/// A scene of several, in the dark.
pub fn of_parts(parts: Vec<(Scene, Material, Affine3A)>) -> Scene {
    let mut whole = Scene { name: "parts".into(), ..Scene::default() };
    for (number, (mut part, material, world_from_mesh)) in (0..).zip(parts) {
        let mut mesh = part.meshes.remove(0);
        mesh.parts.iter_mut().for_each(|part| part.material = number);
        whole.meshes.push(mesh);
        whole.instances.push(Instance { mesh: number, world_from_mesh });
        whole.materials.push(material);
    }
    whole.illumination = dark();
    whole
}

pub fn dark() -> Illumination {
    Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::ZERO) }
}

pub fn glowing() -> Material {
    Material { name: "as it is".into(), unlit: true, ..Material::default() }
}

fn at(x: f32, y: f32, z: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(x, y, z))
}

pub fn floor_mirror(reflectance: f32) -> (Scene, Material, Affine3A) {
    (quad(Vec3::ZERO, 3.0, Vec3::Y, [255; 3]), mirror(reflectance), Affine3A::IDENTITY)
}

pub fn view_of(scene: &GpuScene, lighting: &str, camera: &PinholeCamera) -> View {
    let work = DrawWork { visibility: Visibility::Rays, ..work(scene, lighting) };
    device().1.draw_views(work, &[*camera], ViewPlanes::WITH_DEPTH).expect("a view").remove(0)
}

pub fn linear_at(view: &View, pixel: UVec2) -> Vec3 {
    let first = 3 * (pixel.y * view.size_px.x + pixel.x) as usize;
    Vec3::from_slice(&[0, 1, 2].map(|channel| linear_from_srgb8(view.srgb8[first + channel])))
}

pub fn pixels(size_px: UVec2) -> impl Iterator<Item = UVec2> {
    (0..size_px.y).flat_map(move |y| (0..size_px.x).map(move |x| UVec2::new(x, y)))
}

pub fn code_of(linear: Vec3) -> Vec3 {
    linear.map(|c| if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.min(1.0).powf(1.0 / 2.4) - 0.055 } * 255.0)
}

/// The middle of what is brighter than half of the brightest, in a part of a picture's rows.
fn middle_of_bright(view: &View, rows: std::ops::Range<u32>) -> Option<(Vec2, f32)> {
    let within = || pixels(view.size_px).filter(|pixel| rows.contains(&pixel.y));
    let brightest = within().map(|pixel| linear_at(view, pixel).y).fold(0.0, f32::max);
    let bright: Vec<Vec2> = within()
        .filter(|&pixel| linear_at(view, pixel).y > 0.5 * brightest)
        .map(|pixel| pixel.as_vec2() + 0.5)
        .collect();
    (brightest > 0.002).then(|| (bright.iter().sum::<Vec2>() / bright.len() as f32, brightest))
}

#[test]
fn a_plane_mirror_shows_the_view_from_behind_it() {
    let things = || {
        let far_cube = Affine3A::from_scale_rotation_translation(
            Vec3::new(0.7, 1.4, 0.7),
            glam::Quat::from_rotation_y(0.6),
            Vec3::new(0.9, 1.0, -1.2),
        );
        [(unit_cube(), Material::default(), at(-0.8, 0.6, 0.2)), (unit_cube(), Material::default(), far_cube)]
    };
    let sun = Light::Directional {
        towards_light_in_world: Vec3::new(0.4, 1.0, 0.8).normalize_or(Vec3::Y),
        irradiance_linear: Vec3::splat(0.9),
        angular_radius_rad: 0.0,
    };
    let mut mirrored = of_parts([floor_mirror(0.9)].into_iter().chain(things()).collect());
    mirrored.illumination = lamps(vec![sun]);
    // Where the mirror was nothing is seen from below, and its shadow is not missed.
    let mut behind = of_parts(things().into());
    behind.illumination = mirrored.illumination.clone();
    let eye = Vec3::new(0.3, 1.6, 3.4);
    let target = Vec3::new(0.1, -0.6, 0.0);
    let looking = |flip: f32| {
        let on = |v: Vec3| Vec3::new(v.x, v.y * flip, v.z);
        PinholeCamera::looking_at(on(eye), on(target), Vec3::Y * flip, 0.9, UVec2::new(160, 120))
    };
    let camera = looking(1.0);
    let other = looking(-1.0);
    let mirrored = upload(&mirrored);
    let behind = upload(&behind);
    let twin = scalar::rays::Scene::of(&mirrored, 0.0).expect("a tree");
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        let draw = |scene, camera: &PinholeCamera| {
            let work = DrawWork { visibility, ..work(scene, "shadows, reflections 1") };
            device().1.draw_views(work, &[*camera], ViewPlanes::WITH_DEPTH).expect("a view").remove(0)
        };
        let seen = draw(&mirrored, &camera);
        let expected = draw(&behind, &other);
        let mut compared = 0;
        let mut differ = 0;
        for pixel in pixels(camera.size_px) {
            let ray = scalar::rays::pixel_ray(&camera, pixel);
            let Some(hit) = twin.closest(&ray, camera.near_m) else { continue };
            let Some(reflector) = twin.look(&hit).reflector.filter(|r| r.mirror_share() > 0.0) else { continue };
            let towards_eye = -ray.direction_in_world.normalize_or_zero();
            let share = environment_reflectance_linear(Vec3::Y, towards_eye, &reflector);
            // What is mirrored is seen from behind the other way round.
            let from_behind = UVec2::new(camera.size_px.x - 1 - pixel.x, pixel.y);
            let place = (from_behind.y * camera.size_px.x + from_behind.x) as usize;
            let is_met = expected.inverse_depth_per_m.as_ref().expect("depth")[place] > 0.0;
            let want = code_of(linear_at(&expected, from_behind) * share);
            if is_met {
                compared += 1;
                let got = code_of(linear_at(&seen, pixel));
                differ += i32::from((got - want).abs().max_element() > ROUNDING as f32);
            }
        }
        assert!(compared > 1000, "{compared}");
        // Edges of surfaces and of shadows may fall on either side of a pixel's middle.
        assert!(differ * 50 < compared, "{visibility}: {differ} of {compared}");
    }
}

/// A glowing ball in the middle of two mirrors at x = ±2, and a camera beside it.
fn between_two_mirrors() -> (GpuScene, PinholeCamera) {
    let wall = |x: f32| {
        let normal = Vec3::X * -x.signum();
        (quad(Vec3::new(x, 0.0, 0.0), 3.0, normal, [255; 3]), mirror(0.9), Affine3A::IDENTITY)
    };
    let scene = of_parts(vec![wall(2.0), wall(-2.0), (uv_sphere(0.05, 64), glowing(), at(0.0, 0.5, 0.0))]);
    let eye = Vec3::new(-1.0, 0.9, 0.0);
    let camera = PinholeCamera::looking_at(eye, eye + Vec3::new(1.0, -0.06, 0.0), Vec3::Y, 0.2, UVec2::new(192, 256));
    (upload(&scene), camera)
}

#[test]
fn two_facing_mirrors_repeat_a_ball_at_twice_their_distance() {
    let (scene, camera) = between_two_mirrors();
    let reflector = Reflector { reflectance_linear: Vec3::splat(0.9), roughness: 0.0 };
    for orders in [1, 2, 4] {
        let view = view_of(&scene, &format!("shadows, reflections {orders}"), &camera);
        for order in 1..=5u32 {
            // The room repeats every 4 m; every other image is the mirror's other side.
            let image = Vec3::new(4.0 * order as f32, 0.5, 0.0);
            let PixelDepth { pixel, .. } = Camera::Pinhole(camera).project(image).expect("before the camera");
            let half = 0.035 * camera.focal_px.y / (1.0 + 4.0 * order as f32);
            let rows = (pixel.y - half) as u32..(pixel.y + half).ceil() as u32;
            let found = middle_of_bright(&view, rows);
            if order > orders {
                assert_eq!(found, None, "image {order} of {orders}");
                continue;
            }
            let (middle, brightness) = found.unwrap_or_else(|| panic!("image {order} of {orders}"));
            assert!(middle.distance(pixel) < 0.6, "image {order} of {orders}: {middle} is not {pixel}");
            let towards_eye = (camera.eye_in_world - image).normalize_or_zero();
            let share = environment_reflectance_linear(Vec3::NEG_X, towards_eye, &reflector).y.powi(order as i32);
            assert!((brightness / share - 1.0).abs() < 0.04, "image {order} of {orders}: {brightness}, not {share}");
        }
    }
}

/// Where a ball of radius 1 at the origin mirrors a point to an eye: Alhazen's problem, by bisection on the arc between.
fn alhazen(point: Vec3, eye: Vec3) -> Vec3 {
    let from = point.normalize_or_zero();
    let to = eye.normalize_or_zero();
    let arc = |share: f32| (from * (1.0 - share) + to * share).normalize_or_zero();
    let mut low = 0.0;
    let mut high = 1.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let normal = arc(middle);
        let [a, b] = [point, eye].map(|other| (other - normal).normalize_or_zero().dot(normal));
        if a > b { low = middle } else { high = middle }
    }
    arc(low)
}

#[test]
fn a_ball_mirrors_a_point_where_alhazen_says() {
    let camera = PinholeCamera::looking_at(Vec3::new(0.5, 1.2, 5.0), Vec3::ZERO, Vec3::Y, 0.5, UVec2::splat(256));
    for point in [Vec3::new(3.0, 2.0, 3.0), Vec3::new(-4.0, 0.5, 2.0), Vec3::new(0.5, 4.0, -0.5)] {
        let ball = (uv_sphere(1.0, 192), mirror(1.0), Affine3A::IDENTITY);
        let scene = of_parts(vec![ball, (uv_sphere(0.15, 48), glowing(), Affine3A::from_translation(point))]);
        let view = view_of(&upload(&scene), "shadows, reflections 1", &camera);
        let expected = Camera::Pinhole(camera).project(alhazen(point, camera.eye_in_world)).expect("a pixel").pixel;
        let (middle, _) = middle_of_bright(&view, 0..256).expect("a mirror image");
        assert!(middle.distance(expected) < 1.0, "{point}: {middle} is not {expected}");
    }
}

pub fn between_the_pair() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(-1.7, 1.7, 0.9), Vec3::new(2.0, 1.1, 0.4), Vec3::Y, 0.9, SIZE_PX)
}

fn before_the_teapot() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(7.0, 5.0, 6.0), Vec3::new(0.0, 2.4, -2.0), Vec3::Y, 0.9, SIZE_PX)
}

#[test]
fn mirrored_pixels_show_what_their_twins_meet() {
    let mut scene = mirror_pair();
    // Matt surfaces are shown as they are, so that their light needs no twin.
    scene.materials[0].unlit = true;
    scene.illumination = dark();
    let camera = between_the_pair();
    let on_device = upload(&scene);
    let mut twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    twin.footprint = camera.focal_px.min_element().recip();
    for mirrors in [1, 3, 8] {
        let view = view_of(&on_device, &format!("shadows, reflections {mirrors}"), &camera);
        let expected = |pixel: UVec2| {
            let ray: Ray = scalar::rays::pixel_ray(&camera, pixel);
            let hit = twin.closest(&ray, camera.near_m)?;
            let bounces = twin.bounces(&ray, hit, mirrors);
            let last = bounces.last()?;
            let end = last.hit.map(|hit| twin.look(&hit)).filter(|look| look.reflector.is_none());
            Some(end.map_or(Vec3::ZERO, |look| look.base_linear * last.throughput_linear))
        };
        let mirrored: Vec<(UVec2, Vec3)> =
            pixels(SIZE_PX).filter_map(|pixel| Some((pixel, expected(pixel)?))).collect();
        let same = mirrored.iter().filter(|(pixel, want)| {
            (code_of(linear_at(&view, *pixel)) - code_of(*want)).abs().max_element() <= ROUNDING as f32
        });
        let same = same.count();
        assert!(mirrored.len() > 1500, "{}", mirrored.len());
        assert!(same * 200 >= mirrored.len() * 199, "{mirrors}: {same} of {}", mirrored.len());
    }
}

#[test]
fn a_mirror_under_an_empty_sky_is_what_it_is_without_rays() {
    let mut scene = of_parts(vec![(uv_sphere(1.0, 64), mirror(0.8), Affine3A::IDENTITY)]);
    let zenith_linear = Vec3::new(0.3, 0.5, 0.9);
    let nadir_linear = Vec3::new(0.2, 0.1, 0.05);
    scene.illumination.environment = Environment { zenith_linear, nadir_linear, ..Environment::default() };
    for roughness in [0.0, 0.1, 0.15, 0.3] {
        scene.materials[0].roughness = roughness;
        let on_device = upload(&scene);
        let camera = PinholeCamera::looking_at(Vec3::new(0.5, 1.2, 4.0), Vec3::ZERO, Vec3::Y, 0.6, SIZE_PX);
        let [without, with] =
            ["shadows", "shadows, reflections 3"].map(|lighting| view_of(&on_device, lighting, &camera));
        let greatest = without.srgb8.iter().zip(&with.srgb8).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(greatest <= Some(1), "{roughness}: {greatest:?}");
    }
}

#[test]
fn a_mirror_under_an_empty_map_is_what_it_is_without_rays() {
    let mut scene = of_parts(vec![(uv_sphere(1.0, 64), mirror(0.8), Affine3A::IDENTITY)]);
    let texels: Vec<Vec3> =
        (0..32 * 16).map(|i| Vec3::new((i % 32) as f32 / 32.0, 0.3, (i / 32) as f32 / 16.0)).collect();
    let map = EnvironmentMap::new(UVec2::new(32, 16), &texels).expect("a map");
    scene.environment_map = Some(map);
    scene.illumination.environment = Environment { is_mapped: true, ..Environment::default() };
    let on_device = upload(&scene);
    let camera = PinholeCamera::looking_at(Vec3::new(0.5, 1.2, 4.0), Vec3::ZERO, Vec3::Y, 0.6, SIZE_PX);
    let [without, with] = ["shadows", "shadows, reflections 2"].map(|lighting| view_of(&on_device, lighting, &camera));
    let greatest = without.srgb8.iter().zip(&with.srgb8).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(greatest <= Some(1), "{greatest:?}");
    assert!(with.srgb8.iter().any(|&c| c > 60));
}

#[test]
fn a_rough_mirror_mixes_what_its_ray_brings_with_the_environment() {
    let glow = 0.5;
    let sky = 0.1;
    let ceiling = quad(Vec3::Y * 2.0, 400.0, Vec3::NEG_Y, [255; 3]);
    let bright = Material { base_color_linear: [glow, glow, glow, 1.0], ..glowing() };
    let mut scene = of_parts(vec![floor_mirror(0.9), (ceiling, bright, Affine3A::IDENTITY)]);
    scene.illumination.environment = Environment::uniform(Vec3::splat(sky));
    let camera = PinholeCamera::looking_at(Vec3::new(0.0, 1.0, 2.0), Vec3::ZERO, Vec3::Y, 0.4, UVec2::splat(16));
    for (roughness, share) in
        [(0.0, 1.0), (0.1, 1.0), (0.125, 0.75), (0.15, 0.5), (0.175, 0.25), (0.2, 0.0), (0.5, 0.0)]
    {
        scene.materials[0].roughness = roughness;
        let view = view_of(&upload(&scene), "shadows, reflections 1", &camera);
        let reflector = Reflector { reflectance_linear: Vec3::splat(0.9), roughness };
        assert!((reflector.mirror_share() - share).abs() < 1e-3, "{roughness}");
        let pixel = UVec2::splat(8);
        let towards_eye = -scalar::rays::pixel_ray(&camera, pixel).direction_in_world.normalize_or_zero();
        let brdf = environment_reflectance_linear(Vec3::Y, towards_eye, &reflector);
        let expected = code_of(brdf * (share * glow + (1.0 - share) * sky));
        let got = code_of(linear_at(&view, pixel));
        assert!((got - expected).abs().max_element() < 4.0, "{roughness}: {got}, not {expected}");
    }
}

#[test]
fn only_pixels_with_mirrors_change() {
    let scene = mirror_pair();
    let camera = between_the_pair();
    let on_device = upload(&scene);
    let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    let [without, with] = ["soft 2, occlusion 2", "soft 2, occlusion 2, reflections 2"]
        .map(|lighting| view_of(&on_device, lighting, &camera));
    let mut changed = 0;
    for pixel in pixels(SIZE_PX) {
        let differs = linear_at(&without, pixel) != linear_at(&with, pixel);
        let hit = twin.closest(&scalar::rays::pixel_ray(&camera, pixel), camera.near_m);
        let is_mirror = hit.is_some_and(|hit| twin.look(&hit).reflector.is_some());
        assert!(is_mirror || !differs, "{pixel}");
        changed += u32::from(differs);
    }
    assert!(changed > 1500, "{changed}");
}

/// In a room of light all around, a pixel's footprint on it is the area between the ends of its neighbours' rays.
#[test]
fn the_footprint_behind_a_ball_is_what_neighbouring_rays_span() {
    let mut around = uv_sphere(40.0, 96);
    around.materials[0].double_sided = true;
    let room = (around, Material { double_sided: true, ..glowing() }, Affine3A::IDENTITY);
    let scene = of_parts(vec![(uv_sphere(1.0, 256), mirror(1.0), Affine3A::IDENTITY), room]);
    let camera = PinholeCamera::looking_at(Vec3::new(0.0, 0.5, 6.0), Vec3::ZERO, Vec3::Y, 0.5, UVec2::splat(128));
    let mut twin = scalar::rays::Scene::of(&upload(&scene), 0.0).expect("a tree");
    twin.footprint = camera.focal_px.min_element().recip();
    let bounce = |pixel: UVec2| {
        let ray = scalar::rays::pixel_ray(&camera, pixel);
        let hit = twin.closest(&ray, camera.near_m)?;
        twin.bounces(&ray, hit, 1).first().copied()
    };
    let end = |bounce: &Bounce| bounce.ray.at(bounce.hit.map_or(0.0, |hit| hit.t));
    let mut ratios = Vec::new();
    for pixel in pixels(camera.size_px - 2).filter(|pixel| pixel.x % 7 == 0 && pixel.y % 7 == 0) {
        // Over three pixels: normals between a triangle's corners have steps.
        let beside = [UVec2::ZERO, UVec2::X * 2, UVec2::Y * 2].map(|aside| bounce(pixel + aside));
        let [Some(here), Some(right), Some(below)] = beside else { continue };
        let [across, down] = [&right, &below].map(|other| (end(other) - end(&here)) / 2.0);
        let spanned_m2 = across.cross(down).dot(here.ray.direction_in_world).abs();
        ratios.push(here.side_m / spanned_m2.sqrt());
    }
    ratios.sort_by(f32::total_cmp);
    let of = |share: f32| ratios[(ratios.len() as f32 * share) as usize];
    assert!(ratios.len() > 40, "{}", ratios.len());
    assert!((of(0.5) - 1.0).abs() < 0.1, "{}", of(0.5));
    assert!(of(0.1) > 0.75 && of(0.9) < 1.35, "{} {}", of(0.1), of(0.9));
}

#[test]
fn tiles_and_repeats_of_mirrored_pictures_are_the_picture() {
    let on_device = upload(&teapot_mirror());
    let lighting = "soft 3, occlusion 3, reflections 3";
    let camera = before_the_teapot();
    let whole = view_of(&on_device, lighting, &camera);
    assert!(view_of(&on_device, lighting, &camera) == whole);
    let first_row = 24;
    let part = PinholeCamera {
        size_px: UVec2::new(SIZE_PX.x, 16),
        principal_px: camera.principal_px - Vec2::new(0.0, first_row as f32),
        ..camera
    };
    let tile = view_of(&on_device, lighting, &part);
    let row = 3 * SIZE_PX.x as usize;
    let same = tile.srgb8.iter().zip(&whole.srgb8[first_row * row..]).filter(|(a, b)| a == b).count();
    // A tile's rays are those of the picture but for the last bit.
    assert!(same * 50 > tile.srgb8.len() * 49, "{same} of {}", tile.srgb8.len());
}

#[test]
fn mirror_after_mirror_adds_less() {
    let on_device = upload(&mirror_pair());
    let camera = between_the_pair();
    let views: Vec<View> = (1..=8)
        .map(|mirrors| view_of(&on_device, &format!("soft 2, occlusion 2, reflections {mirrors}"), &camera))
        .collect();
    let added = |pair: &[View]| {
        let changes =
            pixels(SIZE_PX).map(|pixel| (linear_at(&pair[0], pixel) - linear_at(&pair[1], pixel)).abs().element_sum());
        changes.sum::<f32>()
    };
    let added: Vec<f32> = views.windows(2).map(added).collect();
    assert!(added[0] > 10.0, "{added:?}");
    // Each passes by one more mirror that reflects 0.8, and by fewer pixels.
    assert!(added.windows(2).all(|pair| pair[1] < 0.9 * pair[0]), "{added:?}");
}
