//! A scene's triangles in the world, instances written out: what rays are traced against.

use std::borrow::Cow;
use std::iter::repeat;
use std::ops::Range;
use std::sync::Arc;

use depth_image::oct16_from_unit;
use glam::{Affine3A, Mat3, Vec3};
use rayon::prelude::*;
use scene::{Material, Mesh, Scene, Vertex, VertexDetail, Wind};

use crate::cluster::{self, Cluster};
use crate::motion::Motion;

/// Flag of a triangle whose texture decides where it is.
pub const ALPHA_TESTED: u32 = 1 << 31;
/// Flag of a triangle whose back is seen too.
pub const DOUBLE_SIDED: u32 = 1 << 30;
/// Flag of a triangle that light goes through.
pub const GLASS: u32 = 1 << 29;
/// Flag of a triangle that is shown as it is, whatever the light.
pub const UNLIT: u32 = 1 << 28;
/// Flag of a triangle that has highlights.
pub const SPECULAR: u32 = 1 << 27;
/// Flag of a triangle whose alpha is compared with a hash of the place.
pub const ALPHA_HASHED: u32 = 1 << 26;
/// Flag of a triangle of glass without a volume: light goes straight through.
pub const THIN: u32 = 1 << 25;
/// The flags that a ray needs before it has met a triangle.
pub const CORNER_FLAGS: u32 = ALPHA_TESTED | DOUBLE_SIDED | GLASS;
/// The bits of a vertex' number, which shares a word with the flags.
pub const VERTEX: u32 = (1 << 29) - 1;
/// The most vertices that have a number.
pub const MAX_VERTICES: u64 = VERTEX as u64 + 1;

/// One corner besides its position: one texel on the device.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FlatVertex {
    /// In the world.
    pub normal_oct16: u32,
    /// As in [`scene::Vertex`].
    pub uv: [f32; 2],
    /// As in [`scene::Vertex`].
    pub color_srgba8: [u8; 4],
}

/// One corner's further data, which only mapped materials need ([`Material::is_mapped`]): two texels on the device.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FlatDetail {
    /// As in [`scene::VertexDetail`].
    pub uv: [f32; 2],
    /// Unit tangent in the world, whose lowest bit is the sign of the bitangent.
    pub tangent_oct16: u32,
    padding: u32,
    /// In the mesh's space, in metres of the world.
    pub place_m: [f32; 3],
    more_padding: u32,
}

impl FlatDetail {
    fn of(vertex: &Vertex, detail: VertexDetail, placed: &Affine3A) -> Self {
        let [x, y, z, sign] = detail.tangent;
        let tangent = placed.transform_vector3(Vec3::new(x, y, z)).normalize_or(Vec3::X);
        Self {
            uv: detail.uv,
            tangent_oct16: oct16_from_unit(tangent) & !1 | u32::from(sign < 0.0),
            padding: 0,
            place_m: (Vec3::from(vertex.position) * world_metres(placed)).to_array(),
            more_padding: 0,
        }
    }
}

/// Metres of the world that a metre of the mesh becomes, the mean over the axes.
pub fn world_metres(world_from_mesh: &Affine3A) -> f32 {
    world_from_mesh.matrix3.determinant().abs().cbrt()
}

/// One triangle besides its corners: one texel on the device.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FlatTriangle {
    /// Into [`Scene::instances`].
    pub instance: u32,
    /// As in [`depth_image::SurfaceId`].
    pub primitive: u32,
    /// Into [`Scene::materials`].
    pub material: u32,
    /// [`ALPHA_TESTED`], [`DOUBLE_SIDED`], [`GLASS`], [`UNLIT`], [`SPECULAR`], [`ALPHA_HASHED`] and [`THIN`].
    pub flags: u32,
}

/// All triangles of all instances.
#[derive(Default)]
pub struct FlatScene {
    rest_in_world: Vec<Vec3>,
    sway: Vec<f32>,
    wind: Option<Wind>,
    motion: Option<Arc<Motion>>,
    /// Of each instance that moves, the first vertex here, and its vertices in a pose.
    moving: Vec<(usize, Range<usize>)>,
    /// At rest.
    pub vertices: Vec<FlatVertex>,
    /// One for each vertex, or none.
    pub details: Vec<FlatDetail>,
    pub corners: Vec<[u32; 3]>,
    pub triangles: Vec<FlatTriangle>,
}

