//! A scene in the source's own coordinates, in double precision, and its conversion to a [`Scene`].

use std::collections::HashMap;
use std::ops::RangeInclusive;

use glam::{Affine3A, BVec3, DAffine3, DVec3};

use crate::light_rig::{DEFAULT_BACKGROUND, SourceLight};
use crate::{
    Animation, Environment, Fault, Illumination, Influence, Instance, Limits, Material, Mesh, MeshPart, MovingInstance,
    Scene, SourceCamera, SourceSpace, Texture, Vertex, VertexDetail, at_most,
};

/// The result of an importer.
#[derive(Default)]
pub(crate) struct SourceScene {
    pub name: String,
    pub meshes: Vec<SourceMesh>,
    pub instances: Vec<SourceInstance>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub lights: Vec<SourceLight>,
    pub environment: Environment,
    /// `None` for the default one.
    pub background: Option<Environment>,
    pub cameras: Vec<PlacedCamera>,
    /// Its nodes are in the source's coordinates.
    pub animation: Option<Animation>,
}

/// A mesh whose positions are in `positions_in_mesh`; `vertices[i].position` is unset.
#[derive(Default, Clone)]
pub(crate) struct SourceMesh {
    pub positions_in_mesh: Vec<DVec3>,
    pub vertices: Vec<Vertex>,
    /// Empty, or one for each of `vertices`.
    pub details: Vec<VertexDetail>,
    pub indices: Vec<u32>,
    pub parts: Vec<MeshPart>,
    /// The joints of each vertex; empty for a mesh without.
    pub influences: Vec<Influence>,
}

/// A placement of a mesh; its transform is invertible.
#[derive(Clone, Copy)]
pub(crate) struct SourceInstance {
    pub mesh: usize,
    pub source_from_mesh: DAffine3,
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
        at_most("instances", self.instances.len() as u64, limits.instances)?;
        let triangles = self.instances.iter().map(|i| self.meshes[i.mesh].indices.len() as u64 / 3);
        at_most("triangles of all instances", triangles.fold(0, u64::saturating_add), limits.triangles)?;
        self.normalise_meshes()?;
        let source_space = source_space(self.bounds_in_source(), self.animation.is_some())?;
        self.unmirror();
        let lights = self.lights.into_iter().map(|l| l.placed_in(source_space)).collect();
        let SourceSpace { origin_in_source, metres_per_unit } = source_space;
        let world_from_source =
            DAffine3::from_scale(DVec3::splat(metres_per_unit)) * DAffine3::from_translation(-origin_in_source);
        let instances = self.instances.iter().map(|i| Instance {
            mesh: i.mesh as u32,
            world_from_mesh: in_f32(&(world_from_source * i.source_from_mesh)),
        });
        let cameras = self.cameras.into_iter().map(|PlacedCamera { name, source_from_camera, fov_y_rad }| {
            // A camera has a place and a direction, and no size.
            let place_in_world = world_from_source.transform_point3(source_from_camera.translation);
            let placed = DAffine3 { translation: place_in_world, ..source_from_camera };
            SourceCamera { name, world_from_camera: in_f32(&placed), fov_y_rad }
        });
        if let Some(animation) = &mut self.animation {
            animation.world_from_source = world_from_source;
        }
        for volume in self.materials.iter_mut().filter_map(|material| material.volume.as_mut()) {
            // A distance beyond the range of `f32` is as good as none.
            volume.attenuation_distance_m =
                (volume.attenuation_distance_m * metres_per_unit as f32).max(f32::MIN_POSITIVE);
        }
        let scene = Scene {
            name: self.name,
            meshes: self.meshes.into_iter().map(SourceMesh::into_f32).collect(),
            instances: instances.collect(),
            materials: self.materials,
            textures: self.textures,
            illumination: Illumination { lights, environment: self.environment },
            background: self.background.unwrap_or(DEFAULT_BACKGROUND),
            cameras: cameras.collect(),
            animation: self.animation,
            source_space,
            ..Scene::default()
        };
        scene.check(limits)?;
        Ok(scene)
    }

    /// Moves a mesh that is far from its own origin there, and scales one whose extent `f32` cannot draw; its instances take
    /// over the distance and the size.
    fn normalise_meshes(&mut self) -> Result<(), Fault> {
        let mut old_from_new = Vec::with_capacity(self.meshes.len());
        for (number, mesh) in self.meshes.iter_mut().enumerate() {
            let bad = mesh.positions_in_mesh.iter().position(|p| !p.is_finite());
            if let Some(vertex) = bad {
                return Err(Fault::malformed(format!("mesh {number}, vertex {vertex}"), "its position is not finite"));
            }
            let bounds = Box3::around(mesh.positions_in_mesh.iter().copied());
            let scale = scale_to_drawable(bounds.extent(), &DRAWABLE_MESH_EXTENT);
            let offset = recentring_offset(bounds, scale);
            let is_changed = offset != DVec3::ZERO || scale != 1.0;
            if is_changed {
                mesh.positions_in_mesh.iter_mut().for_each(|p| *p = (*p - offset) * scale);
            }
            let inverse = DAffine3::from_translation(offset) * DAffine3::from_scale(DVec3::splat(scale.recip()));
            old_from_new.push(is_changed.then_some(inverse));
        }
        for moving in moving_instances(&mut self.animation) {
            if let Some(old_from_new) = &old_from_new[self.instances[moving.instance as usize].mesh] {
                moving.follow_mesh(old_from_new);
            }
        }
        for instance in &mut self.instances {
            if let Some(old_from_new) = old_from_new[instance.mesh] {
                instance.source_from_mesh *= old_from_new;
            }
        }
        Ok(())
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
        let mut is_mirrored = vec![false; self.instances.len()];
        for (instance, is_mirrored) in self.instances.iter_mut().zip(&mut is_mirrored) {
            if instance.source_from_mesh.matrix3.determinant() < 0.0 {
                instance.mesh = *mirrored_of.entry(instance.mesh).or_insert_with(|| {
                    self.meshes.push(self.meshes[instance.mesh].mirrored_in_x());
                    self.meshes.len() - 1
                });
                instance.source_from_mesh *= mirror_x;
                *is_mirrored = true;
            }
        }
        let moving = moving_instances(&mut self.animation).filter(|moving| is_mirrored[moving.instance as usize]);
        moving.for_each(|moving| moving.follow_mesh(&mirror_x));
    }
}

