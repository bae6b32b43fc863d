//! The switches of `rays/traverse.wgsl`, and the numbers that it shares with its scalar twin.

use depth_image::Highlight;
use gpu::highlight_name;
use minijinja::{Value, context};

use super::{material_switches::MaterialSwitches, ray_scene::Traced};

/// Boxes are left a little later than they are: what rounding takes off must not open a gap.
pub(crate) const BOX_SLACK: f32 = 1.000_001;
/// A few roundings of the products that a volume is a sum of: what is nearer to an edge may be on either side.
pub(crate) const EDGE_ROUNDINGS: f32 = 4e-7;

/// The switches of a traversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Traversal {
    /// Room for unvisited nodes.
    stack: u32,
    materials: MaterialSwitches,
}

impl Traversal {
    pub const ALL: [Self; 3] = [Self::with(false, false), Self::with(true, false), Self::with(true, true)];

    const fn with(alpha_tested: bool, mapped: bool) -> Self {
        Self { stack: 16, materials: MaterialSwitches { alpha_tested, mapped } }
    }

    /// Room on the stack comes in steps, so that pipelines are shared.
    pub fn of(traced: &Traced) -> Self {
        Self { stack: traced.report.depth.next_multiple_of(8).max(1), materials: traced.switches }
    }

    pub fn context(self) -> Value {
        let MaterialSwitches { alpha_tested, mapped } = self.materials;
        context! { stack => self.stack, alpha_tested, mapped }
    }

    /// The values of shaders that follow rays off mirrors.
    pub fn context_of_mirrored_rays(self) -> Value {
        context! { primary => true, from_eye => false, shading => highlight_name(Highlight::Ggx), ..self.context() }
    }
}
