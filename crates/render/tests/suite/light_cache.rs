//! Views whose surfaces come from the scene and whose light comes from samples.

use depth_image::{
    Aabb, Antialias, Camera, DepthImage, Environment, Illumination, Light, LightCacheQuality, PinholeCamera,
    Provenance, ProvenanceKind, SinglePoleCamera, View, ViewPlanes, linear_from_srgb8, rgb9e5_from_linear,
    srgb8_from_linear,
};
use fixtures::uv_sphere;
use glam::{Affine3A, UVec2, Vec3};
use render::scalar::light_cache::{LightSamples, SurfacePoint};
use render::scalar::rays;
use render::{DrawWork, SamplePlanes, Visibility};
use scene::{Instance, Scene};

use crate::stage::{LIGHT, device, floor_under, mean, upload, work};

const VIEW_PX: UVec2 = UVec2::new(160, 120);
const LIGHTING: &str = "soft 16, occlusion 16 1m";

/// A floor under a lamp, half of it under a smaller quad.
fn shadowed_floor() -> Scene {
    let lamp =
        Light::Point { position_in_world: Vec3::new(0.3, 2.0, 0.2), intensity_linear: Vec3::splat(2.0), radius_m: 0.1 };
    let environment = Environment::uniform(Vec3::splat(0.3));
    floor_under(&[(Vec3::new(-0.2, 0.4, 0.0), 0.3, Vec3::Y)], Illumination { lights: vec![lamp], environment })
}

fn camera(eye: Vec3, size_px: UVec2) -> PinholeCamera {
    PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, size_px)
}

fn view_camera() -> PinholeCamera {
    camera(Vec3::new(0.3, 1.6, 2.2), VIEW_PX)
}

fn sample_cameras() -> [Camera; 2] {
    [Vec3::new(-0.4, 1.8, 2.0), Vec3::new(0.9, 1.7, 2.1)].map(|eye| camera(eye, VIEW_PX).into())
}

fn samples(work: DrawWork<'_>) -> Vec<DepthImage> {
    device().1.draw_depth_images(work, &sample_cameras(), LIGHT).expect("samples")
}

fn cached(work: DrawWork<'_>, images: &[DepthImage], quality: LightCacheQuality, planes: ViewPlanes) -> View {
    let renderer = &device().1;
    let cache = renderer.upload_light(work.scene, work.lighting, images, work.turn).expect("a cache");
    renderer.draw_cached_views(work, &cache, quality, &[view_camera()], planes).expect("a view").remove(0)
}

fn direct(work: DrawWork<'_>) -> View {
    device().1.draw_views(work, &[view_camera()], ViewPlanes::ALL).expect("a view").remove(0)
}

/// Root mean square of 8-bit differences.
fn difference(a: &View, b: &View) -> f32 {
    let squares = a.srgb8.iter().zip(&b.srgb8).map(|(&a, &b)| (f32::from(a) - f32::from(b)).powi(2));
    mean(squares).sqrt()
}

fn share_of(view: &View, kind: ProvenanceKind) -> f32 {
    let provenance = view.provenance.as_ref().expect("provenance");
    mean(provenance.iter().map(|origin| f32::from(u8::from(origin.kind() == kind))))
}

#[test]
fn most_light_of_a_floor_is_known_and_as_if_it_were_traced() {
    let scene = upload(&shadowed_floor());
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        let work = DrawWork { visibility, ..work(&scene, LIGHTING) };
        let images = samples(work);
        let traced = direct(DrawWork { lighting: "soft 64, occlusion 64 1m".parse().expect("a lighting"), ..work });
        let mut last = f32::INFINITY;
        for quality in [LightCacheQuality::Fast, LightCacheQuality::Balanced, LightCacheQuality::Fine] {
            let view = cached(work, &images, quality, ViewPlanes::ALL);
            let error = difference(&view, &traced);
            let unknown = share_of(&view, ProvenanceKind::LitHere);
            assert_eq!(view.inverse_depth_per_m, traced.inverse_depth_per_m, "{quality}");
            assert!(error < 4.0 && error <= 1.1 * last, "{visibility} {quality}: {error}, before {last}");
            assert!(unknown < 0.35, "{quality}: {unknown}");
            last = error;
        }
    }
}

#[test]
fn exact_views_and_views_in_plain_light_are_direct_views() {
    let scene = upload(&shadowed_floor());
    let same = |lighting: &str, quality| {
        let work = work(&scene, lighting);
        let view = cached(work, &samples(work), quality, ViewPlanes::ALL);
        assert_eq!(view.srgb8, direct(work).srgb8, "{lighting}, {quality}");
        assert_eq!(share_of(&view, ProvenanceKind::Hit), 0.0);
    };
    same(LIGHTING, LightCacheQuality::Exact);
    same("unlit", LightCacheQuality::Draft);
}

