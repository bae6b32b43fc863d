//! Measured costs, kept for sessions that ask for the same.

use cluster::{MeasureCosts, Measured, Timeline};
use glam::{Quat, Vec3};
use parking_lot::Mutex;

/// The number of measurements that are kept.
const CAPACITY: usize = 16;

/// Costs by device and measurement, the oldest first.
#[derive(Default)]
pub(crate) struct CostCache(Mutex<Vec<(String, MeasureCosts, Measured)>>);

impl CostCache {
    pub(crate) fn get(&self, device: &str, measurement: &MeasureCosts) -> Option<Measured> {
        let key = cache_key(measurement);
        self.0.lock().iter().find(|(of, kept, _)| of == device && *kept == key).map(|(.., measured)| *measured)
    }

    /// Keeps costs; the oldest are evicted.
    pub(crate) fn insert(&self, device: String, measurement: &MeasureCosts, measured: Measured) {
        let mut kept = self.0.lock();
        if kept.len() >= CAPACITY {
            kept.remove(0);
        }
        kept.push((device, cache_key(measurement), measured));
    }
}

/// Costs are those of finished pictures. They depend neither on the scene's time nor, as far as sessions are concerned, on
/// the place of a view.
fn cache_key(measurement: &MeasureCosts) -> MeasureCosts {
    let mut key = measurement.clone();
    key.workload.timeline = Timeline::still(0.0);
    key.workload.refinement_steps = 1;
    for view in &mut key.typical_views {
        (view.eye_in_world, view.world_from_camera) = (Vec3::ZERO, Quat::IDENTITY);
    }
    key
}
