//! Processor time of a group.

/// Processor time of a group, since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Usage {
    /// Seconds of one core.
    pub cpu_s: f64,
    pub periods: u64,
    /// Periods in which the group used up its quota and was stopped.
    pub throttled: u64,
}

impl Usage {
    /// The difference of two readings.
    #[must_use]
    pub fn since(&self, before: &Self) -> Self {
        Self {
            cpu_s: self.cpu_s - before.cpu_s,
            periods: self.periods.saturating_sub(before.periods),
            throttled: self.throttled.saturating_sub(before.throttled),
        }
    }
}
