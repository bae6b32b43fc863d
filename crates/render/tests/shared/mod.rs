//! What the tests of rays and of light share: the software device, small scenes, and numbers to judge by.

#![allow(dead_code, reason = "each of the programs uses a part")]

use std::sync::{Arc, OnceLock};

use depth_image::{
    Camera, DepthImage, Environment, Illumination, Light, PinholeCamera, View, ViewPlanes, linear_from_rgb9e5,
};
use glam::{Affine3A, UVec2, Vec3};
use gpu::{DevicePreference, Gpu};
use render::{DrawWork, GpuScene, Refinement, Renderer, SamplePlanes, Visibility};
use scene::{Instance, Limits, Material, Mesh, MeshPart, Scene, SceneSpec, Vertex};

/// Of pictures, where nothing else is said.
pub const SIZE_PX: UVec2 = UVec2::new(96, 72);

/// The software device of this program; a test without one fails.
pub fn device() -> &'static (Arc<Gpu>, Renderer) {
    static DEVICE: OnceLock<(Arc<Gpu>, Renderer)> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let renderer = Renderer::new(&gpu).expect("a renderer");
        (gpu, renderer)
    })
}

pub fn upload(scene: &Scene) -> GpuScene {
    GpuScene::upload(&device().0, scene).expect("a scene")
}

/// Surfaces by rays.
pub fn work<'a>(scene: &'a GpuScene, lighting: &str) -> DrawWork<'a> {
    DrawWork {
        scene,
        lighting: lighting.parse().expect(lighting),
        scene_time_s: 0.0,
        visibility: Visibility::Rays,
        refinement: Refinement::default(),
    }
}

pub fn view(work: DrawWork<'_>, camera: &PinholeCamera) -> View {
    let planes = ViewPlanes { inverse_depth: true, provenance: false };
    device().1.draw_views(work, &[*camera], planes).expect("a view").remove(0)
}

/// With normals, surface ids, and what highlights need.
pub fn image(work: DrawWork<'_>, camera: &PinholeCamera) -> DepthImage {
    let all = SamplePlanes { normal: true, surface_id: true, specular: true };
    device().1.draw_depth_images(work, &[Camera::Pinhole(*camera)], all).expect("an image").remove(0)
}

pub fn colors(image: &DepthImage) -> Vec<Vec3> {
    image.color_rgb9e5.iter().map(|&color| linear_from_rgb9e5(color)).collect()
}

pub fn built_in(name: &str) -> Scene {
    let spec: SceneSpec = name.parse().unwrap_or_else(|never| match never {});
    spec.load(&Limits::default()).expect(name)
}

/// Columns and rows of a picture.
pub fn pixels(size_px: UVec2) -> impl Iterator<Item = UVec2> {
    (0..size_px.y).flat_map(move |y| (0..size_px.x).map(move |x| UVec2::new(x, y)))
}

pub fn looking(eye: Vec3, target: Vec3) -> PinholeCamera {
    PinholeCamera::looking_at(eye, target, Vec3::Y, 0.8, SIZE_PX)
}

/// From above a scene's front.
pub fn before(scene: &Scene) -> PinholeCamera {
    let bounds = scene.bounds();
    let eye = bounds.center() + Vec3::new(0.4, 1.0, 1.1) * bounds.size().length() * 0.8;
    looking(eye, bounds.center())
}

/// One mesh of one material, white and matt where nothing else is said.
#[derive(Default)]
pub struct Shape {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
}

impl Shape {
    pub fn triangle(&mut self, corners: [Vec3; 3]) -> &mut Self {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(Vec3::Y);
        self.indices.extend((0..3).map(|i| self.vertices.len() as u32 + i));
        self.vertices.extend(corners.map(|corner| vertex(corner, normal)));
        self
    }

    /// Faces `right × up`; both are half edges.
    pub fn rectangle(&mut self, center: Vec3, right: Vec3, up: Vec3) -> &mut Self {
        let [a, b, c, d] = [-right - up, right - up, right + up, up - right].map(|offset| center + offset);
        self.triangle([a, b, c]).triangle([a, c, d])
    }

    /// Faces out.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3) -> &mut Self {
        let (center, half) = ((min + max) * 0.5, (max - min) * 0.5);
        for axis in 0..3 {
            let side = |turn: usize| Vec3::AXES[(axis + turn) % 3] * half[(axis + turn) % 3];
            self.rectangle(center + side(0), side(1), side(2)).rectangle(center - side(0), side(2), side(1));
        }
        self
    }

    /// Matt under GGX.
    pub fn scene(&self, illumination: Illumination) -> Scene {
        let part = MeshPart { first_index: 0, index_count: self.indices.len() as u32, material: 0 };
        Scene {
            name: "shape".into(),
            meshes: vec![Mesh { vertices: self.vertices.clone(), indices: self.indices.clone(), parts: vec![part] }],
            instances: vec![Instance { mesh: 0, world_from_mesh: Affine3A::IDENTITY }],
            materials: vec![Material::default()],
            illumination,
            ..Scene::default()
        }
    }
}

pub fn vertex(position: Vec3, normal: Vec3) -> Vertex {
    Vertex {
        position: position.to_array(),
        normal: normal.to_array(),
        uv: [0.0; 2],
        color_srgba8: [255; 4],
        sway: 0.0,
    }
}

pub fn lamps(lights: Vec<Light>) -> Illumination {
    Illumination { lights, environment: Environment::default() }
}

pub fn sky(radiance: f32) -> Illumination {
    Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::splat(radiance)) }
}

pub fn sun(towards: Vec3, angular_radius_rad: f32) -> Light {
    let towards_light_in_world = towards.normalize_or(Vec3::Y);
    Light::Directional { towards_light_in_world, irradiance_linear: Vec3::ONE, angular_radius_rad }
}

/// An even number from 0 to 1.
pub fn random(number: u32, salt: u32) -> f32 {
    let mixed = render::scalar::sequence::hashed(number ^ salt.wrapping_mul(0x9e37_79b9));
    (mixed >> 8) as f32 / (1u32 << 24) as f32
}

/// Evenly in the cube from −1 to 1.
pub fn random_place(number: u32, salt: u32) -> Vec3 {
    Vec3::from([0, 1, 2].map(|axis| random(number, salt * 3 + axis))) * 2.0 - 1.0
}

pub fn mean(values: impl IntoIterator<Item = f32>) -> f32 {
    let (sum, count) =
        values.into_iter().fold((0.0f64, 0u32), |(sum, count), value| (sum + f64::from(value), count + 1));
    (sum / f64::from(count.max(1))) as f32
}

/// The value that a share of them do not exceed.
pub fn percentile(values: &[f32], share: f32) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    sorted.get(((sorted.len() as f32 * share) as usize).min(sorted.len().saturating_sub(1))).copied().unwrap_or(0.0)
}
