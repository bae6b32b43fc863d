//! Procedural scenes: the paper's tree over a terrain, and others to try the program with.
//!
//! The same arguments give the same scene, bit for bit, on the same build.

mod courtyard;
mod gallery;
mod geometry;
mod grass;
mod mirror_hall;
mod random;
mod snake;
mod teapot;
mod tree;
mod tree_terrain;
mod urban;

pub use courtyard::courtyard;
pub use gallery::gallery;
pub use grass::{GrassDensity, grass};
pub use mirror_hall::mirror_hall;
pub use snake::snake;
pub use tree_terrain::tree_terrain;
pub use urban::urban;

/// What procedural scenes are made of, for the scenes of laboratory and tests in the crate `fixtures`.
pub mod parts {
    pub use super::geometry::{MeshBuilder, Station, ball, checked, checks, matt, mirror, star, vertex};
    pub use super::random::{Noise, Rng, lerp, mix, mixed};
    pub use super::teapot::{Teapot, teapot};
    pub use super::tree::{TreePlan, tree_mesh};
}
