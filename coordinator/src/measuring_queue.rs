//! Measurements that nobody waits for: of costs that were predicted, or measured beside other work.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use cluster::{MeasureCosts, Timeline};
use glam::{Quat, Vec3};

/// Measurements that may wait; the oldest leave.
const CAPACITY: usize = 32;
/// A measurement that was disturbed so often waits for the next session that wants it.
const MOST_DISTURBED: u32 = 3;

/// A measurement on any node of a device.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wanted {
    pub(crate) device: String,
    pub(crate) measurement: MeasureCosts,
    /// How often it has been measured beside other work.
    disturbed: u32,
}

/// Measurements in the order in which they were first wanted.
#[derive(Debug, Default)]
pub(crate) struct MeasuringQueue {
    waiting: VecDeque<Wanted>,
    last_added: Option<Instant>,
}

impl MeasuringQueue {
    /// Adds a measurement, unless it waits already.
    pub(crate) fn add(&mut self, device: &str, measurement: &MeasureCosts) {
        let measurement = MeasureCosts { in_background: true, ..measurement.clone() };
        self.push(Wanted { device: device.to_owned(), measurement, disturbed: 0 });
    }

    /// Adds a measurement that was taken, and made beside other work.
    pub(crate) fn add_again(&mut self, wanted: Wanted) {
        let disturbed = wanted.disturbed + 1;
        if disturbed < MOST_DISTURBED {
            self.push(Wanted { disturbed, ..wanted });
        }
    }

    fn push(&mut self, wanted: Wanted) {
        let key = cache_key(&wanted.measurement);
        let mut waiting = self.waiting.iter();
        if waiting.any(|other| other.device == wanted.device && cache_key(&other.measurement) == key) {
            return;
        }
        if self.waiting.len() >= CAPACITY {
            self.waiting.pop_front();
        }
        self.waiting.push_back(wanted);
        self.last_added = Some(Instant::now());
    }

    /// Whether nothing has been added for so long. What is added is of a session that opens, and begins to ask for views.
    pub(crate) fn is_quiet_for(&self, duration: Duration) -> bool {
        self.last_added.is_none_or(|last| last.elapsed() >= duration)
    }

    /// The devices of all measurements.
    pub(crate) fn devices(&self) -> impl Iterator<Item = &str> {
        self.waiting.iter().map(|wanted| wanted.device.as_str())
    }

    /// Takes the first measurement on a device of which a node is idle.
    pub(crate) fn take(&mut self, is_idle: impl Fn(&str) -> bool) -> Option<Wanted> {
        let first = self.waiting.iter().position(|wanted| is_idle(&wanted.device))?;
        self.waiting.remove(first)
    }
}

/// Costs are those of finished pictures. They depend neither on the scene's time nor, as far as sessions are concerned, on
/// the place of a view.
pub(crate) fn cache_key(measurement: &MeasureCosts) -> MeasureCosts {
    let mut key = measurement.clone();
    key.workload.timeline = Timeline::still(0.0);
    key.workload.refinement_steps = 1;
    key.in_background = false;
    for view in &mut key.typical_views {
        (view.eye_in_world, view.world_from_camera) = (Vec3::ZERO, Quat::IDENTITY);
    }
    key
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;
    use crate::cost_table::tests::measurement;

    fn taken(queue: &mut MeasuringQueue, idle: &str) -> Option<(String, UVec2)> {
        let wanted = queue.take(|device| device == idle)?;
        Some((wanted.device, wanted.measurement.typical_views[0].size_px))
    }

    #[test]
    fn measurements_wait_until_their_device_is_idle() {
        let mut queue = MeasuringQueue::default();
        let [small, large] = [8, 9].map(UVec2::splat);
        queue.add("a", &measurement(small));
        queue.add("b", &measurement(small));
        queue.add("a", &measurement(large));
        queue.add("a", &measurement(small));
        assert_eq!(queue.take(|_| false), None);
        assert_eq!(taken(&mut queue, "a"), Some(("a".to_owned(), small)));
        assert_eq!(taken(&mut queue, "a"), Some(("a".to_owned(), large)), "none waits twice");
        assert_eq!(taken(&mut queue, "a"), None);
        assert_eq!(taken(&mut queue, "b"), Some(("b".to_owned(), small)));
    }

    #[test]
    fn a_measurement_that_is_always_disturbed_is_given_up() {
        let mut queue = MeasuringQueue::default();
        queue.add("a", &measurement(UVec2::splat(8)));
        let mut measured = 0;
        while let Some(wanted) = queue.take(|_| true) {
            measured += 1;
            queue.add_again(wanted);
        }
        assert_eq!(measured, MOST_DISTURBED);
    }

    #[test]
    fn the_oldest_measurements_leave_a_full_queue() {
        let mut queue = MeasuringQueue::default();
        assert!(queue.is_quiet_for(Duration::MAX));
        (1..=10_000).for_each(|side| queue.add("a", &measurement(UVec2::splat(side))));
        assert!(queue.is_quiet_for(Duration::ZERO) && !queue.is_quiet_for(Duration::MAX));
        let sides: Vec<u32> = std::iter::from_fn(|| taken(&mut queue, "a")).map(|(_, size_px)| size_px.x).collect();
        assert_eq!(sides, (9_969..=10_000).collect::<Vec<_>>());
    }
}
