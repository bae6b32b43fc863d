//! Work on a device: its place among other work, and how far its light is refined.

use std::sync::atomic::{AtomicU64, Ordering};

/// The urgency of work on a device, which the nodes of a process share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum WorkClass {
    /// Somebody watches.
    Live,
    /// Somebody waits.
    #[default]
    Batch,
    /// Nobody waits, such as for a measurement.
    Background,
}

impl WorkClass {
    /// The number of classes.
    pub const COUNT: usize = 3;
}

/// Work's place in the order of its device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Turn {
    /// A higher class goes first.
    pub class: WorkClass,
    /// Flows of a class share the device's time evenly. Numbers come from [`Turn::next_flow`].
    pub flow: u64,
}

impl Turn {
    /// The flow of all work without one of its own.
    pub const COMMON_FLOW: u64 = 0;

    /// The number of a new flow, which is no other flow's in this process.
    #[must_use]
    pub fn next_flow() -> u64 {
        static LAST: AtomicU64 = AtomicU64::new(Turn::COMMON_FLOW);
        LAST.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Work of a class in the common flow.
    #[must_use]
    pub const fn of(class: WorkClass) -> Self {
        Self { class, flow: Self::COMMON_FLOW }
    }
}

/// A step on the way to all rays of a lighting; every step doubles them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Refinement {
    /// From 0 to `steps - 1`, with which all rays have been traced.
    pub step: u32,
    /// At least 1. With only one, nothing is kept from before or for later.
    pub steps: u32,
}

impl Default for Refinement {
    /// Full quality at once.
    fn default() -> Self {
        Self { step: 0, steps: 1 }
    }
}

impl Refinement {
    /// The number of `rays` that have been traced with this step.
    #[must_use]
    pub fn share_of(self, rays: u32) -> u32 {
        let to_go = self.steps.saturating_sub(self.step + 1).min(31);
        rays.div_ceil(1 << to_go)
    }

    /// Whether sums are kept for the next step.
    #[must_use]
    pub fn goes_on(self) -> bool {
        self.step + 1 < self.steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_step_doubles_the_rays_and_the_last_has_all() {
        let counts = |rays: u32, steps: u32| -> Vec<u32> {
            (0..steps).map(|step| Refinement { step, steps }.share_of(rays)).collect()
        };
        assert_eq!(counts(16, 5), [1, 2, 4, 8, 16]);
        assert_eq!(counts(1, 5), [1, 1, 1, 1, 1]);
        assert_eq!(counts(12, 3), [3, 6, 12]);
        assert_eq!(counts(0, 2), [0, 0]);
        assert_eq!(Refinement::default().share_of(7), 7);
    }
}
