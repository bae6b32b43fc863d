//! A scene on the device.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use depth_image::Aabb;
use glam::{Affine3A, Mat3, Vec3, Vec4};
use gpu::{Gpu, GpuError};
use scene::{Light, Material, Scene, Wind};
use wgpu::BufferUsages;

use crate::{RenderError, cluster, texture};

/// What is the same for a whole draw: a mesh part where an instance places it. `Object` in the shader, which
/// finds it at a dynamic offset: a load from a uniform costs nothing a vertex or fragment.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuObject {
    pub world_from_mesh: [[f32; 4]; 3],
    pub normal_from_mesh: [[f32; 4]; 3],
    pub base_color_linear: [f32; 4],
    pub emissive_linear: [f32; 3],
    pub alpha_cutoff: f32,
    pub phong_specular: f32,
    pub phong_exponent: f32,
    pub instance: u32,
    pub padding: u32,
}

/// Uniform offsets must be multiples of this on every device.
pub(crate) const UNIFORM_STRIDE: u64 = 256;

/// Lights travel in a uniform.
const MAX_LIGHTS: usize = 256;

/// Directional where `towards_or_position.w` is 0, else a point light.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct GpuLight {
    pub towards_or_position: [f32; 4],
    pub intensity_linear: [f32; 4],
}

/// The part of the scene that is the same for every vertex and fragment.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct GpuSurroundings {
    pub ambient_linear: [f32; 3],
    pub padding: u32,
    pub wind_direction: [f32; 3],
    pub wind_amplitude_m: f32,
    pub wind_waves_per_m: [f32; 3],
    pub wind_frequency_hz: f32,
}

/// What a draw's shader has to do: pipelines are specialised, for work that is not in the shader is free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Traits {
    pub double_sided: bool,
    /// Without a test for alpha, hidden fragments are never shaded.
    pub alpha_tested: bool,
    pub textured: bool,
    pub unlit: bool,
    pub specular: bool,
}

/// A cluster of one instance, ready to draw.
pub(crate) struct Draw {
    pub first_index: u32,
    pub index_count: u32,
    pub base_vertex: i32,
    pub texture: u32,
    pub traits: Traits,
    /// Into the objects.
    pub object: u32,
    pub bounds_in_world: Aabb,
}

/// A scene uploaded to one device.
pub struct GpuScene {
    pub(crate) draws: Vec<Draw>,
    pub(crate) vertices: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
    pub(crate) objects: wgpu::Buffer,
    pub(crate) light_count: usize,
    pub(crate) surroundings: wgpu::Buffer,
    pub(crate) textures: Vec<wgpu::TextureView>,
    pub(crate) background_linear: Vec3,
    animated: bool,
    bounds_in_world: Aabb,
    triangle_count: u64,
}

impl GpuScene {
    /// Puts a valid scene on the device.
    ///
    /// # Errors
    /// When a buffer would exceed the device's limits: names it.
    pub fn upload(gpu: &Arc<Gpu>, scene: &Scene) -> Result<Self, RenderError> {
        check_sizes(gpu, scene)?;
        let geometry = Geometry::gather(scene);
        let white = texture::white();
        Ok(Self {
            vertices: gpu.buffer_with("vertices", &geometry.vertices, BufferUsages::VERTEX),
            indices: gpu.buffer_with("indices", &geometry.indices, BufferUsages::INDEX),
            objects: gpu.buffer_with("objects", &strided(&geometry.objects), BufferUsages::UNIFORM),
            light_count: scene.lights.len(),
            surroundings: gpu.buffer_with("surroundings", &surroundings(scene), BufferUsages::UNIFORM),
            textures: std::iter::once(&white).chain(&scene.textures).map(|t| texture::upload(gpu, t)).collect(),
            background_linear: scene.background_linear,
            animated: scene.wind.is_some(),
            bounds_in_world: scene.bounds(),
            triangle_count: scene.triangle_count(),
            draws: geometry.draws,
        })
    }

    /// Whether pictures depend on scene time.
    #[must_use]
    pub fn is_animated(&self) -> bool {
        self.animated
    }

    /// Around all geometry at all times.
    #[must_use]
    pub fn bounds_in_world(&self) -> Aabb {
        self.bounds_in_world
    }

    /// Triangles, instances counted each.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.triangle_count
    }
}

fn check_sizes(gpu: &Gpu, scene: &Scene) -> Result<(), GpuError> {
    let vertices: usize = scene.meshes.iter().map(|mesh| mesh.vertices.len()).sum();
    let limit = gpu.device.limits().max_buffer_size;
    let needed = (vertices * size_of::<scene::Vertex>()) as u64;
    if needed > limit {
        return Err(GpuError::Limit { what: "the scene's vertices (bytes)".to_owned(), needed, limit });
    }
    if scene.lights.len() > MAX_LIGHTS {
        let (needed, limit) = (scene.lights.len() as u64, MAX_LIGHTS as u64);
        return Err(GpuError::Limit { what: "the scene's lights".to_owned(), needed, limit });
    }
    let side = u64::from(gpu.device.limits().max_texture_dimension_2d);
    let largest = scene.textures.iter().map(|t| u64::from(t.width_px.max(t.height_px))).max().unwrap_or(0);
    if largest > side {
        return Err(GpuError::Limit {
            what: "the scene's largest texture (side in pixels)".to_owned(),
            needed: largest,
            limit: side,
        });
    }
    Ok(())
}

