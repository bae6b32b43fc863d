//! A broad-leaved tree: a skeleton of branches, tubes around it, and leaves on its twigs.
//!
//! Branches grow by recursion, after Weber and Penn (1995). Each bears shorter ones along its length, turned by the golden
//! angle. All bend towards the light and under their own weight.

mod bark;
mod leaves;
mod skeleton;

use glam::Vec3;

use super::parts::MeshBuilder;
use crate::Mesh;
use skeleton::Skeleton;

/// Greatest share of the triangles for the bark; leaves take the rest.
const BARK_SHARE: f32 = 0.42;

/// Place, height and detail of a tree.
#[allow(missing_docs, reason = "self-naming fields")]
pub struct TreePlan {
    pub foot_in_world: Vec3,
    pub height_m: f32,
    pub triangles: u32,
}

/// The tree in world space: bark of material 1, leaves of material 2, as the ground of its scenes has 0. Its shape depends on the seed only, its detail on the number of triangles.
#[must_use]
pub fn tree_mesh(plan: &TreePlan, seed: u64) -> Mesh {
    let skeleton = Skeleton::grown(seed).fitted(plan.foot_in_world, plan.height_m);
    let mut builder = MeshBuilder::default();
    bark::add(&mut builder, &skeleton, (plan.triangles as f32 * BARK_SHARE) as u32, seed);
    builder.finish_part(1);
    let left = plan.triangles.saturating_sub(builder.triangle_count());
    leaves::add(&mut builder, &skeleton, left, seed);
    builder.finish_part(2);
    builder.into_mesh()
}
