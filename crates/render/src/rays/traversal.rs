//! The switches of `rays/traverse.wgsl`, and the numbers that it shares with its scalar twin.

use depth_image::Highlight;
use gpu::highlight_name;
use minijinja::{Value, context};
use scene::{Material, Scene, Wrap};

/// Boxes are left a little later than they are: what rounding takes off must not open a gap.
pub(crate) const BOX_SLACK: f32 = 1.000_001;
/// A few roundings of the products that a volume is a sum of: what is nearer to an edge may be on either side.
pub(crate) const EDGE_ROUNDINGS: f32 = 4e-7;

/// The switches of a traversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(crate) struct Traversal {
    /// Room for unvisited nodes, in steps, so that pipelines are shared.
    pub stack: u32,
    /// Triangles may have holes where their texture is transparent.
    pub alpha_tested: bool,
    /// Some material needs more than the first coordinates of two repeated textures.
    pub mapped: bool,
    /// Light goes through some triangles.
    pub glass: bool,
}

impl Traversal {
    pub const ALL: [Self; 5] = [
        Self { stack: 16, alpha_tested: false, mapped: false, glass: false },
        Self { stack: 16, alpha_tested: true, mapped: false, glass: false },
        Self { stack: 16, alpha_tested: true, mapped: true, glass: false },
        Self { stack: 16, alpha_tested: false, mapped: false, glass: true },
        Self { stack: 16, alpha_tested: true, mapped: true, glass: true },
    ];

    /// The switches of a scene, without a stack as yet.
    pub fn new(scene: &Scene) -> Self {
        Self {
            stack: 0,
            alpha_tested: scene.materials.iter().any(Material::is_alpha_tested),
            mapped: scene.materials.iter().any(|material| {
                let mut textures = material.textures().into_iter().flatten();
                material.is_mapped() || textures.any(|texture| texture.wrap != [Wrap::Repeat; 2])
            }),
            glass: scene.materials.iter().any(Material::is_transmissive),
        }
    }

    /// The switches for a tree with so many levels.
    pub fn with_depth(self, depth: u32) -> Self {
        Self { stack: depth.next_multiple_of(8).max(1), ..self }
    }

    pub fn context(self) -> Value {
        let Self { stack, alpha_tested, mapped, glass } = self;
        context! { stack, alpha_tested, mapped, glass }
    }

    /// The values of shaders that follow rays off mirrors.
    pub fn context_of_mirrored_rays(self) -> Value {
        context! { primary => true, from_eye => false, shading => highlight_name(Highlight::Ggx), ..self.context() }
    }
}
