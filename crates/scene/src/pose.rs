//! Vertices at a moment: linear blend skinning (glTF 2.0, 3.7.3).

use glam::{Affine3A, DAffine3, Mat3A, Vec3, Vec3A};
use rayon::prelude::*;

use crate::{Influence, MAX_COORDINATE_M, Mesh, MovingInstance, Scene, Vertex, VertexDetail};

impl Scene {
    /// The scene as it is at a moment, without motion by nodes: each moving instance has a mesh of its own, in the world.
    /// The reference for what moves.
    #[must_use]
    pub fn frozen_at(&self, scene_time_s: f32) -> Self {
        let mut frozen = self.clone();
        let Some(animation) = frozen.animation.take() else { return frozen };
        let world_from_nodes = animation.world_from_nodes(scene_time_s);
        for moving in &animation.moving {
            let Some(instance) = frozen.instances.get_mut(moving.instance as usize) else { continue };
            let Some(mesh) = self.meshes.get(instance.mesh as usize) else { continue };
            let vertices = moving.posed(&mesh.vertices, &world_from_nodes);
            let details = moving.posed_details(&mesh.details, &world_from_nodes);
            (instance.mesh, instance.world_from_mesh) = (frozen.meshes.len() as u32, Affine3A::IDENTITY);
            frozen.meshes.push(Mesh { vertices, details, ..mesh.clone() });
        }
        frozen
    }
}

impl MovingInstance {
    /// The vertices of the instance in the world, by [`crate::Animation::world_from_nodes`] and its mesh's vertices at
    /// rest.
    /// Every coordinate is finite and at most [`MAX_COORDINATE_M`].
    #[must_use]
    pub fn posed(&self, rest: &[Vertex], world_from_nodes: &[DAffine3]) -> Vec<Vertex> {
        self.moved(rest, world_from_nodes, Placement::from, placed)
    }

    /// The details of vertices, which follow the joints as [`Self::posed`] has them: tangents turn.
    #[must_use]
    pub fn posed_details(&self, rest: &[VertexDetail], world_from_nodes: &[DAffine3]) -> Vec<VertexDetail> {
        self.moved(rest, world_from_nodes, Affine3A::from, turned)
    }

    /// `prepared` gives what all items with one placement share.
    fn moved<T: Copy + Send + Sync, P: Sync>(
        &self,
        rest: &[T],
        world_from_nodes: &[DAffine3],
        prepared: fn(Affine3A) -> P,
        moved: fn(&P, &T) -> T,
    ) -> Vec<T> {
        let world_from_mesh = self.world_from_mesh(world_from_nodes);
        let Some(first) = world_from_mesh.first() else { return rest.to_vec() };
        if self.influences.is_empty() {
            let first = prepared(*first);
            return rest.par_iter().map(|item| moved(&first, item)).collect();
        }
        let influenced = rest.par_iter().zip(&self.influences);
        influenced.map(|(item, influence)| moved(&prepared(blended(&world_from_mesh, influence)), item)).collect()
    }

    /// The mesh's placement in the world by each joint.
    fn world_from_mesh(&self, world_from_nodes: &[DAffine3]) -> Vec<Affine3A> {
        let world_from_joints = self.joints.iter().map(|joint| {
            let world_from_node = world_from_nodes.get(joint.node as usize).copied().unwrap_or_default();
            let world_from_mesh = world_from_node * joint.joint_from_mesh;
            Affine3A::from_cols_array(&world_from_mesh.to_cols_array().map(bounded))
        });
        world_from_joints.collect()
    }
}

/// A placement of vertices, and of their normals.
struct Placement {
    world_from_mesh: Affine3A,
    normals: Mat3A,
}

impl From<Affine3A> for Placement {
    fn from(world_from_mesh: Affine3A) -> Self {
        Self { world_from_mesh, normals: normals_from(world_from_mesh.matrix3) }
    }
}

fn turned(world_from_mesh: &Affine3A, detail: &VertexDetail) -> VertexDetail {
    let [x, y, z, sign] = detail.tangent;
    let tangent = world_from_mesh.transform_vector3(Vec3::new(x, y, z)).try_normalize().unwrap_or(Vec3::X);
    VertexDetail { tangent: tangent.extend(sign).to_array(), ..*detail }
}

fn blended(world_from_mesh: &[Affine3A], influence: &Influence) -> Affine3A {
    let nothing = Affine3A { matrix3: Mat3A::ZERO, translation: Vec3A::ZERO };
    influence.shares().fold(nothing, |sum, (joint, weight)| {
        let placed = world_from_mesh.get(joint).unwrap_or(&Affine3A::IDENTITY);
        Affine3A {
            matrix3: sum.matrix3 + placed.matrix3 * weight,
            translation: sum.translation + placed.translation * weight,
        }
    })
}

fn placed(placement: &Placement, vertex: &Vertex) -> Vertex {
    let point = placement.world_from_mesh.transform_point3a(Vec3A::from(vertex.position)).to_array();
    let normal = (placement.normals * Vec3A::from(vertex.normal)).try_normalize().map_or(Vec3::Y, Vec3::from);
    Vertex { position: point.map(|c| bounded(c.into())), normal: normal.to_array(), ..*vertex }
}

/// The inverse transpose up to a positive factor, by cofactors: a flattened mesh has normals too.
fn normals_from(linear: Mat3A) -> Mat3A {
    let columns = [linear.x_axis, linear.y_axis, linear.z_axis];
    let largest = columns.iter().fold(f32::MIN_POSITIVE, |most, column| most.max(column.abs().max_element()));
    let [x, y, z] = columns.map(|column| column / largest);
    let side = if x.cross(y).dot(z) < 0.0 { -1.0 } else { 1.0 };
    Mat3A::from_cols(y.cross(z) * side, z.cross(x) * side, x.cross(y) * side)
}

/// A number of a pose that vertices can be computed with: between keys, a spline swings as far as it likes.
fn bounded(value: f64) -> f32 {
    let most = f64::from(MAX_COORDINATE_M);
    if value.is_nan() { 0.0 } else { value.clamp(-most, most) as f32 }
}
