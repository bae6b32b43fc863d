//! A node's work since its last report, and the time that it took.

use std::collections::BTreeMap;
use std::sync::Arc;

use cluster::limits::MAX_PROBE_VIEWS;
use cluster::{AuditReport, AuditedView, MeasuredCosts, WorkReport};
use depth_image::PinholeCamera;
use parking_lot::{MappedMutexGuard, Mutex, MutexGuard};

use crate::plan::PlansInForce;
use crate::viewers::Viewers;

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

/// Counts and seconds of each workload, by its number. Clones share them.
#[derive(Debug, Clone, Default)]
pub struct WorkDone(Arc<Mutex<AllWork>>);

#[derive(Debug, Default)]
struct AllWork {
    workloads: BTreeMap<u64, Sums>,
    /// Of all workloads: the next report has them.
    dropped_views: u64,
    viewers: Viewers,
}

/// The work of one workload since the last report.
#[derive(Debug, Clone, PartialEq, Default)]
struct Sums {
    /// Count and seconds of each [`Operation`].
    operations: [(f64, f64); 5],
    /// Bytes of images that were received, and the seconds that this took.
    transferred: (f64, f64),
    /// Count of encoded images, and their bytes.
    encoded: (f64, f64),
    busy_s: f64,
    views: u64,
    audit: AuditReport,
}

impl WorkDone {
    /// Adds `count` operations of a workload that took `seconds` together; the count may be a fraction.
    pub fn add(&self, workload_number: u64, operation: Operation, count: f64, seconds: f64) {
        let mut sums = self.of(workload_number);
        let sum = &mut sums.operations[operation as usize];
        *sum = (sum.0 + count, sum.1 + seconds);
        sums.busy_s += seconds;
        if matches!(operation, Operation::DirectView | Operation::ReconstructView) {
            sums.views += count as u64;
        }
    }

    /// Adds bytes that were received in `seconds`.
    pub fn transferred(&self, workload_number: u64, bytes: usize, seconds: f64) {
        let transferred = &mut self.of(workload_number).transferred;
        *transferred = (transferred.0 + bytes as f64, transferred.1 + seconds);
    }

    /// Adds whole images that were encoded to `bytes` together.
    pub fn encoded(&self, workload_number: u64, images: f64, bytes: usize) {
        let encoded = &mut self.of(workload_number).encoded;
        *encoded = (encoded.0 + images, encoded.1 + bytes as f64);
    }

    /// Adds views that were made while a promise is audited: those that it is for, and others.
    pub fn covered(&self, workload_number: u64, [covered, uncovered]: [u64; 2]) {
        let audit = &mut self.of(workload_number).audit;
        audit.covered_views += covered;
        audit.uncovered_views += uncovered;
    }

    /// Adds an audited view. The first ones of a report count where there are too many.
    pub fn audited(&self, workload_number: u64, view: AuditedView) {
        let audit = &mut self.of(workload_number).audit;
        if audit.views.len() < MAX_PROBE_VIEWS {
            audit.views.push(view);
        }
    }

    fn of(&self, workload_number: u64) -> MappedMutexGuard<'_, Sums> {
        MutexGuard::map(self.0.lock(), |work| work.workloads.entry(workload_number).or_default())
    }

    /// Counts a view that was not made or not sent.
    pub fn dropped(&self) {
        self.0.lock().dropped_views += 1;
    }

    /// The newest pose of a live stream, by the stream's number.
    pub fn viewer_moved(&self, stream: u64, workload_number: u64, camera: PinholeCamera) {
        self.0.lock().viewers.moved(stream, workload_number, camera);
    }

    /// A live stream has ended.
    pub fn viewer_left(&self, stream: u64) {
        self.0.lock().viewers.left(stream);
    }

    /// Takes the work and the movements since the last call, of each workload that has a plan in force.
    pub(crate) fn take_reports(&self, plans: &PlansInForce) -> Vec<WorkReport> {
        let mut work = self.0.lock();
        let mut workloads = std::mem::take(&mut work.workloads);
        for workload_number in work.viewers.take_changed() {
            workloads.entry(workload_number).or_default();
        }
        let reports = workloads.into_iter().filter_map(|(workload_number, sums)| {
            let plan = plans.in_force(workload_number)?;
            let audit = &sums.audit;
            let is_audited = !audit.views.is_empty() || audit.covered_views > 0 || audit.uncovered_views > 0;
            Some(WorkReport {
                node_name: plans.node_name.to_string(),
                plan_epoch: plan.plan_epoch,
                workload_number,
                costs: sums.costs(),
                busy_s: sums.busy_s,
                views: sums.views,
                dropped_views: std::mem::take(&mut work.dropped_views),
                viewpoints: work.viewers.of(workload_number),
                audit: is_audited.then_some(sums.audit),
            })
        });
        reports.collect()
    }
}

