//! Promises: what the sessions of a workload are told of their budget.

use std::time::Duration;

use cluster::{Promise, PromiseState};

use super::Scheduler;
use crate::schedule::Command;
use crate::schedule::budget_state::Choice;
use crate::schedule::promise_audit::PromiseAudit;
use crate::schedule::workload_state::WorkloadState;

/// The time between two reports to sessions of how measuring goes on, and of figures of audits.
const NEWS_OF_MEASURING: Duration = Duration::from_secs(5);
const NEWS_OF_AUDITS: Duration = Duration::from_secs(60);

impl Scheduler {
    /// Tells sessions of a promise that has changed, and now and then how measuring goes on.
    pub(super) fn announce(&mut self, number: u64) -> Option<Command> {
        let promise = self.promise(number)?;
        let now = self.now;
        let workload = self.workloads.get_mut(&number)?;
        if workload.announced.as_ref().is_some_and(|known| !is_news(now, known, &promise)) {
            return None;
        }
        workload.announced = Some((now, promise.clone()));
        Some(Command::Promise { sessions: workload.sessions.numbers(), promise: Box::new(promise) })
    }

    /// The promise to the sessions of a workload; `None` without a budget.
    pub(super) fn promise(&self, number: u64) -> Option<Promise> {
        let workload = self.workloads.get(&number)?;
        let budget = workload.first.budgeted.as_ref()?.budget.to_string();
        let Some(state) = self.budgets.get(&number) else {
            let reason = workload.not_planned.clone().unwrap_or_default();
            return Some(promise_of(workload, budget, PromiseState::Unreachable, reason));
        };
        let choice = state.choice.as_ref();
        if let Some(broken) = &state.broken {
            let since_s = self.now.saturating_sub(broken.since).as_secs();
            let next = if choice.is_some_and(|choice| choice.is_applied) {
                "Nothing safer is known"
            } else {
                "Another row is being put in force"
            };
            let reason = format!("{} It has been broken for {since_s} s. {next}.", broken.reason);
            return Some(promise_of(workload, budget, PromiseState::Broken, reason));
        }
        let Some(Choice { row, tested, reason, audit, .. }) = choice.filter(|choice| choice.is_applied) else {
            let (spent_s, count) = state.plan.planner.spent();
            let reason = format!("{count} measurements were made in {spent_s:.1} s.");
            return Some(promise_of(workload, budget, PromiseState::Measuring, reason));
        };
        let kept = if row.is_some() { PromiseState::Kept } else { PromiseState::Unreachable };
        let summary = audit.as_ref().filter(|_| workload.audit.is_some()).map(PromiseAudit::summary);
        let audited = audit.as_ref().filter(|_| summary.is_some_and(|summary| summary.audited_views > 0));
        let finding = audited.map_or_else(String::new, |audit| format!(" Audits found {}.", audit.finding()));
        let promise = promise_of(workload, budget, kept, format!("{reason}{finding}"));
        Some(Promise {
            expected_ratio: tested.map_or(0.0, |tested| tested.mean_ratio),
            bound_ratio: tested.map_or(0.0, |tested| tested.bound_ratio.min(1.0)),
            probe_view_count: tested.map_or(0, |tested| tested.views as u32),
            audit: summary,
            ..promise
        })
    }
}

/// A promise without figures.
fn promise_of(workload: &WorkloadState, budget: String, state: PromiseState, reason: String) -> Promise {
    let representation = match &workload.representation {
        Some(representation) => representation.row.to_string(),
        None => format!("{}, S = {}", workload.method(), workload.load().images),
    };
    Promise {
        budget,
        state,
        representation,
        expected_ratio: 0.0,
        bound_ratio: 0.0,
        probe_view_count: 0,
        reason,
        audit: None,
    }
}

/// Whether sessions are told of a promise that they know in an earlier form.
fn is_news(now: Duration, (at, known): &(Duration, Promise), promise: &Promise) -> bool {
    let is_other = known.state != promise.state || known.representation != promise.representation;
    let interval = if promise.state == PromiseState::Measuring { NEWS_OF_MEASURING } else { NEWS_OF_AUDITS };
    let is_due = now.saturating_sub(*at) >= interval;
    is_other || (is_due && (known.reason != promise.reason || known.audit != promise.audit))
}
