//! What procedural scenes are made of, for the scenes of laboratory and tests in the crate `fixtures`.

pub use super::geometry::{MeshBuilder, Station, ball, checked, checks, matt, mirror, star, vertex};
pub use super::random::{Noise, Rng, lerp, mix, mixed};
pub use super::teapot::{Teapot, teapot};
pub use super::tree::{TreePlan, tree_mesh};
