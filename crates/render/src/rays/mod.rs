//! Rays against the triangles of a scene.

mod bvh;
pub(crate) mod flat;
pub(crate) mod primary;
mod ray_scene;

pub(crate) use flat::OrderedMesh;
pub use ray_scene::{AccelerationReport, RayScene, Traced};
