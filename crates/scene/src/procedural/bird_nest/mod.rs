//! A stadium within a nest of steel: several layers of beams before stands.
//!
//! It follows the model of the Beijing National Stadium in Xie, Wang and Popescu's *Non-redundant rendering*, table 1.
//! It has the plan, the saddle and the three orders of beams; no drawing of it was at hand.

mod bowl;
mod lattice;
mod shell;

use glam::Vec3;

use super::geometry::{MeshBuilder, matt};
use crate::{Environment, Scene};

/// Number of triangles of the model in the paper's table 1.
const TRIANGLES: u32 = 67_000;

/// A stadium of 332 m × 296 m around the origin, 42 m to 68 m high, on ground at y = 0: 67,000 triangles.
#[must_use]
pub fn bird_nest() -> Scene {
    let mut builder = MeshBuilder::default();
    bowl::add_ground(&mut builder);
    builder.finish_part(0);
    bowl::add(&mut builder);
    builder.finish_part(1);
    lattice::add(&mut builder, TRIANGLES);
    builder.finish_part(2);
    let scene = builder.into_scene_of("bird-nest", vec![matt("ground"), matt("bowl"), matt("steel")]);
    Scene { background: Environment::uniform(Vec3::new(0.50, 0.60, 0.74)), ..scene }
}
