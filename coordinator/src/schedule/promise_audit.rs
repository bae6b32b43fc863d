//! The audits of a promise: of the views of one representation in force.

use std::collections::VecDeque;
use std::time::Duration;

use cluster::{AuditReport, AuditSummary, AuditedView};
use planner::{Audit, Budget, Certificate, ErrorTerm, Interval, Metric, Statistic};

/// A rate is not known before.
const RATE_AFTER: Duration = Duration::from_secs(60);
/// Audits within this time are the rate.
const RATE_OVER: Duration = Duration::from_secs(600);
/// The views in which twice the budget is found, 19 times in 20: of a mean, and of a share of views (`docs/planner.md`).
const VIEWS_TO_FIND_TWICE: f64 = 60.0;
/// The same in parts of views that show nothing but surfaces.
const PARTS_TO_FIND_TWICE: f64 = 50.0;
const VIEWS_TO_FIND_TWICE_P95: f64 = 660.0;
const HOUR_S: f64 = 3600.0;
/// A view that shows less says little by itself.
const LEAST_FOREGROUND: f64 = 0.01;

/// The audits of one promise.
#[derive(Debug, Clone)]
pub(super) struct PromiseAudit {
    term: ErrorTerm,
    audit: Audit,
    began: Duration,
    covered_views: u64,
    uncovered_views: u64,
    busy_s: f64,
    /// Views of which a part was compared, and the sum of these parts' shares of foreground.
    parts: usize,
    parts_foreground: f64,
    /// The times of reports of late, and their audits.
    recent: VecDeque<(Duration, usize)>,
}

impl PromiseAudit {
    /// Without views yet.
    pub(super) fn begin(now: Duration, term: ErrorTerm, certificate: &Certificate) -> Self {
        let audit = Audit::new(term, certificate.foreground_ratio);
        Self {
            term,
            audit,
            began: now,
            covered_views: 0,
            uncovered_views: 0,
            busy_s: 0.0,
            parts: 0,
            parts_foreground: 0.0,
            recent: VecDeque::new(),
        }
    }

    /// Takes a report, as far as its views are of plans since `plan_epoch`; whether the promise is broken.
    pub(super) fn take(&mut self, now: Duration, plan_epoch: u64, report: &AuditReport) -> bool {
        self.covered_views = self.covered_views.saturating_add(report.covered_views);
        self.uncovered_views = self.uncovered_views.saturating_add(report.uncovered_views);
        self.busy_s += report.busy_s;
        let is_mean = self.term.statistic() == Statistic::Mean;
        let own = report.views.iter().filter(|view| view.plan_epoch >= plan_epoch && (is_mean || !view.is_part));
        let mut count = 0;
        for view in own {
            // A model may fill a square of a view in which it is small.
            if view.is_part {
                self.audit.expect_foreground(1.0);
                self.parts += 1;
                self.parts_foreground += view.errors.foreground_ratio;
            }
            self.audit.observe(&view.errors);
            count += 1;
        }
        if count > 0 {
            self.recent.push_back((now, count));
        }
        while self.recent.front().is_some_and(|(at, _)| now.saturating_sub(*at) > RATE_OVER) {
            self.recent.pop_front();
        }
        self.audit.is_alarmed()
    }

    /// The error of a view by itself, if it is above the budget. A part says nothing of its view.
    pub(super) fn excess(&self, view: &AuditedView) -> Option<f64> {
        if view.is_part {
            return None;
        }
        let errors = &view.errors;
        let ratio = errors.error_ratio(self.term.metric());
        let is_above = errors.foreground_ratio >= LEAST_FOREGROUND && ratio > self.term.most_ratio();
        (errors.counts_for(&self.term) && is_above).then_some(ratio)
    }

    /// An error of this budget's metric in words.
    pub(super) fn shown(&self, ratio: f64) -> String {
        format!("{} {}", self.term.metric(), self.term.shown(ratio))
    }

