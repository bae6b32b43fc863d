//! The switches of `rays/traverse.wgsl`, and the numbers that it shares with its scalar twin.

use minijinja::{Value, context};

use super::ray_scene::Traced;

/// Boxes are left a little later than they are: what rounding takes off must not open a gap.
pub(crate) const BOX_SLACK: f32 = 1.000_001;
/// A few roundings of the products that a volume is a sum of: what is nearer to an edge may be on either side.
pub(crate) const EDGE_ROUNDINGS: f32 = 4e-7;

/// The switches of a traversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Traversal {
    /// Room for unvisited nodes.
    stack: u32,
    /// Triangles may have holes where their texture is transparent.
    alpha_tested: bool,
}

impl Traversal {
    pub const ALL: [Self; 2] = [Self { stack: 16, alpha_tested: false }, Self { stack: 16, alpha_tested: true }];

    /// Room on the stack comes in steps, so that pipelines are shared.
    pub fn of(traced: &Traced) -> Self {
        Self { stack: traced.report.depth.next_multiple_of(8).max(1), alpha_tested: traced.alpha_tested }
    }

    pub fn context(self) -> Value {
        context! { stack => self.stack, alpha_tested => self.alpha_tested }
    }
}
