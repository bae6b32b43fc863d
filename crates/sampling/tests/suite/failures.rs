//! Where sampling without redundance goes wrong, or must not: as curves, which docs/methods/non_redundant.md repeats.

use depth_image::{DepthImage, PinholeCamera};
use glam::{Affine3A, UVec2, Vec3};
use render::{DrawWork, GpuScene, SamplePlanes};
use sampling::{Redundancy, SampleWork, SamplingMethod, scalar};
use scene::Instance;
use scene::procedural::{GrassDensity, courtyard, grass, poles, quad};

use crate::stage::{after, device, pinholes, reference, unlit, upload};

const SIZE_PX: UVec2 = UVec2::new(80, 60);
const PIXEL: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Pixel);
const VISIBILITY: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Visibility);
const TOLERANCE: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Tolerance);

fn sample(scene: &GpuScene, cameras: &[PinholeCamera], method: SamplingMethod) -> Vec<DepthImage> {
    let draw = unlit(scene);
    let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
    let cameras = pinholes(cameras);
    let planes = SamplePlanes { normal: true, surface_id: true, ..SamplePlanes::default() };
    let work = SampleWork { draw, cameras: &cameras, wanted: &wanted, method, planes, temporal_reference_s: None };
    device().sampler.sample(&work).expect("images")
}

fn samples(image: &DepthImage) -> usize {
    image.inverse_depth_per_m.iter().filter(|&&d| d > 0.0).count()
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// A floor that the first image meets at a grazing angle and the second from above: its two large triangles make
/// every sample redundant by pixel, however few rows of the first image the floor fills.
#[test]
fn a_grazing_floor_counts_as_sampled_by_pixel_but_not_by_tolerance() {
    let scene = upload(&quad(Vec3::ZERO, 1.0, Vec3::Y, [200; 3]));
    let above = PinholeCamera::looking_at(Vec3::Y * 3.0, Vec3::ZERO, Vec3::NEG_Z, 0.6, SIZE_PX);
    println!("angle (°): share of the second image omitted by pixel, visibility, tolerance");
    let mut kept_before = -1.0;
    for degrees in [0.0f32, 45.0, 60.0, 80.0, 85.0, 88.0, 89.0, 89.9] {
        let angle = degrees.to_radians();
        let eye = Vec3::new(0.01, angle.cos(), angle.sin()) * 3.0;
        let first = PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::new(0.0, 0.3, -1.0), 0.6, SIZE_PX);
        let left_out = [PIXEL, VISIBILITY, TOLERANCE].map(|method| {
            let images = sample(&scene, &[first, above], method);
            1.0 - share(samples(&images[1]), samples(&sample(&scene, &[above], SamplingMethod::CONVENTIONAL)[0]))
        });
        println!("{degrees:5}: {left_out:.3?}");
        assert!(left_out[1] > 0.95, "all of it is seen");
        if degrees <= 85.0 {
            assert!(left_out[0] > 0.8, "one triangle is one triangle: {left_out:?}");
        }
        if degrees >= 80.0 {
            assert!(left_out[2] < 0.05, "too coarse to stand for it: {left_out:?}");
        }
        let kept = 1.0 - left_out[2];
        assert!(kept >= kept_before - 0.02, "{degrees}: {kept} after {kept_before}");
        kept_before = kept;
    }
}

