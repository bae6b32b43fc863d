//! A scene on the device.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::{Pod, Zeroable};
use depth_image::{Aabb, Highlight, LampRig, Light, MAX_LIGHTS};
use glam::{Affine3A, Mat3, Vec3};
use gpu::{Binding, Gpu, GpuEnvironment, GpuError, switches};
use indexmap::IndexSet;
use scene::{Material, Scene, Texture, TextureUse, VertexDetail, Wind};
use wgpu::BufferUsages;

use crate::lamp_shares::GpuLampShares;
use crate::material::{normal_scale, phong_reflector};
use crate::motion::Motion;
use crate::rays::{AccelerationReport, OrderedMesh, RayScene, flat::world_metres};
use crate::{Lighting, RenderError, cluster, pixel_camera::uniform, texture};

/// A mesh part where an instance places it: `Object` in the shader, the same for a whole draw. It lies at a dynamic offset: a
/// load from a uniform costs nothing a vertex or fragment.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuObject {
    pub world_from_mesh: [[f32; 4]; 3],
    pub normal_from_mesh: [[f32; 4]; 3],
    pub base_color_linear: [f32; 4],
    pub emissive_linear: [f32; 3],
    pub alpha_cutoff: f32,
    pub metallic: f32,
    pub roughness: f32,
    pub phong_reflector: u32,
    pub instance: u32,
    pub dielectric_linear: [f32; 3],
    pub normal_scale: f32,
    pub occlusion_strength: f32,
    pub second_uv: u32,
    pub alpha_hashed: u32,
    pub scale: f32,
}

/// The part of the scene that is the same for every vertex and fragment.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct GpuSurroundings {
    pub wind_direction: [f32; 3],
    pub wind_amplitude_m: f32,
    pub wind_waves_per_m: [f32; 3],
    pub wind_frequency_hz: f32,
}

/// The work of a draw's shader: pipelines are specialised, for work that is not in the shader is free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub(crate) struct MaterialTraits {
    pub double_sided: bool,
    /// Without a test for alpha, hidden fragments are never shaded.
    pub alpha_tested: bool,
    pub textured: bool,
    /// Metallic and roughness come from a texture.
    pub coat_textured: bool,
    pub unlit: bool,
    pub specular: bool,
    /// See [`Material::is_mapped`]; all textures are then read.
    pub mapped: bool,
}

/// A cluster of one instance, ready to draw.
pub(crate) struct Draw {
    pub indices: Range<u32>,
    pub base_vertex: i32,
    /// Its vertices are those of a pose, in the world.
    pub posed: bool,
    /// Into the textures of materials.
    pub texture: u32,
    pub material: MaterialTraits,
    /// Into the objects.
    pub object: u32,
    pub bounds_in_world: Aabb,
}

impl Draw {
    /// Draws of equal state share a pipeline and textures.
    pub fn state(&self) -> (MaterialTraits, u32) {
        (self.material, self.texture)
    }
}

static NEXT_IDENTITY: AtomicU64 = AtomicU64::new(0);

/// A scene uploaded to one device.
pub struct GpuScene {
    pub(crate) draws: Vec<Draw>,
    pub(crate) vertices: wgpu::Buffer,
    /// One [`scene::VertexDetail`] for each vertex; a single one where no material is mapped.
    pub(crate) details: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
    pub(crate) objects: wgpu::Buffer,
    pub(crate) surroundings: wgpu::Buffer,
    /// The textures of materials in the order of [`Material::textures`], white where there is none, each with its
    /// sampler.
    pub(crate) textures: Vec<[(wgpu::TextureView, wgpu::Sampler); 5]>,
    pub(crate) background: wgpu::Buffer,
    pub(crate) illumination: wgpu::Buffer,
    pub(crate) light_count: usize,
    pub(crate) lights: Vec<Light>,
    pub(crate) lamp_shares: GpuLampShares,
    /// Light and background, where a map gives them.
    pub environment: Option<Arc<GpuEnvironment>>,
    pub(crate) rays: RayScene,
    highlights: [bool; 2],
    /// A number that no other scene of this process has.
    pub identity: u64,
    /// Whether pictures depend on scene time.
    pub(crate) animated: bool,
    /// Whether vertices sway.
    pub(crate) wind: bool,
    /// Instances that follow nodes.
    pub(crate) motion: Option<Arc<Motion>>,
    /// Around all geometry at all times.
    /// Holds all geometry at all times.
    pub bounds_in_world: Aabb,
}

