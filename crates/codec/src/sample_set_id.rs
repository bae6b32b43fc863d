//! Names of sample sets.

use std::fmt;

/// Names scene time, cameras and lighting of a set of sample images. Later sets compare greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct SampleSetId {
    /// The plan that asked for it.
    pub plan_epoch: u64,
    /// Counts the sets of one plan.
    pub index: u64,
}

impl fmt::Display for SampleSetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.plan_epoch, self.index)
    }
}
