//! Procedural scenes: the paper's tree over a terrain, and others to try the program with.
//!
//! The same arguments give the same scene, bit for bit, on the same build.

mod courtyard;
mod gallery;
mod geometry;
mod grass;
mod mirror_hall;
pub mod parts;
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