fn moving_instances(animation: &mut Option<Animation>) -> impl Iterator<Item = &mut MovingInstance> {
    animation.iter_mut().flat_map(|animation| &mut animation.moving)
}

impl SourceMesh {
    /// Appends `other` as one part of `material`.
    pub(crate) fn append_part(&mut self, other: SourceMesh, material: u32) {
        let first_vertex = self.vertices.len() as u32;
        let vertex_count = self.vertices.len() + other.vertices.len();
        if !self.details.is_empty() || !other.details.is_empty() {
            self.details.resize(self.vertices.len(), VertexDetail::default());
            self.details.extend(other.details);
            self.details.resize(vertex_count, VertexDetail::default());
        }
        if !(self.influences.is_empty() && other.influences.is_empty()) {
            self.influences.resize(self.vertices.len(), Influence::NONE);
            self.influences.extend(other.influences);
            self.influences.resize(vertex_count, Influence::NONE);
        }
        self.positions_in_mesh.extend(other.positions_in_mesh);
        self.vertices.extend(other.vertices);
        self.push_part(other.indices.into_iter().map(|i| i + first_vertex), material);
    }

    /// Appends triangles of this mesh's vertices as one part of `material`.
    pub(crate) fn push_part(&mut self, indices: impl IntoIterator<Item = u32>, material: u32) {
        let first_index = self.indices.len();
        self.indices.extend(indices);
        let index_count = (self.indices.len() - first_index) as u32;
        self.parts.push(MeshPart { first_index: first_index as u32, index_count, material });
    }

    /// Appends a copy of a vertex and returns its number.
    pub(crate) fn copy_of(&mut self, vertex: u32) -> u32 {
        let copy = self.vertices.len() as u32;
        let vertex = vertex as usize;
        self.vertices.push(self.vertices[vertex]);
        self.positions_in_mesh.push(self.positions_in_mesh[vertex]);
        self.details.extend(self.details.get(vertex).copied());
        self.influences.extend(self.influences.get(vertex).copied());
        copy
    }