/// Ten thousand instances of one square: the key is instance and primitive, so that none stands for another.
#[test]
fn samples_of_other_instances_are_not_redundant() {
    let mut scene = quad(Vec3::ZERO, 0.03, Vec3::new(0.2, 0.1, 1.0), [180, 90, 40]);
    let mesh = scene.instances[0].mesh;
    scene.instances = (0..10_000u32)
        .map(|i| {
            let (x, y) = ((i % 100) as f32 - 49.5, (i / 100) as f32 - 49.5);
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
    let (device, reference) = (sample(&on_device, &cameras, PIXEL), scalar::sample(&rays, &cameras, PIXEL));
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

/// Each further image of a meadow finds less that is new.
#[test]
fn each_further_image_of_grass_adds_fewer_samples() {
    let scene = grass(GrassDensity::new(1.0).expect("a density"));
    let on_device = upload(&scene);
    let bounds = scene.bounds();
    let reach = bounds.size().length();
    let camera = |i: usize| {
        let angle = 2.4 * i as f32;
        let aside =
            Vec3::new(angle.cos(), 0.3 * angle.sin(), 0.5 * angle.sin()) * (0.12 * reach * (i as f32 / 8.0).sqrt());
        let eye = bounds.center() + Vec3::new(0.2, 0.6, 0.7) * reach + aside;
        PinholeCamera::looking_at(eye, bounds.center(), Vec3::Y, 0.7, UVec2::splat(128))
    };
    let cameras: Vec<PinholeCamera> = (0..16).map(camera).collect();
    let images = sample(&on_device, &cameras, VISIBILITY);
    let new: Vec<f64> = images.iter().map(|image| share(samples(image), samples(&images[0]))).collect();
    println!("samples of the n-th image over the first's: {new:.2?}");
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    assert!(mean(&new[1..4]) > mean(&new[12..]), "{new:?}");
    assert!(new.iter().all(|&share| share > 0.0 && share <= 1.1), "{new:?}");
}

/// The second camera moves by parts of a pixel: texels that change from kept to omitted or back.
#[test]
fn masks_flicker_little_under_jitter() {
    let scene = poles(0.05);
    let on_device = upload(&scene);
    let camera = |x: f32| PinholeCamera::looking_at(Vec3::new(x, 0.0, 4.0), Vec3::NEG_Z * 2.0, Vec3::Y, 0.8, SIZE_PX);
    let pixel_m = 6.0 / camera(0.0).focal_px.x;
    println!("jitter (px): texels of the second image that change sides, by pixel, visibility, tolerance");
    for jitter_px in [0.0, 0.05, 0.1, 0.25, 0.5] {
        let flips = [PIXEL, VISIBILITY, TOLERANCE].map(|method| {
            let mask = |offset_px: f32| -> Vec<bool> {
                let cameras = [camera(-0.4), camera(0.4 + offset_px * pixel_m)];
                let images = sample(&on_device, &cameras, method);
                images[1].inverse_depth_per_m.iter().map(|&d| d > 0.0).collect()
            };
            let (still, moved) = (mask(0.0), mask(jitter_px));
            share(still.iter().zip(&moved).filter(|(a, b)| a != b).count(), still.len())
        });
        println!("{jitter_px:5}: {flips:.4?}");
        assert!(flips.iter().all(|&flips| flips <= 0.1), "{jitter_px}: {flips:?}");
        assert!(jitter_px > 0.0 || flips == [0.0; 3], "what stands still does not flicker: {flips:?}");
    }
}

/// The same, compared with what was kept before the second camera moved.
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

/// Tolerances from an eighth to eight times: small ones keep redundant samples, large ones omit samples that no other
/// image holds.
#[test]
fn more_tolerance_keeps_fewer_samples_and_loses_more_surface() {
    let scene = courtyard();
    let rays = render::scalar::rays::Scene::of(&upload(&scene), 0.0).expect("a tree");
    let bounds = scene.bounds();
    let reach = bounds.size().length();
    let camera = |x: f32| {
        let eye = bounds.center() + Vec3::new(x, 0.5, 0.9) * reach;
        PinholeCamera::looking_at(eye, bounds.center(), Vec3::Y, 0.7, SIZE_PX)
    };
    let view = scalar::sample(&rays, &[camera(0.05)], SamplingMethod::CONVENTIONAL).remove(0);
    println!("allowed: share of the second image kept, of a view not held");
    let curve = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0].map(|allowed| {
        let settings = scalar::Settings { allowed, ..scalar::Settings::default() };
        let images = scalar::sample_with(&rays, &[camera(-0.15), camera(0.2)], TOLERANCE, settings);
        let kept = share(samples(&images[1]), images[1].inverse_depth_per_m.len());
        let unheld = metrics::unheld_rate(&camera(0.05), &view.inverse_depth_per_m, &images).expect("planes");
        println!("{allowed:6}: {kept:.3} {:.4}", unheld.expect("a surface"));
        [kept, unheld.expect("a surface")]
    });
    assert!(curve.windows(2).all(|pair| pair[1][0] <= pair[0][0] + 1e-3), "{curve:?}");
    assert!(curve[6][0] < 0.8 * curve[0][0] && curve[6][1] > curve[3][1], "{curve:?}");
}
