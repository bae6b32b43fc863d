//! Whose fault it is when a compositor cannot get a sampler's images.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use cluster::{SamplerReport, SessionPlan};

/// Reports further apart have causes of their own.
const TOGETHER: Duration = Duration::from_secs(60);

/// Of each compositor, the sampler that it reported last, and when.
#[derive(Default)]
pub(crate) struct Reports(Mutex<HashMap<String, (String, Instant)>>);

/// Who is left out.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The sampler.
    Sampler,
    /// The compositor: it can get images of nobody. The sampler that it reported before was not to blame.
    Compositor { blamed: String },
}

impl Reports {
    /// Notes a report. Who reports one sampler after the other is itself cut off.
    pub(crate) fn judge(&self, report: &SamplerReport) -> Verdict {
        self.judge_at(Instant::now(), report)
    }

    fn judge_at(&self, now: Instant, report: &SamplerReport) -> Verdict {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let before = last.insert(report.compositor.clone(), (report.sampler.clone(), now));
        match before.filter(|(_, at)| now.saturating_duration_since(*at) < TOGETHER) {
            Some((blamed, _)) if blamed != report.sampler => {
                last.remove(&report.compositor);
                Verdict::Compositor { blamed }
            }
            _ => Verdict::Sampler,
        }
    }
}

/// Whether both have in the plan in force the roles that the report says.
pub(crate) fn concerns(report: &SamplerReport, plan: &SessionPlan) -> bool {
    let assignment = &plan.assignment;
    assignment.plan_epoch == report.plan_epoch
        && assignment.composites(&report.compositor)
        && assignment.samplers.iter().any(|share| share.node_name == report.sampler)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_reports_all_is_to_blame() {
        let report = |compositor: &str, sampler: &str| SamplerReport {
            plan_epoch: 1,
            compositor: compositor.to_owned(),
            sampler: sampler.to_owned(),
            reason: String::new(),
        };
        let reports = Reports::default();
        assert_eq!(reports.judge(&report("c", "a")), Verdict::Sampler);
        assert_eq!(reports.judge(&report("d", "a")), Verdict::Sampler);
        assert_eq!(reports.judge(&report("c", "a")), Verdict::Sampler);
        assert_eq!(reports.judge(&report("c", "b")), Verdict::Compositor { blamed: "a".to_owned() });
        assert_eq!(reports.judge(&report("c", "b")), Verdict::Sampler, "anew");
        let later = Instant::now() + TOGETHER;
        assert_eq!(reports.judge_at(later, &report("d", "b")), Verdict::Sampler, "long after");
    }
}
