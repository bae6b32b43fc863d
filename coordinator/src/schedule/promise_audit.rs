//! The audits of a promise: of the views of one row in force.

use cluster::{AuditReport, AuditSummary};
use planner::{Audit, Budget, Interval, TestedError};

/// The audits of one promise.
#[derive(Debug, Clone)]
pub(super) struct PromiseAudit {
    budget: Budget,
    audit: Audit,
    covered_views: u64,
    uncovered_views: u64,
}

impl PromiseAudit {
    /// Without views yet.
    pub(super) fn new(budget: Budget, tested: &TestedError) -> Self {
        let audit = Audit::new(budget, tested.foreground_ratio);
        Self { budget, audit, covered_views: 0, uncovered_views: 0 }
    }

    /// Takes a report, as far as its views are of plans since `plan_epoch`; whether the promise is broken.
    pub(super) fn take(&mut self, plan_epoch: u64, report: &AuditReport) -> bool {
        self.covered_views = self.covered_views.saturating_add(report.covered_views);
        self.uncovered_views = self.uncovered_views.saturating_add(report.uncovered_views);
        for view in report.views.iter().filter(|view| view.plan_epoch >= plan_epoch) {
            self.audit.observe(&view.errors, view.is_part);
        }
        self.audit.is_alarmed()
    }

    pub(super) fn summary(&self) -> AuditSummary {
        AuditSummary {
            audited_views: self.audit.views(),
            covered_views: self.covered_views,
            uncovered_views: self.uncovered_views,
            error: self.audit.interval(),
        }
    }

    /// The findings of the audits, in words.
    pub(super) fn finding(&self) -> String {
        let audited = self.audit.views();
        let of = format!("{audited} of {} views", self.covered_views.max(audited));
        let Some(mean) = self.audit.mean_error() else { return format!("nothing on {of}") };
        let interval = self.audit.interval().map_or_else(String::new, |Interval { low, high, .. }| {
            format!(" ({} to {})", self.budget.shown(low), self.budget.shown(high))
        });
        format!("{}{interval} on {of}", self.budget.shown(mean))
    }
}