impl GpuScene {
    /// Puts a valid scene on the device.
    ///
    /// # Errors
    /// When a buffer would exceed the device's limits: names it.
    pub fn upload(gpu: &Arc<Gpu>, scene: &Scene) -> Result<Self, RenderError> {
        check_sizes(gpu, scene)?;
        let ordered = OrderedMesh::all(scene);
        let motion = Motion::of(gpu, scene);
        let boxes = scene.bounds_of_instances();
        let geometry = Geometry::gather(scene, &ordered, motion.as_deref(), &boxes);
        let samplers = texture::samplers(gpu);
        let white = Texture { width_px: 1, height_px: 1, is_srgb: true, srgba8: vec![255; 4] };
        let white = texture::upload(gpu, &white);
        // Drawing and rays show the same textures; those of rays are one table.
        let textures = texture::within(&scene.textures, gpu.most_table_texels());
        let uploaded: Vec<_> = textures.iter().map(|t| texture::upload(gpu, t)).collect();
        let of_materials = geometry.textures.iter().map(|textures| {
            textures.map(|used| {
                let view = used.map_or(&white, |used| &uploaded[used.texture as usize]);
                (view.clone(), samplers[&used.map_or_else(Default::default, |used| used.wrap)].clone())
            })
        });
        let surroundings = scene.wind.map_or(GpuSurroundings::zeroed(), |wind| GpuSurroundings {
            wind_direction: wind.direction_in_world.to_array(),
            wind_amplitude_m: wind.amplitude_m,
            wind_waves_per_m: wind.waves_per_m.to_array(),
            wind_frequency_hz: wind.frequency_hz,
        });
        let illumination = gpu::illumination_bytes(&scene.illumination);
        let environment = scene.environment_map.as_ref().map(|map| GpuEnvironment::upload(gpu, map)).transpose()?;
        Ok(Self {
            vertices: gpu.buffer_with("vertices", &geometry.vertices, BufferUsages::VERTEX),
            details: gpu.buffer_with("vertex details", &geometry.details, BufferUsages::VERTEX),
            indices: gpu.buffer_with("indices", &geometry.indices, BufferUsages::INDEX),
            objects: uniform(gpu, "objects", geometry.objects.into_iter()),
            surroundings: gpu.buffer_with("surroundings", &[surroundings], BufferUsages::UNIFORM),
            textures: of_materials.collect(),
            background: gpu.buffer_with("background", &gpu::background_bytes(&scene.background), BufferUsages::UNIFORM),
            illumination: gpu.buffer_with("illumination", &illumination, BufferUsages::UNIFORM),
            light_count: scene.illumination.lights.len(),
            lights: scene.illumination.lights.clone(),
            lamp_shares: GpuLampShares::new(&scene.illumination),
            environment: environment.map(Arc::new),
            rays: RayScene::of(gpu, scene, &textures, &ordered, motion.clone()),
            highlights: [
                scene.materials.iter().any(|m| m.phong_specular > 0.0 && !m.unlit),
                scene.materials.iter().any(Material::is_specular),
            ],
            identity: NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed),
            animated: scene.wind.is_some() || scene.period_s().is_some(),
            wind: scene.wind.is_some(),
            motion,
            bounds_in_world: Aabb::of_boxes(&boxes),
            draws: geometry.draws,
        })
    }

    /// The bytes of its buffers, textures and tables, with those of rays where they are there.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let buffers =
            [&self.vertices, &self.details, &self.indices, &self.objects, &self.surroundings, &self.illumination];
        // Several materials may share a texture.
        let mut textures: Vec<&wgpu::Texture> =
            self.textures.iter().flatten().map(|(view, _)| view.texture()).collect();
        textures.sort_unstable();
        textures.dedup();
        let posed = self.motion.as_ref().map_or(0, |motion| motion.bytes());
        let of_textures: u64 = textures.into_iter().map(gpu::texture_bytes).sum();
        let environment = self.environment.as_deref().map_or(0, GpuEnvironment::bytes);
        buffers.map(wgpu::Buffer::size).iter().sum::<u64>() + of_textures + environment + self.rays.bytes() + posed
    }

    /// Cameras on each lamp, for images of this side; `None` for lamps that are no rectangles or that shine away from the scene.
    #[must_use]
    pub fn lamp_rigs(&self, side_px: u32) -> Vec<Option<LampRig>> {
        self.lights.iter().map(|light| LampRig::new(light, self.bounds_in_world, side_px)).collect()
    }

    /// What shaders of light read of the scene.
    pub(crate) fn bindings(&self) -> impl Iterator<Item = Binding<'_>> {
        let light =
            [Binding::buffer("background", &self.background), Binding::buffer("illumination", &self.illumination)];
        light.into_iter().chain(self.environment.iter().flat_map(|map| map.bindings()))
    }

    /// Whether a map has bright texels.
    pub(crate) fn has_bright_texels(&self) -> bool {
        self.environment.as_deref().is_some_and(|map| map.has_bright_texels)
    }

    /// Lamps that take rays: those of the scene, and the bright texels of its environment map, which only rays find.
    pub(crate) fn traced_lamps(&self, lighting: Lighting) -> u32 {
        self.light_count as u32 + u32::from(self.has_bright_texels() && lighting.shadow_rays() > 0)
    }

    /// Whether some surface has highlights.
    #[must_use]
    pub fn has_highlights(&self, highlight: Highlight) -> bool {
        self.highlights[usize::from(highlight == Highlight::Ggx)]
    }

    /// Whether light goes through some surface.
    pub(crate) fn has_glass(&self) -> bool {
        self.rays.traversal.glass
    }

    /// Instances counted each.
    pub(crate) fn triangle_count(&self) -> usize {
        self.draws.iter().map(|draw| draw.indices.len() / 3).sum()
    }

    /// The tree that rays go through at a scene time: made now if there is none.
    ///
    /// # Errors
    /// When the device's textures are too small for the scene.
    pub fn acceleration(&self, scene_time_s: f32) -> Result<AccelerationReport, RenderError> {
        Ok(self.rays.at(scene_time_s)?.report)
    }
}

