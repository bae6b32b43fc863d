//! A scene in the source's own coordinates, in double precision, and its conversion to a [`Scene`].

use std::collections::HashMap;

use glam::{Affine3A, BVec3, DAffine3, DVec3};

use crate::error::{Fault, at_most};
use crate::light_rig::{color, color_mut, position_mut};
use crate::{Illumination, Instance, Light, Limits, Material, Mesh, MeshPart, Scene, SourceCamera, Texture, Vertex};

/// Distance from the origin beyond which `f32` loses a millimetre.
const FAR_M: f64 = 1e4;
/// Distance in diagonals beyond which `f32` loses a hundred-thousandth of the model.
const FAR_IN_DIAGONALS: f64 = 1e3;

/// The result of an importer.
#[derive(Default)]
pub(crate) struct SourceScene {
    pub name: String,
    pub meshes: Vec<SourceMesh>,
    pub instances: Vec<SourceInstance>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub lights: Vec<SourceLight>,
    pub cameras: Vec<PlacedCamera>,
}

/// A mesh whose positions are in `positions_in_mesh`; `vertices[i].position` is unset.
#[derive(Default, Clone)]
pub(crate) struct SourceMesh {
    pub positions_in_mesh: Vec<DVec3>,
    pub vertices: Vec<Vertex>,
    pub indices: Vec<u32>,
    pub parts: Vec<MeshPart>,
}

/// A placement of a mesh; its transform is invertible.
#[derive(Clone, Copy)]
pub(crate) struct SourceInstance {
    pub mesh: usize,
    pub source_from_mesh: DAffine3,
}

/// A light whose position is outside of `light`, where it is unset.
pub(crate) struct SourceLight {
    pub light: Light,
    pub position_in_source: DVec3,
}

pub(crate) struct PlacedCamera {
    pub name: String,
    pub source_from_camera: DAffine3,
    pub fov_y_rad: f32,
}

/// The default vertex.
pub(crate) fn plain_vertex() -> Vertex {
    Vertex { position: [0.0; 3], normal: [0.0; 3], uv: [0.0; 2], color_srgba8: [255; 4], sway: 0.0 }
}

impl SourceScene {
    /// Checks, re-centres, un-mirrors, converts to `f32`, and validates.
    pub(crate) fn finish(mut self, limits: &Limits) -> Result<Scene, Fault> {
        self.check_sizes(limits)?;
        self.recentre_meshes()?;
        let origin_in_source = self.origin_in_source()?;
        self.unmirror();
        let lights = self.lights.iter().map(|l| l.relative_to(origin_in_source)).collect();
        let moved = |source_from_x: &DAffine3| moved(source_from_x, origin_in_source);
        let instance =
            |i: &SourceInstance| Instance { mesh: i.mesh as u32, world_from_mesh: moved(&i.source_from_mesh) };
        let camera = |PlacedCamera { name, source_from_camera, fov_y_rad }| SourceCamera {
            name,
            world_from_camera: moved(&source_from_camera),
            fov_y_rad,
        };
        let scene = Scene {
            name: self.name,
            meshes: self.meshes.into_iter().map(SourceMesh::into_f32).collect(),
            instances: self.instances.iter().map(instance).collect(),
            materials: self.materials,
            textures: self.textures,
            illumination: Illumination { lights, ..Illumination::default() },
            environment_map: None,
            cameras: self.cameras.into_iter().map(camera).collect(),
            origin_in_source,
            ..Scene::default()
        };
        scene.check(limits)?;
        Ok(scene)
    }

    fn check_sizes(&self, limits: &Limits) -> Result<(), Fault> {
        at_most("instances", self.instances.len() as u64, limits.instances)?;
        let of = |i: &SourceInstance| self.meshes[i.mesh].indices.len() as u64 / 3;
        let triangles = self.instances.iter().map(of).fold(0, u64::saturating_add);
        at_most("triangles of all instances", triangles, limits.triangles)?;
        if triangles == 0 {
            return Err(Fault::malformed("scene", "it has no triangles"));
        }
        Ok(())
    }

    /// Moves a mesh that is far from its own origin there; its instances take over the distance.
    fn recentre_meshes(&mut self) -> Result<(), Fault> {
        for (number, mesh) in self.meshes.iter_mut().enumerate() {
            let bad = mesh.positions_in_mesh.iter().position(|p| !p.is_finite());
            if let Some(vertex) = bad {
                return Err(Fault::malformed(format!("mesh {number}, vertex {vertex}"), "its position is not finite"));
            }
            let offset = recentring_offset(Box3::around(mesh.positions_in_mesh.iter().copied()));
            if offset != DVec3::ZERO {
                mesh.positions_in_mesh.iter_mut().for_each(|p| *p -= offset);
                let of_mesh = self.instances.iter_mut().filter(|i| i.mesh == number);
                of_mesh.for_each(|i| i.source_from_mesh *= DAffine3::from_translation(offset));
            }
        }
        Ok(())
    }

    fn origin_in_source(&self) -> Result<DVec3, Fault> {
        let all = self.bounds_in_source();
        if !(all.min.is_finite() && all.max.is_finite()) {
            return Err(Fault::malformed("scene", "its bounds are not finite"));
        }
        Ok(recentring_offset(all))
    }

