//! Fault attribution: whether the sampler or the compositor is at fault when a compositor cannot get a sampler's images.
//!
//! A report alone proves nothing. It counts against the sampler when a second compositor reports the same sampler, or when
//! the coordinator's own probe of that sampler fails. A report whose probe passes counts against the compositor: after
//! [`REFUTED_LIMIT`] refuted reports within [`WINDOW`] the compositor is the one that is cut off. Reports of a sampler that
//! turns out to be at fault are dropped, so that they never count against those that made them. Reports of different
//! workloads have nothing to do with each other: what a session asks for may be the fault.

use std::time::Duration;

use cluster::SamplerReport;

/// Reports further apart have causes of their own.
const WINDOW: Duration = Duration::from_secs(60);
/// Refuted reports of one compositor that quarantine it.
const REFUTED_LIMIT: usize = 2;

/// Reports of the last minute.
#[derive(Debug, Clone, Default)]
pub(super) struct SamplerReports(Vec<Filed>);

#[derive(Debug, Clone)]
struct Filed {
    at: Duration,
    workload: u64,
    compositor: String,
    sampler: String,
    reason: String,
    /// A probe of the sampler has passed since.
    is_refuted: bool,
}

impl Filed {
    fn is_about(&self, workload: u64, sampler: &str) -> bool {
        self.workload == workload && self.sampler == sampler
    }
}

impl SamplerReports {
    /// Files a report; whether another compositor agrees, so that the sampler is at fault. Else it has to be probed.
    pub(super) fn file(&mut self, now: Duration, workload: u64, report: SamplerReport) -> bool {
        self.0.retain(|filed| now.saturating_sub(filed.at) < WINDOW);
        let SamplerReport { compositor, sampler, reason, .. } = report;
        let agrees = self.0.iter().any(|filed| filed.is_about(workload, &sampler) && filed.compositor != compositor);
        // One probe answers all reports before it.
        self.0
            .retain(|filed| filed.is_refuted || !filed.is_about(workload, &sampler) || filed.compositor != compositor);
        self.0.push(Filed { at: now, workload, compositor, sampler, reason, is_refuted: false });
        agrees
    }

    /// A probe of the sampler has passed. Gives the compositors that are now at fault, and the reasons of their reports.
    pub(super) fn refute(&mut self, workload: u64, sampler: &str) -> Vec<(String, String)> {
        let mut at_fault = Vec::new();
        for filed in self.0.iter_mut().filter(|filed| filed.is_about(workload, sampler) && !filed.is_refuted) {
            filed.is_refuted = true;
            at_fault.push((filed.compositor.clone(), filed.reason.clone()));
        }
        at_fault.retain(|(compositor, _)| {
            let own = self.0.iter().filter(|filed| filed.workload == workload && filed.compositor == *compositor);
            own.filter(|filed| filed.is_refuted).count() >= REFUTED_LIMIT
        });
        at_fault
    }

    /// Reports on file of a sampler: the number of the image that is probed next.
    pub(super) fn count_of(&self, workload: u64, sampler: &str) -> usize {
        self.0.iter().filter(|filed| filed.is_about(workload, sampler)).count()
    }

    /// A node is quarantined, from one workload or from all: neither reports of it nor by it count any more.
    pub(super) fn forget(&mut self, workload: Option<u64>, node_name: &str) {
        self.0.retain(|filed| {
            let is_of_another = workload.is_some_and(|number| number != filed.workload);
            is_of_another || (filed.sampler != node_name && filed.compositor != node_name)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(compositor: &str, sampler: &str) -> SamplerReport {
        SamplerReport {
            plan_epoch: 1,
            compositor: compositor.to_owned(),
            sampler: sampler.to_owned(),
            reason: "no images".to_owned(),
        }
    }

    const START: Duration = Duration::ZERO;

    #[test]
    fn a_second_compositor_convicts_the_sampler_and_a_repeated_report_does_not() {
        let mut reports = SamplerReports::default();
        assert!(!reports.file(START, 1, report("c", "a")));
        assert!(!reports.file(START, 1, report("c", "a")), "the same compositor again");
        assert!(!reports.file(START, 1, report("d", "b")), "another sampler");
        assert!(reports.file(START, 1, report("d", "a")));
        assert!(!SamplerReports::default().file(START, 1, report("d", "a")));
    }

    #[test]
    fn reports_a_minute_apart_do_not_agree() {
        let mut reports = SamplerReports::default();
        reports.file(START, 1, report("c", "a"));
        assert!(!reports.file(START + WINDOW, 1, report("d", "a")));
    }

    #[test]
    fn two_refuted_reports_convict_the_compositor() {
        let mut reports = SamplerReports::default();
        reports.file(START, 1, report("c", "a"));
        reports.file(START, 1, report("c", "a"));
        assert_eq!(reports.refute(1, "a"), [], "one probe answers both");
        assert_eq!(reports.refute(1, "a"), [], "a report is refuted once");
        reports.file(START, 1, report("c", "b"));
        assert_eq!(reports.refute(1, "b"), [("c".to_owned(), "no images".to_owned())]);
    }

    #[test]
    fn reports_of_a_sampler_at_fault_do_not_count_against_its_compositors() {
        let mut reports = SamplerReports::default();
        reports.file(START, 1, report("c", "a"));
        reports.refute(1, "a");
        reports.forget(None, "a");
        reports.file(START, 1, report("c", "b"));
        assert_eq!(reports.refute(1, "b"), []);
        assert_eq!((reports.count_of(1, "a"), reports.count_of(1, "b")), (0, 1));
    }

    #[test]
    fn reports_of_two_workloads_do_not_agree() {
        let mut reports = SamplerReports::default();
        assert!(!reports.file(START, 1, report("c", "a")) && !reports.file(START, 2, report("d", "a")));
        assert_eq!(reports.refute(1, "a"), []);
        assert_eq!((reports.count_of(1, "a"), reports.count_of(2, "a")), (1, 1));
        reports.file(START, 2, report("c", "b"));
        assert_eq!(reports.refute(2, "b"), [], "it is the first of that workload");
        reports.forget(Some(2), "a");
        assert_eq!((reports.count_of(1, "a"), reports.count_of(2, "a")), (1, 0));
    }
}
