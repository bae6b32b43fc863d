//! Scenes: triangles, materials, lights and wind; import of glTF, OBJ and PLY; procedural scenes;
//! content-hashed packages.
//!
//! World space is right-handed, in metres, +Y up (glTF). Positions are `f32` around
//! [`Scene::origin_in_source`], so that geometry in national-grid coordinates loses no precision.

mod model;

pub use model::*;
