//! Views whose surfaces come from the scene and whose light comes from samples.

use depth_image::{
    Camera, DepthImage, Environment, Illumination, Light, LightCacheQuality, PinholeCamera, ProvenanceKind, View,
    ViewPlanes,
};
use glam::{UVec2, Vec3};
use render::{DrawWork, GpuScene, SamplePlanes, Visibility};
use scene::Scene;

use crate::stage::{device, floor_under, mean, upload, work};

const VIEW_PX: UVec2 = UVec2::new(160, 120);
const LIGHT: SamplePlanes = SamplePlanes {
    antialias: depth_image::Antialias::NONE,
    normal: false,
    surface_id: false,
    specular: false,
    corners: false,
    light: true,
};
const LIGHTING: &str = "soft 16, occlusion 16 1m";

/// A floor under a lamp, half of it under a smaller quad.
fn shadowed_floor() -> Scene {
    let lamp = Light::Point { position_in_world: Vec3::new(0.3, 2.0, 0.2), intensity_linear: Vec3::splat(2.0), radius_m: 0.1 };
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
            let (error, unknown) = (difference(&view, &traced), share_of(&view, ProvenanceKind::LitHere));
            println!("{visibility} {quality}: {error} {unknown}, hits {}", share_of(&view, ProvenanceKind::Hit));
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

#[allow(dead_code)]
fn unused(_: &GpuScene) {}
