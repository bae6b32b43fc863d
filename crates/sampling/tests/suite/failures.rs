//! Instances, walls seen edge-on, and hysteresis, beside the scalar reference. Further failures are curves of
//! docs/failures.md.

use depth_image::{DepthImage, PinholeCamera};
use fixtures::{poles, quad};
use glam::{Affine3A, UVec2, Vec3};
use render::{DrawWork, GpuScene, SamplePlanes};
use sampling::{Redundancy, SampleWork, SamplingMethod, scalar};
use scene::Instance;
use scene::procedural::{GrassDensity, grass};

use crate::stage::{after, device, pinholes, reference, unlit, upload};

const SIZE_PX: UVec2 = UVec2::new(80, 60);
const PIXEL: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Pixel);
const TOLERANCE: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Tolerance);

fn sample(scene: &GpuScene, cameras: &[PinholeCamera], method: SamplingMethod) -> Vec<DepthImage> {
    let draw = unlit(scene);
    let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
    let cameras = pinholes(cameras);
    let planes = SamplePlanes { normal: true, surface_id: true, ..SamplePlanes::default() };
    let work = SampleWork { draw, cameras: &cameras, wanted: &wanted, method, planes, temporal_reference_s: None };
    device().sampler.sample(&work).expect("images")
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// Ten thousand instances of one square: the key is instance and primitive, so that none stands for another.
#[test]
fn samples_of_other_instances_are_not_redundant() {
    let mut scene = quad(Vec3::ZERO, 0.03, Vec3::new(0.2, 0.1, 1.0), [180, 90, 40]);
    let mesh = scene.instances[0].mesh;
    scene.instances = (0..10_000u32)
        .map(|i| {
            let x = (i % 100) as f32 - 49.5;
            let y = (i / 100) as f32 - 49.5;
            let depth = -0.5 * ((i * 7919) % 10) as f32;
            let at = Vec3::new(0.05 * x, 0.05 * y, depth);
            Instance { mesh, world_from_mesh: Affine3A::from_translation(at) }
        })
        .collect();
    let on_device = upload(&scene);
    let camera =
        |x: f32| PinholeCamera::looking_at(Vec3::new(x, 0.0, 4.0), Vec3::ZERO, Vec3::Y, 0.9, UVec2::splat(128));
    let cameras = [camera(-0.3), camera(0.3)];
    let rays = render::scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    let device = sample(&on_device, &cameras, PIXEL);
    let reference = scalar::sample(&rays, &cameras, PIXEL);
    let pairs = device[1].inverse_depth_per_m.iter().zip(&reference[1].inverse_depth_per_m);
    let differ = pairs.filter(|(a, b)| (*a - *b).abs() > 1e-3 * a.abs()).count();
    let instances: std::collections::HashSet<u32> =
        device.iter().flat_map(|image| image.surface_id.iter().flatten()).map(|id| id.instance).collect();
    println!("{} instances seen, {differ} texels unlike the reference", instances.len());
    assert!(instances.len() > 3000 && differ * 100 < device[1].inverse_depth_per_m.len());
}

/// A viewpoint in the plane of a wall: no layer peeled from there has a sample of it.
#[test]
fn a_wall_seen_edge_on_is_never_peeled() {
    let mut scene = quad(Vec3::new(0.0, 0.0, -4.0), 2.0, Vec3::Z, [200; 3]);
    let wall = quad(Vec3::new(0.0, 0.0, -2.0), 0.8, Vec3::X, [200, 40, 40]);
    scene.meshes.extend(wall.meshes);
    scene.instances.push(Instance { mesh: 1, world_from_mesh: Affine3A::IDENTITY });
    let on_device = upload(&scene);
    let from = |x: f32| PinholeCamera::looking_at(Vec3::new(x, 0.0, 3.0), Vec3::NEG_Z * 2.0, Vec3::Y, 0.9, SIZE_PX);
    let of_wall = |images: &[DepthImage]| -> usize {
        let of_image = |image: &DepthImage| {
            let ids = image.surface_id.as_ref().expect("ids");
            image.inverse_depth_per_m.iter().zip(ids).filter(|(d, id)| **d > 0.0 && id.instance == 1).count()
        };
        images.iter().map(of_image).sum()
    };
    let peeled = of_wall(&sample(&on_device, &[from(0.0); 4], SamplingMethod::DepthPeeling { layers: 4 }));
    let apart = of_wall(&sample(&on_device, &[from(0.0), from(0.8)], PIXEL));
    println!("samples of the wall: {peeled} in four layers, {apart} in two images");
    assert!(peeled == 0 && apart > 50, "{peeled} {apart}");
}

/// Poles before a wall, the second camera moved by parts of a pixel: texels that change between kept and omitted, with
/// what was kept before it moved and without.
#[test]
fn temporal_hysteresis_reduces_flicker() {
    let scene = poles(0.05);
    let on_device = upload(&scene);
    let rays = render::scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    let camera = |x: f32| PinholeCamera::looking_at(Vec3::new(x, 0.0, 4.0), Vec3::NEG_Z * 2.0, Vec3::Y, 0.8, SIZE_PX);
    let pixel_m = 6.0 / camera(0.0).focal_px.x;
    let still = [camera(-0.4), camera(0.4)];
    let before = scalar::sample(&rays, &still, TOLERANCE);
    let still_samples = reference(&on_device, &still);
    let settings = scalar::Settings { reference: Some(&before), ..scalar::Settings::default() };
    let mask = |image: &DepthImage| -> Vec<bool> { image.inverse_depth_per_m.iter().map(|&d| d > 0.0).collect() };
    let flips = |image: &DepthImage| {
        let pairs = mask(&before[1]).into_iter().zip(mask(image));
        share(pairs.filter(|(a, b)| a != b).count(), before[1].inverse_depth_per_m.len())
    };
    println!("jitter (px): texels that change sides, without and with hysteresis, and by the reference");
    for jitter_px in [0.05, 0.1, 0.25, 0.5] {
        let cameras = [still[0], camera(0.4 + jitter_px * pixel_m)];
        let [free, kept] = [None, Some(&still_samples)].map(|before| flips(&after(&on_device, &cameras, before)[1]));
        let twin = flips(&scalar::sample_with(&rays, &cameras, TOLERANCE, settings)[1]);
        println!("{jitter_px:5}: {free:.4} {kept:.4} {twin:.4}");
        assert!(kept <= 0.6 * free, "{jitter_px}: {kept} of {free}");
        assert!((kept - twin).abs() < 2e-3, "{jitter_px}: {kept}, {twin} by the reference");
    }
}

/// A meadow in wind: the samples of a set follow from its time and its reference time, in any order of sampling.
#[test]
fn sets_with_a_temporal_reference_do_not_depend_on_their_order() {
    let scene = upload(&grass(GrassDensity::new(0.2).expect("a density")));
    let eye = |x: f32| PinholeCamera::looking_at(Vec3::new(x, 1.2, 3.0), Vec3::ZERO, Vec3::Y, 0.7, SIZE_PX);
    let cameras = pinholes(&[eye(-0.2), eye(0.2)]);
    let at = |scene_time_s: f32, temporal_reference_s: Option<f32>| {
        let draw = DrawWork { scene_time_s, ..unlit(&scene) };
        let planes = SamplePlanes::default();
        let work =
            SampleWork { draw, cameras: &cameras, wanted: &[0, 1], method: TOLERANCE, planes, temporal_reference_s };
        device().sampler.sample(&work).expect("images")
    };
    let later = at(0.4, Some(0.0));
    assert_eq!(at(0.2, Some(0.0)).len(), 2);
    assert!(at(0.9, Some(0.5)) != at(0.9, None), "hysteresis has an effect");
    assert!(at(0.4, Some(0.0)) == later, "whatever came between");
    assert!(at(0.4, Some(0.4)) == at(0.4, None), "the first of its run is its own reference");
}
