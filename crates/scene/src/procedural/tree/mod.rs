//! A broad-leaved tree: a skeleton of branches, tubes around it, and leaves on its twigs.

mod bark;
mod leaves;
mod skeleton;

use glam::Vec3;

use super::mesh_builder::MeshBuilder;
use crate::Mesh;
use skeleton::Skeleton;

/// Greatest share of the triangles for the bark; leaves take the rest.
const BARK_SHARE: f32 = 0.42;

pub(super) struct TreePlan {
    pub foot_in_world: Vec3,
    pub height_m: f32,
    pub triangles: u32,
    pub bark_material: u32,
    pub leaf_material: u32,
}

/// Adds the tree in world space. Its shape depends on the seed only, its detail on the number of triangles.
pub(super) fn tree_mesh(plan: &TreePlan, seed: u64) -> Mesh {
    let skeleton = Skeleton::grown(seed).fitted(plan.foot_in_world, plan.height_m);
    let mut builder = MeshBuilder::default();
    bark::add(&mut builder, &skeleton, (plan.triangles as f32 * BARK_SHARE) as u32, seed);
    builder.finish_part(plan.bark_material);
    let left = plan.triangles.saturating_sub(builder.indices.len() as u32 / 3);
    leaves::add(&mut builder, &skeleton, left, seed);
    builder.finish_part(plan.leaf_material);
    builder.into_mesh()
}
