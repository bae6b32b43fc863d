//! Reports of nodes on their own work, and on each other.

use serde::{Deserialize, Serialize};

use crate::check::{finite_seconds, nonempty, reason};
use crate::costs::MeasuredCosts;
use crate::error::InvalidField;

/// The work of a member since its last report.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkReport {
    /// The member's unique name.
    pub node_name: String,
    /// The plan under which the work was done.
    pub plan_epoch: u64,
    /// Mean times of the operations.
    pub costs: MeasuredCosts,
    /// Seconds of all operations together.
    pub busy_s: f64,
    /// Views made.
    pub views: u64,
    /// Views not made, or not sent.
    pub dropped_views: u64,
}

impl WorkReport {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.node_name, "node_name")?;
        self.costs.validate()?;
        finite_seconds(self.busy_s, "busy_s").map(drop)
    }
}

/// A compositor cannot get images of a sampler, though it asked again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SamplerReport {
    /// The plan in which both have their roles.
    pub plan_epoch: u64,
    /// The compositor that reports.
    pub compositor: String,
    /// The sampler that is reported.
    pub sampler: String,
    /// Why it gets no images.
    pub reason: String,
}

impl SamplerReport {
    /// # Errors
    /// For names that are missing or too long, and for a long reason.
    pub fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.compositor, "compositor_name")?;
        nonempty(&self.sampler, "sampler_name")?;
        reason(&self.reason, "reason")
    }
}