    pub(super) fn summary(&self, now: Duration) -> AuditSummary {
        AuditSummary {
            audited_views: self.audit.views()[0],
            covered_views: self.covered_views,
            uncovered_views: self.uncovered_views,
            audits_per_s: self.audits_per_h(now) / HOUR_S,
            busy_s: self.busy_s,
            error: self.audit.error_interval(),
            viewers_above: 0,
        }
    }

    /// The rate of late. In the first minute it is that of an audit a minute at least.
    fn audits_per_h(&self, now: Duration) -> f64 {
        let since = now.saturating_sub(self.began);
        let recent = self.recent.iter().filter(|(at, _)| now.saturating_sub(*at) <= RATE_OVER);
        let audits: usize = recent.map(|(_, count)| count).sum();
        let audits = if since < RATE_AFTER { audits.max(1) } else { audits };
        audits as f64 * HOUR_S / since.clamp(RATE_AFTER, RATE_OVER).as_secs_f64()
    }

    /// Audits in which twice the budget is found.
    fn views_to_find_twice(&self) -> f64 {
        match self.term.statistic() {
            Statistic::P95 => VIEWS_TO_FIND_TWICE_P95,
            Statistic::Mean if self.parts == 0 => VIEWS_TO_FIND_TWICE,
            Statistic::Mean if self.term.metric() == Metric::FlipWhole => VIEWS_TO_FIND_TWICE,
            Statistic::Mean => PARTS_TO_FIND_TWICE * self.parts as f64 / self.parts_foreground.max(LEAST_FOREGROUND),
        }
    }

    /// The findings of the audits, in words.
    pub(super) fn finding(&self) -> String {
        let [audited, _] = self.audit.views();
        let parts = if self.parts > 0 { "parts of " } else { "" };
        let of = format!("{parts}{audited} of {} views", self.covered_views.max(audited));
        let Some(mean) = self.audit.mean_error() else { return format!("nothing on {of}") };
        let mean = self.shown_audited(mean);
        let interval = self.audit.error_interval().map_or_else(String::new, |Interval { low, high, .. }| {
            format!(" ({} to {})", self.shown_audited(low), self.shown_audited(high))
        });
        match self.term.statistic() {
            Statistic::Mean => format!("{} {mean}{interval} on {of}", self.term.metric()),
            Statistic::P95 => format!("{mean}{interval} of views over {}, on {of}", self.term),
        }
    }

    /// A ratio that audits find, in words: a mean error, or a share of views.
    fn shown_audited(&self, ratio: f64) -> String {
        match self.term.statistic() {
            Statistic::Mean => self.term.shown(ratio),
            Statistic::P95 => format!("{:.1} %", ratio * 100.0),
        }
    }

    /// The mean error that was found, where the promise is for one.
    pub(super) fn found_ratio(&self) -> Option<f64> {
        self.audit.mean_error().filter(|_| self.term.statistic() == Statistic::Mean)
    }

    /// The findings and the rate of the audits, in words; `other` is their budget where it is not the reader's.
    pub(super) fn in_words(&self, now: Duration, other: Option<&Budget>) -> String {
        let of = other.map(|budget| format!(" for {budget}")).unwrap_or_default();
        if self.audit.views() == [0, 0] {
            return format!(" Audits{of}: none yet.");
        }
        let per_h = self.audits_per_h(now);
        let uncovered = self.summary(now).uncovered_ratio();
        let not_covered =
            if uncovered > 0.0 { format!(" Not covered: {:.0} % of views.", uncovered * 100.0) } else { String::new() };
        let found_s = self.views_to_find_twice() / per_h.max(f64::MIN_POSITIVE) * HOUR_S;
        format!(
            " Audits{of}: {}, in {:.1} s of the nodes' time; {per_h:.0} an hour, which find twice the budget within {}.{not_covered}",
            self.finding(),
            self.busy_s,
            duration(found_s)
        )
    }
}

/// A time in the unit in which a person says it.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 2.0 * HOUR_S => format!("{:.0} min", s / 60.0),
        s if s < 1000.0 * HOUR_S => format!("{:.0} h", s / HOUR_S),
        _ => "months".to_owned(),
    }
}
