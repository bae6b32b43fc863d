//! Instances, and walls seen edge-on, beside the scalar reference. Further failures are curves of docs/failures.md.

use depth_image::{DepthImage, PinholeCamera};
use fixtures::quad;
use glam::{Affine3A, UVec2, Vec3};
use render::{GpuScene, SamplePlanes};
use sampling::{Redundancy, SampleWork, SamplingMethod, scalar};
use scene::Instance;

use crate::stage::{device, pinholes, unlit, upload};

const SIZE_PX: UVec2 = UVec2::new(80, 60);
const PIXEL: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Pixel);

fn sample(scene: &GpuScene, cameras: &[PinholeCamera], method: SamplingMethod) -> Vec<DepthImage> {
    let draw = unlit(scene);
    let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
    let cameras = pinholes(cameras);
    let planes = SamplePlanes { normal: true, surface_id: true, ..SamplePlanes::default() };
    let work = SampleWork { draw, cameras: &cameras, tile_count: 1, wanted: &wanted, method, planes };
    device().sampler.sample(&work).expect("images")
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