fn check_sizes(gpu: &Gpu, scene: &Scene) -> Result<(), GpuError> {
    let vertices: usize = scene.meshes.iter().map(|mesh| mesh.vertices.len()).sum();
    let vertices = vertices.max(Motion::vertex_count(scene));
    let bytes = (vertices * size_of::<scene::Vertex>()) as u64;
    GpuError::check_limit("the scene's vertices (bytes)", bytes, gpu.device.limits().max_buffer_size)?;
    GpuError::check_limit("the scene's lights", scene.illumination.lights.len() as u64, MAX_LIGHTS as u64)?;
    let side = u64::from(gpu.device.limits().max_texture_dimension_2d);
    let largest = scene.textures.iter().map(|t| u64::from(t.width_px.max(t.height_px))).max().unwrap_or(0);
    GpuError::check_limit("the scene's largest texture (side in pixels)", largest, side)
}

#[derive(Default)]
struct Geometry {
    vertices: Vec<scene::Vertex>,
    details: Vec<VertexDetail>,
    indices: Vec<u32>,
    objects: Vec<GpuObject>,
    draws: Vec<Draw>,
    textures: IndexSet<[Option<TextureUse>; 5]>,
}

/// An instance that moves: the first of its posed vertices, and where it is over all moments.
#[derive(Clone, Copy)]
struct Moving {
    base_vertex: i32,
    bounds_in_world: Aabb,
}