/// A floor with a sphere on it, whose normals of shading are not those of its triangles.
fn sphere_on_a_floor(lights: Vec<Light>) -> Scene {
    let environment = Environment::gradient(Vec3::splat(0.5), Vec3::splat(0.1));
    let mut scene = floor_under(&[], Illumination { lights, environment });
    let mesh = scene.meshes.len() as u32;
    scene.meshes.push(uv_sphere(0.3, 24).meshes.remove(0));
    let world_from_mesh = Affine3A::from_translation(Vec3::new(0.1, 0.3, 0.0));
    scene.instances.push(Instance { mesh, world_from_mesh });
    scene
}

fn lamp(x: f32, strength: f32) -> Light {
    let position_in_world = Vec3::new(x, 2.0, 0.7);
    let intensity_linear = Vec3::splat(strength);
    Light::Point { position_in_world, intensity_linear, radius_m: 0.1 }
}

/// The surface that a pixel shows, and its colour.
fn surface(scene: &rays::Scene, camera: &PinholeCamera, pixel: UVec2) -> Option<(SurfacePoint, Vec3)> {
    let ray = rays::pixel_ray(camera, pixel);
    let hit = scene.closest(&ray, camera.near_m)?;
    let [a, b, c] = scene.triangles_in_world().nth(hit.slot as usize).expect("a triangle");
    let across = (b - a).cross(c - a).normalize_or_zero();
    let point = SurfacePoint {
        point_in_world: ray.at(hit.t),
        normal_in_world: scene.normal_in_world(&hit),
        triangle_normal_in_world: if across.dot(ray.direction_in_world) > 0.0 { -across } else { across },
        footprint_m: hit.t / camera.focal_px.min_element(),
    };
    Some((point, scene.look(&hit).base_linear))
}

/// The share of pixels whose colour and provenance the scalar twin gives within 1 of 255. Points that samples do not know
/// have the light of direct drawing; under indirect light that of lamps alone, where any texel counts.
fn share_like_the_twin(scene: &Scene, lighting: &str, quality: LightCacheQuality) -> f32 {
    let gpu_scene = upload(scene);
    let work = DrawWork { visibility: Visibility::Rays, ..work(&gpu_scene, lighting) };
    let is_indirect = work.lighting.is_indirect();
    let images = samples(work);
    let view = cached(work, &images, quality, ViewPlanes::ALL);
    let traced = direct(work);
    let lamps = is_indirect.then(|| direct(DrawWork { lighting: "soft 16".parse().expect("lighting"), ..work }));
    let twin = rays::Scene::of(&gpu_scene, 0.0).expect("tables");
    let camera = view_camera();
    let smooth: Vec<DepthImage> = images.iter().map(render::scalar::smoothed).collect();
    let images = if is_indirect { &smooth } else { &images };
    let light = LightSamples { images, illumination: &scene.illumination };
    let provenance = view.provenance.as_ref().expect("provenance");
    let color = |view: &View, place: usize| <[u8; 3]>::try_from(&view.srgb8[3 * place..][..3]).expect("a pixel");
    let lit_here = Provenance::new(ProvenanceKind::LitHere, 0);
    let mut like = 0;
    let mut known = 0;
    for (place, &shown) in provenance.iter().enumerate() {
        let pixel = UVec2::new(place as u32 % VIEW_PX.x, place as u32 / VIEW_PX.x);
        let surface = surface(&twin, &camera, pixel);
        let found = surface.and_then(|(point, base)| Some((light.look_up(&point, quality)?, base)));
        let (expected, origin) = match (found, &lamps) {
            (Some((light, base_linear)), _) if light.is_known => {
                known += 1;
                let linear = base_linear * (light.lamps_linear + light.environment_linear);
                (srgb8(linear), Provenance::new(ProvenanceKind::Hit, light.camera_mask))
            }
            (Some((light, base_linear)), Some(lamps)) => {
                let of_lamps = Vec3::from_array(color(lamps, place).map(linear_from_srgb8));
                (srgb8(of_lamps + base_linear * light.environment_linear), lit_here)
            }
            _ => (color(&traced, place), if surface.is_some() { lit_here } else { Provenance::EMPTY }),
        };
        let is_near = color(&view, place).iter().zip(expected).all(|(&a, b)| a.abs_diff(b) <= 1);
        like += usize::from(is_near && shown == origin);
    }
    assert!(known > 2000, "{known} known pixels");
    like as f32 / provenance.len() as f32
}

fn srgb8(linear: Vec3) -> [u8; 3] {
    linear.to_array().map(srgb8_from_linear)
}

#[test]
fn views_are_those_of_the_scalar_twin() {
    let few = sphere_on_a_floor(vec![lamp(0.3, 1.0), lamp(-0.6, 0.5)]);
    let many = sphere_on_a_floor((0..20).map(|number| lamp(0.1 * number as f32 - 1.0, 0.1)).collect());
    for quality in [LightCacheQuality::Draft, LightCacheQuality::Balanced, LightCacheQuality::Fine] {
        let share = share_like_the_twin(&few, LIGHTING, quality);
        assert!(share >= 0.999, "{quality}: {share}");
    }
    let share = share_like_the_twin(&many, LIGHTING, LightCacheQuality::Balanced);
    assert!(share >= 0.999, "20 lamps: {share}");
    // What surfaces send back is all that there is of the second word of light.
    let mut enclosed = few;
    enclosed.illumination.environment = Environment::default();
    let share = share_like_the_twin(&enclosed, "soft 16, indirect 16", LightCacheQuality::Balanced);
    assert!(share >= 0.999, "indirect light: {share}");
}