impl FlatScene {
    /// Writes out the instances, with the details of vertices if they are asked for.
    pub fn of(scene: &Scene, ordered: &[OrderedMesh<'_>], motion: Option<Arc<Motion>>, detailed: bool) -> Self {
        let mut flat = Self { wind: scene.wind, motion, ..Self::default() };
        let flags: Vec<u32> = scene.materials.iter().map(flags_of).collect();
        for (number, instance) in (0..).zip(&scene.instances) {
            let mesh = &ordered[instance.mesh as usize];
            let vertices = &mesh.mesh.vertices;
            let placed = &instance.world_from_mesh;
            let normals = Mat3::from(placed.matrix3).inverse().transpose();
            let first_vertex = flat.rest_in_world.len() as u32;
            if let Some(posed) = flat.motion.as_ref().and_then(|motion| motion.place(number)) {
                flat.moving.push((first_vertex as usize, posed));
            }
            flat.rest_in_world.extend(vertices.iter().map(|v| placed.transform_point3(v.position.into())));
            flat.sway.extend(vertices.iter().map(|v| v.sway));
            flat.vertices.extend(vertices.iter().map(|v| FlatVertex {
                normal_oct16: oct16_from_unit((normals * Vec3::from(v.normal)).normalize_or(Vec3::Y)),
                uv: v.uv,
                color_srgba8: v.color_srgba8,
            }));
            for (primitive, (triangle, material)) in (mesh.first_primitive..).zip(mesh.triangles()) {
                flat.corners.push(triangle.map(|v| v + first_vertex));
                let flags = flags[material as usize];
                flat.triangles.push(FlatTriangle { instance: number, primitive, material, flags });
            }
            if detailed {
                let details = mesh.mesh.details.iter().copied().chain(repeat(VertexDetail::default()));
                let detailed = vertices.iter().zip(details);
                flat.details.extend(detailed.map(|(vertex, detail)| FlatDetail::of(vertex, detail, placed)));
            }
        }
        flat
    }

    /// The positions of all vertices at a scene time.
    pub fn positions_in_world(&self, scene_time_s: f32) -> Vec<Vec3> {
        let mut positions = self.rest_in_world.clone();
        self.for_posed(scene_time_s, |vertex, posed, _| positions[vertex] = posed.position.into());
        if let Some(wind) = self.wind {
            positions.par_iter_mut().zip(&self.sway).for_each(|(at, &sway)| {
                *at += wind.displacement_in_world(*at, sway, scene_time_s);
            });
        }
        positions
    }

    /// The attributes of all vertices at a scene time: normals turn with joints.
    pub fn vertices_at(&self, scene_time_s: f32) -> Cow<'_, [FlatVertex]> {
        let mut vertices = Cow::Borrowed(&self.vertices[..]);
        self.for_posed(scene_time_s, |vertex, posed, _| {
            vertices.to_mut()[vertex].normal_oct16 = oct16_from_unit(posed.normal.into());
        });
        vertices
    }

    /// The details of all vertices at a scene time: tangents turn with joints.
    pub fn details_at(&self, scene_time_s: f32) -> Cow<'_, [FlatDetail]> {
        let mut details = Cow::Borrowed(&self.details[..]);
        self.for_posed(scene_time_s, |vertex, posed, detail| {
            if let Some(own) = details.to_mut().get_mut(vertex) {
                *own = FlatDetail::of(posed, detail, &Affine3A::IDENTITY);
            }
        });
        details
    }

    /// Whether anything depends on scene time.
    pub fn moves(&self) -> bool {
        self.wind.is_some() || self.turns()
    }

    /// Whether attributes depend on scene time, besides positions.
    pub fn turns(&self) -> bool {
        self.motion.as_ref().is_some_and(|motion| motion.moves())
    }

    /// Calls `set` with the number, the pose and the posed details of every vertex that has a pose.
    fn for_posed(&self, scene_time_s: f32, mut set: impl FnMut(usize, &Vertex, VertexDetail)) {
        let Some(motion) = &self.motion else { return };
        let posed = motion.at(scene_time_s);
        for (first, place) in &self.moving {
            let details = posed.details.iter().skip(place.start).copied().chain(repeat(VertexDetail::default()));
            let posed = posed.vertices[place.clone()].iter().zip(details);
            (*first..).zip(posed).for_each(|(vertex, (posed, detail))| set(vertex, posed, detail));
        }
    }
}

fn flags_of(material: &Material) -> u32 {
    (u32::from(material.is_alpha_tested()) * ALPHA_TESTED)
        | (u32::from(material.alpha_hashed) * ALPHA_HASHED)
        | (u32::from(material.has_two_sides()) * DOUBLE_SIDED)
        | (u32::from(material.is_transmissive()) * GLASS)
        | (u32::from(material.volume.is_none()) * THIN)
        | (u32::from(material.unlit) * UNLIT)
        | (u32::from(material.is_specular()) * SPECULAR)
}

/// A mesh with its triangles in the order that gives them their numbers.
pub(crate) struct OrderedMesh<'s> {
    pub mesh: &'s Mesh,
    /// Number of its first triangle in the scene.
    pub first_primitive: u32,
    /// Three corners a triangle.
    pub indices: Vec<u32>,
    /// They cover the triangles in order.
    pub clusters: Vec<Cluster>,
}

impl<'s> OrderedMesh<'s> {
    /// All meshes of a scene.
    pub fn all(scene: &'s Scene) -> Vec<Self> {
        let mut first_primitive = 0;
        let mut ordered = Vec::with_capacity(scene.meshes.len());
        for mesh in &scene.meshes {
            let (indices, clusters) = cluster::clustered(mesh);
            ordered.push(Self { mesh, first_primitive, indices, clusters });
            first_primitive += mesh.triangle_count() as u32;
        }
        ordered
    }

    /// Corners and material of each triangle.
    fn triangles(&self) -> impl Iterator<Item = ([u32; 3], u32)> {
        let corners = self.indices.as_chunks::<3>().0.iter().copied();
        let materials = self.clusters.iter().flat_map(|c| std::iter::repeat_n(c.material, c.triangle_count as usize));
        corners.zip(materials)
    }
}