impl Sums {
    /// The mean time of each operation; `None` where it was not done.
    fn costs(&self) -> MeasuredCosts {
        // In the order of the operations' variants.
        let [sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s] =
            self.operations.map(|(count, seconds)| quotient(count, seconds));
        let (images, bytes) = self.encoded;
        let (received, seconds) = self.transferred;
        MeasuredCosts {
            sample_image_s,
            direct_view_s,
            reconstruct_view_s,
            load_set_s,
            encode_view_s,
            transfer_bytes_per_s: quotient(seconds, received),
            image_bytes: quotient(images, bytes),
        }
    }
}

/// The sum divided by the count; `None` for a count of 0.
fn quotient(count: f64, sum: f64) -> Option<f64> {
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plans(workloads: u64) -> PlansInForce {
        let plans = PlansInForce::new("n");
        (1..=workloads).for_each(|number| {
            drop(plans.apply(crate::plan::tests::alone(crate::plan::tests::plan(number, 6 + number))).unwrap())
        });
        plans
    }

    #[test]
    fn costs_are_the_means_since_the_last_report() {
        let done = WorkDone::default();
        let plans = plans(1);
        assert!(done.take_reports(&plans).is_empty());
        done.add(1, Operation::ReconstructView, 32.0, 0.32);
        done.clone().add(1, Operation::ReconstructView, 8.0, 0.48);
        done.add(1, Operation::SampleImage, 0.25, 0.1);
        done.transferred(1, 1 << 20, 0.5);
        done.encoded(1, 0.5, 1000);
        done.dropped();
        let [report] = &done.take_reports(&plans)[..] else { panic!("one workload") };
        let costs = report.costs;
        assert_eq!((report.node_name.as_str(), report.plan_epoch, report.workload_number), ("n", 7, 1));
        assert_eq!(costs.reconstruct_view_s, Some(0.02));
        assert_eq!(costs.sample_image_s, Some(0.4), "a quarter of an image in 0.1 s");
        assert_eq!(costs.transfer_bytes_per_s, Some(2.0 * 1024.0 * 1024.0));
        assert_eq!((costs.image_bytes, costs.direct_view_s, costs.load_set_s), (Some(2000.0), None, None));
        assert_eq!((report.views, report.dropped_views), (40, 1));
        assert!((report.busy_s - 0.9).abs() < 1e-12);
        assert!(done.take_reports(&plans).is_empty());
    }

    #[test]
    fn the_work_of_each_workload_is_reported_alone() {
        let done = WorkDone::default();
        let plans = plans(2);
        done.dropped();
        assert!(done.take_reports(&plans).is_empty());
        for (number, seconds) in [(1, 1.0), (2, 2.0), (3, 3.0)] {
            done.add(number, Operation::ReconstructView, 1.0, seconds);
        }
        let reports = done.take_reports(&plans);
        let parts =
            |report: &WorkReport| (report.workload_number, report.plan_epoch, report.busy_s, report.dropped_views);
        assert_eq!(reports.iter().map(parts).collect::<Vec<_>>(), [(1, 7, 1.0, 1), (2, 8, 2.0, 0)]);
    }
}