#[test]
fn samples_that_are_not_of_this_light_are_refused_by_name() {
    let renderer = &device().1;
    let scene = upload(&shadowed_floor());
    let work = work(&scene, LIGHTING);
    let refused = |images: &[DepthImage]| {
        let error = renderer.upload_light(&scene, work.lighting, images, work.turn).err();
        error.expect("refused").to_string()
    };
    let good = samples(work);
    let with = |change: fn(&mut DepthImage)| {
        let mut images = good.clone();
        change(&mut images[1]);
        refused(&images)
    };
    let colored = renderer.draw_depth_images(work, &sample_cameras(), SamplePlanes::default()).expect("images");
    assert_eq!(refused(&colored), "sample image 0: colour where light is needed");
    assert!(refused(&[]).contains("1 to 16 images") && refused(&vec![good[0].clone(); 17]).contains("1 to 16 images"));
    let unshared = with(|image| image.light.as_mut().expect("light").share8.clear());
    assert_eq!(unshared, "sample image 1: 0 planes of shares of light, the scene's lamps and lighting need 1");
    assert!(with(|image| image.normal_oct16 = None).contains("normal"));
    let single_pole =
        SinglePoleCamera::around(&Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE }, Vec3::Z * 3.0, 8.0, VIEW_PX);
    let bent = renderer.draw_depth_images(work, &[Camera::SinglePole(single_pole)], LIGHT).expect("an image");
    assert!(refused(&bent).contains("must be a pinhole"), "{}", refused(&bent));
}

#[test]
fn light_that_is_no_number_or_without_bound_makes_no_nan() {
    let scene = upload(&shadowed_floor());
    let work = work(&scene, LIGHTING);
    let mut images = samples(work);
    let light = images[0].light.as_mut().expect("light");
    light.lamps_rgb9e5.fill(rgb9e5_from_linear(Vec3::INFINITY));
    light.environment_rgb9e5.fill(rgb9e5_from_linear(Vec3::NAN));
    let view = cached(work, &images, LightCacheQuality::Draft, ViewPlanes::ALL);
    let known = view.provenance.as_ref().expect("provenance").iter().position(|origin| origin.camera_mask() != 0);
    let place = 3 * known.expect("a known pixel");
    assert!(view.srgb8[place..place + 3].iter().all(|&channel| channel > 0), "bright, not black");
}

#[test]
fn one_camera_is_enough_for_a_set() {
    let scene = upload(&shadowed_floor());
    let work = work(&scene, LIGHTING);
    let images = &samples(work)[..1];
    let view = cached(work, images, LightCacheQuality::Balanced, ViewPlanes::ALL);
    let traced = direct(DrawWork { lighting: "soft 64, occlusion 64 1m".parse().expect("a lighting"), ..work });
    assert!(difference(&view, &traced) < 4.0);
}

#[test]
fn all_lamps_of_a_scene_count() {
    let scene = upload(&sphere_on_a_floor((0..255).map(|number| lamp(0.01 * number as f32 - 1.2, 0.008)).collect()));
    let work = work(&scene, "soft 1, occlusion 16 1m");
    let view = cached(work, &samples(work), LightCacheQuality::Balanced, ViewPlanes::ALL);
    assert!(share_of(&view, ProvenanceKind::LitHere) < 0.2);
    let error = difference(&view, &direct(work));
    assert!(error < 4.0, "{error}");
}

#[test]
fn positions_within_a_pixel_share_light_and_provenance_is_that_of_the_centre() {
    let scene = upload(&sphere_on_a_floor(vec![lamp(0.3, 1.0)]));
    let work = work(&scene, LIGHTING);
    let images = samples(work);
    let four = ViewPlanes { antialias: Antialias::of(4).expect("offered"), ..ViewPlanes::ALL };
    let view = cached(work, &images, LightCacheQuality::Balanced, four);
    let many = DrawWork { lighting: "soft 64, occlusion 64 1m".parse().expect("a lighting"), ..work };
    let traced = device().1.draw_views(many, &[view_camera()], four).expect("a view").remove(0);
    let error = difference(&view, &traced);
    assert!(error < 2.5, "{error}");
    let center = cached(work, &images, LightCacheQuality::Balanced, ViewPlanes::ALL);
    assert_eq!(view.inverse_depth_per_m, center.inverse_depth_per_m);
    let [of_positions, of_center] = [&view, &center].map(|view| view.provenance.as_ref().expect("provenance"));
    let same = of_positions.iter().zip(of_center).filter(|(a, b)| a.kind() == b.kind()).count();
    assert!(same * 50 > 48 * of_center.len(), "{same} of {}", of_center.len());
}
