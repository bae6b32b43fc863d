//! The use of a texture by a material.

use serde::{Deserialize, Serialize};

/// A texture as a material uses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TextureUse {
    /// Index into [`crate::Scene::textures`].
    pub texture: u32,
    /// The coordinates are the second pair: [`crate::VertexDetail::uv`].
    pub second_uv: bool,
    /// The texture beyond its borders, along u and v.
    pub wrap: [Wrap; 2],
}

/// A texture beyond its borders, along one axis. The numbers are those of shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub enum Wrap {
    /// It begins again.
    #[default]
    Repeat = 0,
    /// It runs back and forth.
    Mirror = 1,
    /// Its border goes on.
    Clamp = 2,
}

/// The first pair of coordinates, repeated along both axes.
impl From<u32> for TextureUse {
    fn from(texture: u32) -> Self {
        Self { texture, second_uv: false, wrap: [Wrap::Repeat; 2] }
    }
}
