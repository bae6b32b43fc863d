//! The representation that a budget has chosen for a workload.

use cluster::{Costs, PolicyChoice, SamplePlanes};
use planner::Row;

use super::PolicyOverride;

/// A representation in force.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Representation {
    /// A row of the ladder.
    Row {
        row: Row,
        /// As measured for the workload's first session; those of drawing directly and encoding depend on sessions.
        costs: Costs,
        /// Planes of sample images that its method needs.
        planes: SamplePlanes,
    },
    /// Every view is drawn from the scene.
    Direct,
}

impl Representation {
    pub(super) fn row(&self) -> Option<&Row> {
        match self {
            Self::Row { row, .. } => Some(row),
            Self::Direct => None,
        }
    }

    /// The costs of sessions whose own representation costs `asked`.
    pub(super) fn costs(&self, asked: &Costs) -> Costs {
        match self {
            Self::Row { costs, .. } => {
                Costs { direct_view_s: asked.direct_view_s, encode_view_s: asked.encode_view_s, ..*costs }
            }
            Self::Direct => *asked,
        }
    }

    /// Decisions of sessions, and the policy that the representation leaves.
    pub(super) fn policy_override(&self, asked: PolicyOverride) -> PolicyOverride {
        match (self, asked.policy) {
            (Self::Direct, PolicyChoice::Auto) => {
                PolicyOverride { policy: PolicyChoice::Direct, ..PolicyOverride::default() }
            }
            _ => asked,
        }
    }
}
