//! Procedural scenes: the paper's tree over a terrain, the scenes of *Non-redundant rendering*, and small ones in
//! closed form for tests.
//!
//! The same arguments give the same scene, bit for bit, on the same build.

mod bird_nest;
mod blocks;
mod gallery;
mod geometry;
mod glossy_floor;
mod grass;
mod lone_tree;
mod mirrors;
mod random;
mod shapes;
mod snake;
mod teapot;
mod terrain;
mod tree;
mod tree_terrain;
mod urban;

pub use bird_nest::bird_nest;
pub use blocks::{BlocksViewpoints, blocks, blocks_viewpoints};
pub use gallery::gallery;
pub use glossy_floor::{teapot_floor, teapot_spheres};
pub use grass::{GrassDensity, grass};
pub use lone_tree::lone_tree;
pub use mirrors::{mirror_box, mirror_hall, mirror_pair, teapot_mirror};
pub use shapes::{checker_sphere, courtyard, poles, quad, unit_cube, uv_sphere};
pub use snake::snake;
pub use tree_terrain::tree_terrain;
pub use urban::urban;

use glam::Vec3;

use crate::Scene;

/// The scene of one of [`crate::BUILT_IN_NAMES`], with its default arguments; the cube for any other name.
pub(crate) fn by_name(name: &str) -> Scene {
    match name {
        "quad" => quad(Vec3::ZERO, 0.5, Vec3::Z, [200, 120, 60]),
        "uv-sphere" => uv_sphere(1.0, 48),
        "checker-sphere" => checker_sphere(),
        "poles" => poles(0.02),
        "courtyard" => courtyard(),
        "blocks" => blocks(),
        "bird-nest" => bird_nest(),
        "urban" => urban(),
        "gallery" => gallery(),
        "tree" => lone_tree(),
        "snake" => snake(),
        "teapot-mirror" => teapot_mirror(),
        "mirror-pair" => mirror_pair(),
        "mirror-hall" => mirror_hall(),
        "mirror-box" => mirror_box(),
        "teapot-floor" => teapot_floor(),
        "teapot-spheres" => teapot_spheres(),
        _ => unit_cube(),
    }
}