#[derive(Default)]
struct Geometry {
    vertices: Vec<scene::Vertex>,
    indices: Vec<u32>,
    objects: Vec<GpuObject>,
    draws: Vec<Draw>,
}

impl Geometry {
    fn gather(scene: &Scene) -> Self {
        let mut geometry = Self::default();
        for (mesh_number, mesh) in scene.meshes.iter().enumerate() {
            let (indices, clusters) = cluster::clustered(mesh);
            let placements = scene.instances.iter().enumerate().filter(|(_, i)| i.mesh as usize == mesh_number);
            for (number, instance) in placements {
                for of_one_material in clusters.chunk_by(|a, b| a.material == b.material) {
                    geometry.add(scene, of_one_material, number as u32, &instance.world_from_mesh);
                }
            }
            geometry.vertices.extend(&mesh.vertices);
            geometry.indices.extend(indices);
        }
        // Few changes of pipeline and texture; the sort is stable, so clusters stay along their curve.
        geometry.draws.sort_by_key(|draw| (draw.traits, draw.texture));
        geometry
    }

    /// Adds neighbouring clusters of one material where an instance places them.
    fn add(&mut self, scene: &Scene, clusters: &[cluster::Cluster], instance: u32, world_from_mesh: &Affine3A) {
        let material = &scene.materials[clusters[0].material as usize];
        let reach_m = scene.wind.map_or(0.0, |wind: Wind| wind.amplitude_m.abs());
        let (first_index, base_vertex) = (self.indices.len() as u32, self.vertices.len() as i32);
        let object = self.objects.len() as u32;
        self.objects.push(gpu_object(world_from_mesh, material, instance));
        self.draws.extend(clusters.iter().map(|cluster| {
            let corners = cluster.bounds_in_mesh.corners().map(|corner| world_from_mesh.transform_point3(corner));
            Draw {
                first_index: first_index + cluster.first_triangle * 3,
                index_count: cluster.triangle_count * 3,
                base_vertex,
                texture: material.base_color_texture.map_or(0, |t| t + 1),
                traits: Traits::of(material),
                object,
                bounds_in_world: Aabb::around(corners).padded(reach_m),
            }
        }));
    }
}

impl Draw {
    /// Whether `next` can be drawn in one call with what ends at `end_index`.
    pub(crate) fn joins(&self, end_index: u32, next: &Self) -> bool {
        (end_index, self.object) == (next.first_index, next.object)
    }
}

impl Traits {
    fn of(material: &Material) -> Self {
        Self {
            double_sided: material.double_sided,
            alpha_tested: material.alpha_cutoff > 0.0,
            textured: material.base_color_texture.is_some(),
            unlit: material.unlit,
            specular: material.phong_specular > 0.0,
        }
    }
}

/// Each object at its own dynamic offset.
fn strided(objects: &[GpuObject]) -> Vec<u8> {
    let mut bytes = vec![0; objects.len() * UNIFORM_STRIDE as usize];
    for (slot, object) in bytes.chunks_mut(UNIFORM_STRIDE as usize).zip(objects) {
        slot[..size_of::<GpuObject>()].copy_from_slice(bytemuck::bytes_of(object));
    }
    bytes
}

fn rows(matrix: Mat3, translation: Vec3) -> [[f32; 4]; 3] {
    std::array::from_fn(|i| matrix.row(i).extend(translation[i]).to_array())
}

fn gpu_object(world_from_mesh: &Affine3A, material: &Material, instance: u32) -> GpuObject {
    let linear = Mat3::from(world_from_mesh.matrix3);
    let normals = linear.inverse().transpose();
    GpuObject {
        world_from_mesh: rows(linear, world_from_mesh.translation.into()),
        normal_from_mesh: rows(normals, Vec3::ZERO),
        base_color_linear: material.base_color_linear,
        emissive_linear: material.emissive_linear.to_array(),
        alpha_cutoff: material.alpha_cutoff,
        phong_specular: material.phong_specular,
        phong_exponent: material.phong_exponent,
        instance,
        padding: 0,
    }
}

fn gpu_light(light: &Light) -> GpuLight {
    let (towards_or_position, intensity) = match *light {
        Light::Directional { towards_light_in_world, irradiance_linear } => {
            (towards_light_in_world.extend(0.0), irradiance_linear)
        }
        Light::Point { position_in_world, intensity_linear } => (position_in_world.extend(1.0), intensity_linear),
    };
    GpuLight {
        towards_or_position: towards_or_position.to_array(),
        intensity_linear: Vec4::from((intensity, 0.0)).to_array(),
    }
}

/// The fixed part, then the lights.
fn surroundings(scene: &Scene) -> Vec<u8> {
    let still = Wind { direction_in_world: Vec3::X, amplitude_m: 0.0, frequency_hz: 0.0, waves_per_m: Vec3::ZERO };
    let wind = scene.wind.unwrap_or(still);
    let fixed = GpuSurroundings {
        ambient_linear: scene.ambient_linear.to_array(),
        padding: 0,
        wind_direction: wind.direction_in_world.to_array(),
        wind_amplitude_m: wind.amplitude_m,
        wind_waves_per_m: wind.waves_per_m.to_array(),
        wind_frequency_hz: wind.frequency_hz,
    };
    let lights: Vec<GpuLight> = scene.lights.iter().map(gpu_light).collect();
    let mut bytes = bytemuck::bytes_of(&fixed).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(&lights));
    bytes
}
