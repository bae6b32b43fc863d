//! The material code that a scene needs.

use scene::{Material, Scene, Wrap};

/// The parts of `rays/material.wgsl` that a scene needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct MaterialSwitches {
    /// Triangles may have holes where their texture is transparent.
    pub alpha_tested: bool,
    /// Some material needs more than the first coordinates of two repeated textures.
    pub mapped: bool,
}

impl MaterialSwitches {
    pub fn of(scene: &Scene) -> Self {
        Self {
            alpha_tested: scene.materials.iter().any(Material::is_alpha_tested),
            mapped: scene.materials.iter().any(|material| {
                let mut textures = material.textures().into_iter().flatten();
                material.is_mapped() || textures.any(|texture| texture.wrap != [Wrap::Repeat; 2])
            }),
        }
    }
}
