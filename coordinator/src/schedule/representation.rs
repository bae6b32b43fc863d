//! The way to make a workload's views that its budget has chosen.

use cluster::{Costs, PolicyChoice, SamplePlanes, TileCosts};
use planner::{Row, RowCosts};

use super::PolicyOverride;

/// A row in force.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Representation {
    pub(super) row: Row,
    /// As measured for the workload's first session.
    costs: Costs,
    /// Planes of sample images that its method needs.
    pub(super) planes: SamplePlanes,
}

impl Representation {
    /// A row with its measured costs, beside the costs of what sessions ask for.
    pub(super) fn new(row: Row, measured: &RowCosts, planes: SamplePlanes, asked: &Costs) -> Self {
        let costs = match &row {
            Row::Samples { .. } => Costs {
                sample_image_s: measured.sample_image_s,
                load_set_s: measured.load_set_s,
                reconstruct_view_s: measured.view_s,
                // Rows of images cost as much in relation to each other.
                tiles: asked
                    .tiles
                    .and_then(|tiles| TileCosts::of_image(measured.sample_image_s, tiles.overhead_s, tiles.row_shares)),
                ..*asked
            },
            Row::Direct { .. } => Costs { direct_view_s: measured.view_s, ..*asked },
        };
        Self { row, costs, planes }
    }

    /// How views are reconstructed; `None` where they are drawn from the scene.
    pub(super) fn method(&self) -> Option<&String> {
        match &self.row {
            Row::Samples { method, .. } => Some(method),
            Row::Direct { .. } => None,
        }
    }

    /// The costs of sessions whose own way to make views costs `asked`: encoding is their own and, beside samples, drawing
    /// directly.
    pub(super) fn costs(&self, asked: &Costs) -> Costs {
        let direct_view_s = if self.method().is_some() { asked.direct_view_s } else { self.costs.direct_view_s };
        Costs { direct_view_s, encode_view_s: asked.encode_view_s, ..self.costs }
    }

    /// Decisions of sessions, and the policy that the row leaves.
    pub(super) fn policy_override(&self, asked: PolicyOverride) -> PolicyOverride {
        match (&self.row, asked.policy) {
            (Row::Direct { .. }, PolicyChoice::Auto) => {
                PolicyOverride { policy: PolicyChoice::Direct, ..PolicyOverride::default() }
            }
            _ => asked,
        }
    }
}
