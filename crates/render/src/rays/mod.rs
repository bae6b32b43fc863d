//! Rays against the triangles of a scene.

mod bvh;
pub(crate) mod flat;
pub(crate) mod primary;
pub(crate) mod ray_scene;
pub(crate) mod traversal;

pub(crate) use flat::OrderedMesh;
pub use ray_scene::AccelerationReport;
pub(crate) use ray_scene::{RayScene, Traced};
pub(crate) use traversal::Traversal;