impl Geometry {
    fn gather(scene: &Scene, ordered: &[OrderedMesh<'_>], motion: Option<&Motion>, boxes: &[Aabb]) -> Self {
        let mut geometry = Self::default();
        let is_mapped = scene.materials.iter().any(Material::is_mapped);
        for (mesh_number, OrderedMesh { mesh, indices, clusters, .. }) in ordered.iter().enumerate() {
            let placements = scene.instances.iter().enumerate().filter(|(_, i)| i.mesh as usize == mesh_number);
            for (number, instance) in placements {
                let first_posed = motion.and_then(|motion| motion.place(number as u32)).map(|place| place.start as i32);
                let moving = first_posed.map(|base_vertex| Moving { base_vertex, bounds_in_world: boxes[number] });
                for of_one_material in clusters.chunk_by(|a, b| a.material == b.material) {
                    geometry.add(scene, of_one_material, number as u32, &instance.world_from_mesh, moving);
                }
            }
            geometry.vertices.extend(&mesh.vertices);
            if is_mapped {
                geometry.details.extend(&mesh.details);
                geometry.details.resize(geometry.vertices.len(), VertexDetail::default());
            }
            geometry.indices.extend(indices);
        }
        // Few changes of pipeline and texture; the sort is stable, so clusters stay along their curve.
        geometry.draws.sort_by_key(Draw::state);
        geometry
    }

    /// Adds neighbouring clusters of one material where an instance places them.
    fn add(
        &mut self,
        scene: &Scene,
        clusters: &[cluster::Cluster],
        instance: u32,
        world_from_mesh: &Affine3A,
        moving: Option<Moving>,
    ) {
        let material = &scene.materials[clusters[0].material as usize];
        let reach_m = scene.wind.map_or(0.0, |wind: Wind| wind.amplitude_m.abs());
        let indices = self.indices.len() as u32;
        let base_vertex = self.vertices.len() as i32;
        let object = self.objects.len() as u32;
        let (texture, _) = self.textures.insert_full(material.textures());
        // A pose's vertices are in the world already.
        let world_from_vertices = if moving.is_some() { &Affine3A::IDENTITY } else { world_from_mesh };
        self.objects.push(gpu_object(world_from_vertices, material, instance));
        self.draws.extend(clusters.iter().map(|cluster| {
            let corners = cluster.bounds_in_mesh.corners().map(|corner| world_from_mesh.transform_point3(corner));
            let first_index = indices + cluster.first_triangle * 3;
            Draw {
                indices: first_index..first_index + cluster.triangle_count * 3,
                base_vertex: moving.map_or(base_vertex, |moving| moving.base_vertex),
                posed: moving.is_some(),
                texture: texture as u32,
                material: MaterialTraits::of(material),
                object,
                bounds_in_world: moving.map_or(Aabb::around(corners).padded(reach_m), |moving| moving.bounds_in_world),
            }
        }));
    }
}

impl MaterialTraits {
    /// Every combination that occurs.
    pub fn all() -> impl Iterator<Item = Self> {
        let all = switches().map(|[double_sided, alpha_tested, textured, coat_textured, unlit, specular, mapped]| {
            Self { double_sided, alpha_tested, textured, coat_textured, unlit, specular, mapped }
        });
        all.filter(|material| !material.mapped || material.textured && material.coat_textured)
    }

    fn of(material: &Material) -> Self {
        let mapped = material.is_mapped();
        Self {
            double_sided: material.has_two_sides(),
            alpha_tested: material.is_alpha_tested(),
            textured: mapped || material.base_color_texture.is_some(),
            coat_textured: mapped || material.metallic_roughness_texture.is_some(),
            unlit: material.unlit,
            specular: material.is_specular(),
            mapped,
        }
    }
}

fn rows(matrix: Mat3, translation: Vec3) -> [[f32; 4]; 3] {
    std::array::from_fn(|i| matrix.row(i).extend(translation[i]).to_array())
}

fn gpu_object(world_from_mesh: &Affine3A, material: &Material, instance: u32) -> GpuObject {
    let linear = Mat3::from(world_from_mesh.matrix3);
    let normals = linear.inverse().transpose();
    let second_uv = material.textures().into_iter().map(|texture| texture.is_some_and(|t| t.second_uv));
    GpuObject {
        world_from_mesh: rows(linear, world_from_mesh.translation.into()),
        normal_from_mesh: rows(normals, Vec3::ZERO),
        base_color_linear: material.base_color_linear,
        emissive_linear: material.emissive_linear.to_array(),
        alpha_cutoff: material.alpha_cutoff,
        metallic: material.metallic,
        roughness: material.roughness,
        phong_reflector: phong_reflector(material),
        instance,
        dielectric_linear: material.dielectric_reflectance_linear.to_array(),
        normal_scale: normal_scale(material),
        occlusion_strength: material.occlusion_strength,
        second_uv: second_uv.rev().fold(0, |bits, second| bits << 1 | u32::from(second)),
        alpha_hashed: material.alpha_hashed.into(),
        scale: world_metres(world_from_mesh),
    }
}