    fn mirrored_in_x(&self) -> Self {
        let mut mesh = self.clone();
        mesh.positions_in_mesh.iter_mut().for_each(|p| p.x = -p.x);
        mesh.vertices.iter_mut().for_each(|v| v.normal[0] = -v.normal[0]);
        for detail in &mut mesh.details {
            // The cross product of mirrored vectors is the mirrored cross product turned round.
            detail.tangent[0] = -detail.tangent[0];
            detail.tangent[3] = -detail.tangent[3];
        }
        mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
        mesh
    }

    fn into_f32(mut self) -> Mesh {
        for (vertex, position) in self.vertices.iter_mut().zip(&self.positions_in_mesh) {
            vertex.position = position.as_vec3().to_array();
        }
        Mesh { vertices: self.vertices, details: self.details, indices: self.indices, parts: self.parts }
    }
}

fn in_f32(transform: &DAffine3) -> Affine3A {
    let [x, y, z] = [0, 1, 2].map(|i| transform.matrix3.col(i).as_vec3());
    Affine3A::from_cols(x.into(), y.into(), z.into(), transform.translation.as_vec3().into())
}

/// Distance from the origin beyond which `f32` loses a millimetre.
const FAR_M: f64 = 1e4;
/// The extents of a scene that is drawn in the unit of its file. Others are scaled to about a metre, because shaders multiply
/// four lengths in `f32`.
const DRAWABLE_EXTENT_M: RangeInclusive<f64> = 1e-3..=1e6;
/// The extents of a scene that is shown at all: that of a model is far within, and that of a damaged file is not.
const POSSIBLE_EXTENT: RangeInclusive<f64> = 1e-30..=1e12;
/// The extents of a mesh that is kept in its own unit, for the same reason.
const DRAWABLE_MESH_EXTENT: RangeInclusive<f64> = 1e-6..=1e8;
/// Distance in diagonals beyond which `f32` loses a hundred-thousandth of the model.
const FAR_IN_DIAGONALS: f64 = 1e3;

/// The space of a source with these bounds. A source that moves may be in one point at rest.
fn source_space(bounds: Box3, is_animated: bool) -> Result<SourceSpace, Fault> {
    let extent = bounds.extent();
    if !(bounds.min.is_finite() && bounds.max.is_finite()) {
        return Err(Fault::malformed("scene", "its bounds are not finite"));
    }
    if extent == 0.0 && !is_animated {
        return Err(Fault::malformed("scene", "it has no extent: all its triangles are in one point"));
    }
    if extent != 0.0 && !POSSIBLE_EXTENT.contains(&extent) {
        return Err(Fault::malformed("scene", format!("its extent of {extent:e} is out of range")));
    }
    let metres_per_unit = scale_to_drawable(extent, &DRAWABLE_EXTENT_M);
    Ok(SourceSpace { origin_in_source: recentring_offset(bounds, metres_per_unit), metres_per_unit })
}

/// The factor that brings an extent to 1…2, or 1 for one that is drawable or 0. It is a power of two: scaling is exact.
fn scale_to_drawable(extent: f64, drawable: &RangeInclusive<f64>) -> f64 {
    if extent == 0.0 || !extent.is_finite() || drawable.contains(&extent) {
        1.0
    } else {
        (-extent.log2().floor()).exp2()
    }
}

/// Offset that moves `bounds` to the origin, in whole units unless the bounds are too small or will be scaled.
fn recentring_offset(bounds: Box3, scale: f64) -> DVec3 {
    if bounds.is_empty() {
        return DVec3::ZERO;
    }
    let centre = bounds.center();
    let diagonal = bounds.diagonal();
    let distance = centre.length();
    if distance * scale <= FAR_M && distance <= FAR_IN_DIAGONALS * diagonal {
        DVec3::ZERO
    } else if diagonal > 10.0 && scale == 1.0 {
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

    /// The longest side; 0 for the empty box.
    fn extent(&self) -> f64 {
        (self.max - self.min).max_element().max(0.0)
    }

    fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| DVec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), self.max, self.min))
    }
}
