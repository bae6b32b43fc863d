//! A node's work since its last report, and the time that it took.

use std::sync::Arc;

use cluster::{MeasuredCosts, WorkReport};
use parking_lot::Mutex;

/// An operation that is timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    /// g_s: one sample image, whole. A tile counts as its part of one.
    SampleImage,
    /// g_v: one view drawn directly.
    DirectView,
    /// c: one view reconstructed.
    ReconstructView,
    /// d: one set decoded and uploaded.
    LoadSet,
    /// e: one view encoded.
    EncodeView,
}

/// Counts and seconds. Clones share them.
#[derive(Debug, Clone, Default)]
pub struct WorkDone(Arc<Mutex<Sums>>);

/// The work since the last report.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sums {
    /// Count and seconds of each [`Operation`].
    operations: [(f64, f64); 5],
    /// Bytes of images that were received, and the seconds that this took.
    transferred: (f64, f64),
    /// Count of encoded images, and their bytes.
    encoded: (f64, f64),
    busy_s: f64,
    views: u64,
    dropped_views: u64,
}

impl WorkDone {
    /// Adds `count` operations that took `seconds` together; the count may be a fraction.
    pub fn add(&self, operation: Operation, count: f64, seconds: f64) {
        let sums = &mut *self.0.lock();
        let sum = &mut sums.operations[operation as usize];
        *sum = (sum.0 + count, sum.1 + seconds);
        sums.busy_s += seconds;
        if matches!(operation, Operation::DirectView | Operation::ReconstructView) {
            sums.views += count as u64;
        }
    }

    /// Adds bytes that were received in `seconds`.
    pub fn transferred(&self, bytes: usize, seconds: f64) {
        let sum = &mut self.0.lock().transferred;
        *sum = (sum.0 + bytes as f64, sum.1 + seconds);
    }

    /// Adds whole images that were encoded to `bytes` together.
    pub fn encoded(&self, images: f64, bytes: usize) {
        let sum = &mut self.0.lock().encoded;
        *sum = (sum.0 + images, sum.1 + bytes as f64);
    }

    /// Counts a view that was not made or not sent.
    pub fn dropped(&self) {
        self.0.lock().dropped_views += 1;
    }

    /// Takes the work since the last call; `None` where there is none.
    pub(crate) fn take_report(&self, node_name: &str, plan_epoch: u64) -> Option<WorkReport> {
        let sums = std::mem::take(&mut *self.0.lock());
        (sums != Sums::default()).then(|| WorkReport {
            node_name: node_name.to_owned(),
            plan_epoch,
            workload_number: 0,
            costs: sums.costs(),
            busy_s: sums.busy_s,
            views: sums.views,
            dropped_views: sums.dropped_views,
        })
    }
}

impl Sums {
    /// The mean time of each operation; `None` where it was not done.
    fn costs(&self) -> MeasuredCosts {
        let mean = |operation: Operation| quotient(self.operations[operation as usize]);
        let (images, bytes) = self.encoded;
        let (received, seconds) = self.transferred;
        MeasuredCosts {
            sample_image_s: mean(Operation::SampleImage),
            direct_view_s: mean(Operation::DirectView),
            reconstruct_view_s: mean(Operation::ReconstructView),
            load_set_s: mean(Operation::LoadSet),
            encode_view_s: mean(Operation::EncodeView),
            transfer_bytes_per_s: quotient((seconds, received)),
            image_bytes: quotient((images, bytes)),
        }
    }
}

/// The sum divided by the count; `None` for a count of 0.
fn quotient((count, sum): (f64, f64)) -> Option<f64> {
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_the_means_since_the_last_report() {
        let done = WorkDone::default();
        assert!(done.take_report("n", 7).is_none());
        done.add(Operation::ReconstructView, 32.0, 0.32);
        done.clone().add(Operation::ReconstructView, 8.0, 0.48);
        done.add(Operation::SampleImage, 0.25, 0.1);
        done.transferred(1 << 20, 0.5);
        done.encoded(0.5, 1000);
        done.dropped();
        let report = done.take_report("n", 7).unwrap();
        let costs = report.costs;
        assert_eq!(costs.reconstruct_view_s, Some(0.02));
        assert_eq!(costs.sample_image_s, Some(0.4), "a quarter of an image in 0.1 s");
        assert_eq!(costs.transfer_bytes_per_s, Some(2.0 * 1024.0 * 1024.0));
        assert_eq!((costs.image_bytes, costs.direct_view_s, costs.load_set_s), (Some(2000.0), None, None));
        assert_eq!((report.views, report.dropped_views), (40, 1));
        assert!((report.busy_s - 0.9).abs() < 1e-12);
        assert!(done.take_report("n", 7).is_none());
    }
}
