//! The scene and cameras of these tests.

use std::sync::{Arc, OnceLock};

use depth_image::{Antialias, Camera, DepthImage, Environment, Illumination, Light, PinholeCamera, linear_from_rgb9e5};
use fixtures::quad;
use glam::{Affine3A, UVec2, Vec3};
use gpu::{DevicePreference, Gpu};
use render::{DrawWork, GpuScene, Renderer, SamplePlanes, Visibility};
use scene::{Instance, Scene};

pub const SIZE_PX: UVec2 = UVec2::new(96, 72);
const ALL: SamplePlanes = SamplePlanes {
    antialias: Antialias::NONE,
    normal: true,
    surface_id: true,
    specular: true,
    corners: false,
    light: false,
};

/// Light in place of colour.
pub const LIGHT: SamplePlanes = SamplePlanes {
    antialias: Antialias::NONE,
    normal: false,
    surface_id: false,
    specular: false,
    corners: false,
    light: true,
};

/// The software device of this program; a test without one fails.
pub fn device() -> &'static (Arc<Gpu>, Renderer) {
    static DEVICE: OnceLock<(Arc<Gpu>, Renderer)> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let renderer = Renderer::new(&gpu, render::templates(&[]).expect("templates"));
        (gpu, renderer)
    })
}

pub fn upload(scene: &Scene) -> GpuScene {
    GpuScene::upload(&device().0, scene).expect("a scene")
}

pub fn work<'a>(scene: &'a GpuScene, lighting: &str) -> DrawWork<'a> {
    DrawWork { visibility: Visibility::Triangles, ..DrawWork::new(scene, lighting.parse().expect(lighting)) }
}

pub fn image(work: DrawWork<'_>, camera: &PinholeCamera) -> DepthImage {
    device().1.draw_depth_images(work, &[Camera::Pinhole(*camera)], ALL).expect("an image").remove(0)
}

pub fn down_from(height_m: f32) -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::Y * height_m, Vec3::ZERO, Vec3::NEG_Z, 0.9, SIZE_PX)
}

/// A white floor of two metres at the origin, lit as said, and further quads (centre, half size, normal) over it.
pub fn floor_under(quads: &[(Vec3, f32, Vec3)], illumination: Illumination) -> Scene {
    let mut scene = quad(Vec3::ZERO, 1.0, Vec3::Y, [255; 3]);
    scene.materials[0].unlit = false;
    scene.illumination = illumination;
    for &(center, half_m, normal) in quads {
        let mesh = scene.meshes.len() as u32;
        scene.meshes.push(quad(center, half_m, normal, [255; 3]).meshes.remove(0));
        scene.instances.push(Instance { mesh, world_from_mesh: Affine3A::IDENTITY });
    }
    scene
}

pub fn lamps(lights: Vec<Light>) -> Illumination {
    Illumination { lights, environment: Environment::default() }
}

/// Reflected light at each sample, linear green, with its place in the world.
pub fn lit_points(image: &DepthImage) -> Vec<(Vec3, f32)> {
    let UVec2 { x: width_px, y: height_px } = image.size_px();
    let places = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y)));
    let lit = places.filter_map(|(x, y)| {
        let color = linear_from_rgb9e5(image.color_rgb9e5[(y * width_px + x) as usize]);
        Some((image.sample_in_world(x, y)?, color.y))
    });
    lit.collect()
}

/// Those of the floor of [`floor_under`].
pub fn floor_light(image: &DepthImage) -> Vec<(Vec3, f32)> {
    lit_points(image).into_iter().filter(|(point, _)| point.y.abs() < 1e-3).collect()
}

pub fn mean(values: impl IntoIterator<Item = f32>) -> f32 {
    let (sum, count) = values.into_iter().fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
    sum / count as f32
}
