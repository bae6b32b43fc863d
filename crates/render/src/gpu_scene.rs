//! A scene on the device.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use depth_image::Aabb;
use glam::{Affine3A, Mat3, Vec3, Vec4};
use gpu::{Gpu, GpuError};
use scene::{Light, Material, Scene, Wind};
use wgpu::BufferUsages;

use crate::{RenderError, cluster, texture};

/// What the vertex shader needs to know of one drawn cluster; the draw's instance number selects it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct DrawRecord {
    instance: u32,
    first_primitive: u32,
    material: u32,
    padding: u32,
}

/// Rows of the placement, and of its normals' transform.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct GpuInstance {
    world_from_mesh: [[f32; 4]; 3],
    normal_from_mesh: [[f32; 4]; 3],
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct GpuMaterial {
    base_color_linear: [f32; 4],
    emissive_linear: [f32; 3],
    alpha_cutoff: f32,
    phong_specular: f32,
    phong_exponent: f32,
    unlit: f32,
    double_sided: f32,
}

/// Directional where `towards_or_position.w` is 0, else a point light.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct GpuLight {
    towards_or_position: [f32; 4],
    intensity_linear: [f32; 4],
}

/// The part of the scene that is the same for every vertex and fragment.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct GpuSurroundings {
    ambient_linear: [f32; 3],
    light_count: u32,
    wind_direction: [f32; 3],
    wind_amplitude_m: f32,
    wind_waves_per_m: [f32; 3],
    wind_frequency_hz: f32,
}

/// A cluster of one instance, ready to draw.
pub(crate) struct Draw {
    pub first_index: u32,
    pub index_count: u32,
    pub base_vertex: i32,
    pub texture: u32,
    pub double_sided: bool,
    pub bounds_in_world: Aabb,
    mesh_instance: u32,
    material: u32,
}

/// A scene uploaded to one device.
pub struct GpuScene {
    pub(crate) draws: Vec<Draw>,
    pub(crate) vertices: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
    pub(crate) records: wgpu::Buffer,
    pub(crate) instances: wgpu::Buffer,
    pub(crate) materials: wgpu::Buffer,
    pub(crate) lights: wgpu::Buffer,
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
        let storage = BufferUsages::STORAGE;
        let white = texture::white();
        Ok(Self {
            vertices: gpu.buffer_with("vertices", &geometry.vertices, BufferUsages::VERTEX),
            indices: gpu.buffer_with("indices", &geometry.indices, BufferUsages::INDEX),
            records: gpu.buffer_with("draw records", &geometry.records, storage),
            instances: gpu.buffer_with(
                "instances",
                &scene.instances.iter().map(|i| gpu_instance(&i.world_from_mesh)).collect::<Vec<_>>(),
                storage,
            ),
            materials: gpu.buffer_with(
                "materials",
                &scene.materials.iter().map(gpu_material).collect::<Vec<_>>(),
                storage,
            ),
            lights: gpu.buffer_with("lights", &scene.lights.iter().map(gpu_light).collect::<Vec<_>>(), storage),
            surroundings: gpu.buffer_with("surroundings", &[surroundings(scene)], BufferUsages::UNIFORM),
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
    gpu.check_storage_bytes(
        "the scene's instances (bytes)",
        (scene.instances.len() * size_of::<GpuInstance>()) as u64,
    )?;
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
    records: Vec<DrawRecord>,
    draws: Vec<Draw>,
}

impl Geometry {
    fn gather(scene: &Scene) -> Self {
        let mut geometry = Self::default();
        for (mesh_number, mesh) in scene.meshes.iter().enumerate() {
            let (indices, clusters) = cluster::clustered(mesh);
            let placements = scene.instances.iter().enumerate().filter(|(_, i)| i.mesh as usize == mesh_number);
            for (number, instance) in placements {
                let draws: Vec<Draw> = clusters
                    .iter()
                    .map(|c| geometry.draw(scene, c, number as u32, &instance.world_from_mesh))
                    .collect();
                geometry.draws.extend(draws);
            }
            geometry.vertices.extend(&mesh.vertices);
            geometry.indices.extend(indices);
        }
        // Few changes of pipeline and texture; the sort is stable, so clusters stay along their curve.
        geometry.draws.sort_by_key(|draw| (draw.double_sided, draw.texture));
        geometry.records = geometry.draws.iter().map(Draw::record).collect();
        geometry
    }

    fn draw(&self, scene: &Scene, cluster: &cluster::Cluster, mesh_instance: u32, world_from_mesh: &Affine3A) -> Draw {
        let material = &scene.materials[cluster.material as usize];
        let corners = cluster.bounds_in_mesh.corners().map(|corner| world_from_mesh.transform_point3(corner));
        let reach_m = scene.wind.map_or(0.0, |wind: Wind| wind.amplitude_m.abs());
        Draw {
            first_index: self.indices.len() as u32 + cluster.first_triangle * 3,
            index_count: cluster.triangle_count * 3,
            base_vertex: self.vertices.len() as i32,
            texture: material.base_color_texture.map_or(0, |t| t + 1),
            double_sided: material.double_sided,
            bounds_in_world: Aabb::around(corners).padded(reach_m),
            mesh_instance,
            material: cluster.material,
        }
    }
}

impl Draw {
    fn record(&self) -> DrawRecord {
        DrawRecord {
            instance: self.mesh_instance,
            first_primitive: self.first_index / 3,
            material: self.material,
            padding: 0,
        }
    }

    /// Whether `next` can be drawn in one call with this one.
    pub(crate) fn joins(&self, end_index: u32, next: &Self) -> bool {
        (end_index, self.base_vertex, self.mesh_instance, self.material)
            == (next.first_index, next.base_vertex, next.mesh_instance, next.material)
    }
}

fn rows(matrix: Mat3, translation: Vec3) -> [[f32; 4]; 3] {
    std::array::from_fn(|i| matrix.row(i).extend(translation[i]).to_array())
}

fn gpu_instance(world_from_mesh: &Affine3A) -> GpuInstance {
    let linear = Mat3::from(world_from_mesh.matrix3);
    let normals = linear.inverse().transpose();
    GpuInstance {
        world_from_mesh: rows(linear, world_from_mesh.translation.into()),
        normal_from_mesh: rows(normals, Vec3::ZERO),
    }
}

fn gpu_material(material: &Material) -> GpuMaterial {
    let flag = |set: bool| f32::from(u8::from(set));
    GpuMaterial {
        base_color_linear: material.base_color_linear,
        emissive_linear: material.emissive_linear.to_array(),
        alpha_cutoff: material.alpha_cutoff,
        phong_specular: material.phong_specular,
        phong_exponent: material.phong_exponent,
        unlit: flag(material.unlit),
        double_sided: flag(material.double_sided),
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

fn surroundings(scene: &Scene) -> GpuSurroundings {
    let still = Wind { direction_in_world: Vec3::X, amplitude_m: 0.0, frequency_hz: 0.0, waves_per_m: Vec3::ZERO };
    let wind = scene.wind.unwrap_or(still);
    GpuSurroundings {
        ambient_linear: scene.ambient_linear.to_array(),
        light_count: scene.lights.len() as u32,
        wind_direction: wind.direction_in_world.to_array(),
        wind_amplitude_m: wind.amplitude_m,
        wind_waves_per_m: wind.waves_per_m.to_array(),
        wind_frequency_hz: wind.frequency_hz,
    }
}