    /// Bounds of all instances; not finite without instances, or where a position is not.
    pub(crate) fn bounds_in_source(&self) -> Box3 {
        let boxes: Vec<_> = self.meshes.iter().map(|m| Box3::around(m.positions_in_mesh.iter().copied())).collect();
        let corners = self.instances.iter().flat_map(|instance| {
            let box3 = boxes[instance.mesh];
            let corners = (!box3.is_empty()).then(|| box3.corners());
            corners.into_iter().flatten().map(|c| instance.source_from_mesh.transform_point3(c))
        });
        Box3::around(corners)
    }

    /// Mirrors a mesh once in place of its mirroring placements, which would turn triangles inside out.
    fn unmirror(&mut self) {
        let mirror_x = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let mut mirrored_of = HashMap::new();
        for instance in &mut self.instances {
            if instance.source_from_mesh.matrix3.determinant() < 0.0 {
                instance.mesh = *mirrored_of.entry(instance.mesh).or_insert_with(|| {
                    self.meshes.push(self.meshes[instance.mesh].mirrored_in_x());
                    self.meshes.len() - 1
                });
                instance.source_from_mesh *= mirror_x;
            }
        }
    }
}

impl SourceMesh {
    /// Appends `other` as one part of `material`.
    pub(crate) fn append_part(&mut self, other: SourceMesh, material: u32) {
        let first_vertex = self.vertices.len() as u32;
        let first_index = self.indices.len() as u32;
        let index_count = other.indices.len() as u32;
        self.positions_in_mesh.extend(other.positions_in_mesh);
        self.vertices.extend(other.vertices);
        self.indices.extend(other.indices.into_iter().map(|i| i + first_vertex));
        self.parts.push(MeshPart { first_index, index_count, material });
    }

    fn mirrored_in_x(&self) -> Self {
        let mut mesh = self.clone();
        mesh.positions_in_mesh.iter_mut().for_each(|p| p.x = -p.x);
        mesh.vertices.iter_mut().for_each(|v| v.normal[0] = -v.normal[0]);
        mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
        mesh
    }

    fn into_f32(mut self) -> Mesh {
        for (vertex, position) in self.vertices.iter_mut().zip(&self.positions_in_mesh) {
            vertex.position = position.as_vec3().to_array();
        }
        Mesh { vertices: self.vertices, indices: self.indices, parts: self.parts }
    }
}

impl SourceLight {
    /// Unoccluded irradiance at a point, with spots aimed at it; distances count as at least `least_m`.
    pub(crate) fn arriving_at(&self, point_in_source: DVec3, least_m: f64) -> DVec3 {
        let color = color(self.light).as_dvec3();
        let distance_m = self.position_in_source.distance(point_in_source).max(least_m);
        if matches!(self.light, Light::Directional { .. }) { color } else { color / (distance_m * distance_m) }
    }

    /// Scales in double precision: a factor may be too small for `f32` where the result is not.
    pub(crate) fn scale(&mut self, factor: f64) {
        let color = color_mut(&mut self.light);
        *color = (color.as_dvec3() * factor).as_vec3();
    }

    fn relative_to(&self, origin_in_source: DVec3) -> Light {
        let mut light = self.light;
        if let Some(position) = position_mut(&mut light) {
            *position = (self.position_in_source - origin_in_source).as_vec3();
        }
        light
    }
}

fn moved(source_from_x: &DAffine3, origin_in_source: DVec3) -> Affine3A {
    let [x, y, z] = [0, 1, 2].map(|i| source_from_x.matrix3.col(i).as_vec3());
    let translation = (source_from_x.translation - origin_in_source).as_vec3();
    Affine3A::from_cols(x.into(), y.into(), z.into(), translation.into())
}

pub(crate) fn is_invertible(transform: &DAffine3) -> bool {
    let largest = (0..3).fold(0f64, |most, i| most.max(transform.matrix3.col(i).length()));
    transform.is_finite() && (transform.matrix3 * largest.recip()).determinant().abs() > 1e-12
}

/// Offset that moves `bounds` to the origin, in whole metres unless the bounds are too small.
fn recentring_offset(bounds: Box3) -> DVec3 {
    if bounds.is_empty() {
        return DVec3::ZERO;
    }
    let (centre, diagonal) = (bounds.center(), bounds.diagonal());
    let distance = centre.length();
    if distance <= FAR_M && distance <= FAR_IN_DIAGONALS * diagonal {
        DVec3::ZERO
    } else if diagonal > 10.0 {
        centre.round()
    } else {
        centre
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Box3 {
    min: DVec3,
    max: DVec3,
}

impl Box3 {
    fn around(points: impl Iterator<Item = DVec3>) -> Self {
        let empty = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        points.fold(empty, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    pub(crate) fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    pub(crate) fn diagonal(&self) -> f64 {
        (self.max - self.min).length()
    }

    fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    fn corners(&self) -> [DVec3; 8] {
        let is_max = |i: usize| BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0);
        std::array::from_fn(|i| DVec3::select(is_max(i), self.max, self.min))
    }
}
