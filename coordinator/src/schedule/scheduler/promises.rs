//! Promises: what sessions are told of the budgets that they state.

use std::time::Duration;

use cluster::{AuditSummary, Policy, PolicyChoice, Promise, PromiseState};
use planner::{Budget, CHOICE_OF_BUDGETS, Outcome};

use super::Scheduler;
use crate::schedule::Command;
use crate::schedule::budget_state::{BudgetState, InForce};
use crate::schedule::representation::Representation;
use crate::schedule::workload_state::WorkloadState;

/// Direct drawing in words.
const DRAWN: &str = "every view drawn directly";
/// The time between two reports to sessions of how measuring goes on.
const NEWS: Duration = Duration::from_secs(5);
/// The same of figures of audits.
const NEWS_OF_AUDITS: Duration = Duration::from_secs(60);

impl Scheduler {
    /// Tells sessions of promises that have changed, and now and then how measuring goes on.
    pub(super) fn announce(&mut self, number: u64) -> Vec<Command> {
        let Some(workload) = self.workloads.get(&number) else { return Vec::new() };
        let budgets = workload.sessions.budgets();
        let promises = budgets.into_iter().filter_map(|(budget, of)| Some((of, self.promise(number, &budget)?)));
        let promises: Vec<(Vec<u64>, Promise)> = promises.collect();
        let now = self.now;
        let Some(WorkloadState { announced, .. }) = self.workloads.get_mut(&number) else { return Vec::new() };
        announced.retain(|(_, known)| promises.iter().any(|(_, promise)| promise.budget == known.budget));
        let mut commands = Vec::new();
        for (sessions, promise) in promises {
            if announced.iter().any(|known| !is_news(now, known, &promise)) {
                continue;
            }
            announced.retain(|(_, known)| known.budget != promise.budget);
            announced.push((now, promise.clone()));
            commands.push(Command::Promise { sessions, promise: Box::new(promise) });
        }
        commands
    }

    /// A session that has joined others with its budget is told what is promised to them.
    pub(super) fn promise_to(&self, session: u64, budget: Option<&Budget>, number: u64) -> Option<Command> {
        let known = &self.workloads.get(&number)?.announced;
        let budget = budget?.to_string();
        let (_, promise) = known.iter().find(|(_, promise)| promise.budget == budget)?;
        Some(Command::Promise { sessions: vec![session], promise: Box::new(promise.clone()) })
    }

    /// The promise for the budget that is planned for, or for the strictest where nothing keeps any; `None` without a budget.
    pub(super) fn workload_promise(&self, number: u64) -> Option<Promise> {
        let sessions = &self.workloads.get(&number)?.sessions;
        let budget = self.planned_budget(number).or_else(|| sessions.strictest_budget(|_| true))?;
        self.promise(number, &budget)
    }

    /// The promise to a workload's sessions with a budget.
    fn promise(&self, number: u64, budget: &Budget) -> Option<Promise> {
        let workload = self.workloads.get(&number)?;
        if workload.sessions.policy_override().policy == PolicyChoice::Direct {
            let view_s = workload.costs.direct_view_s + workload.costs.encode_view_s;
            let took =
                format!("Sessions have every view drawn directly, in {:.1} ms: there is no error.", view_s * 1e3);
            return Some(direct(budget, view_s, took));
        }
        if let Some(reason) = workload.not_planned.as_ref().filter(|_| !self.budgets.contains_key(&number)) {
            return Some(without_figures(budget, PromiseState::Unreachable, reason.clone()));
        }
        let state = self.budgets.get(&number)?;
        let in_force = state.in_force.as_ref().filter(|in_force| in_force.is_applied);
        let is_direct = workload.policy() == Some(Policy::Direct);
        if let (Some(Representation::Direct), Some(in_force), true) = (&workload.representation, in_force, is_direct) {
            let Outcome { price, reason, .. } = &in_force.chosen.outcome;
            return Some(direct(budget, price.view_s, reason.clone()));
        }
        let broken = state.broken().filter(|broken| broken.is_of(budget));
        // A choice in force that does not serve the budget is left out.
        let in_force = in_force.filter(|InForce { chosen, .. }| {
            let is_own = chosen.budget == *budget && chosen.outcome.state != planner::PromiseState::Kept;
            broken.is_some() || is_own || (chosen.row.is_some() && state.keeps(budget))
        });
        if let Some(reason) = self.unreachable_reason(number, state, budget).filter(|_| in_force.is_none()) {
            let representation = representation_in_words(workload);
            return Some(Promise { representation, ..without_figures(budget, PromiseState::Unreachable, reason) });
        }
        Some(self.promise_of_choice(workload, state, budget, in_force))
    }

    /// The promise for a budget by the choice in force that serves it, if any.
    fn promise_of_choice(
        &self,
        workload: &WorkloadState,
        state: &BudgetState,
        budget: &Budget,
        in_force: Option<&InForce>,
    ) -> Promise {
        let broken = state.broken().filter(|broken| broken.is_of(budget));
        let outcome = in_force.map(|in_force| &in_force.chosen.outcome);
        let is_audited = workload.audit.is_some() && workload.policy() != Some(Policy::Direct);
        let audit = in_force.and_then(|in_force| in_force.audit.as_ref()).filter(|_| is_audited);
        // Viewers are compared with the budget in force.
        let other = in_force.map(|in_force| &in_force.chosen.budget).filter(|other| *other != budget);
        let certificate = outcome.and_then(|outcome| outcome.certificate.as_ref());
        Promise {
            budget: budget.to_string(),
            state: match outcome.map(|outcome| outcome.state) {
                _ if broken.is_some() => PromiseState::Broken,
                None | Some(planner::PromiseState::Measuring) => PromiseState::Measuring,
                Some(planner::PromiseState::Kept) => PromiseState::Kept,
                Some(planner::PromiseState::Unreachable) => PromiseState::Unreachable,
            },
            representation: representation_in_words(workload),
            expected_ratio: certificate.map_or(0.0, |certificate| certificate.expected_ratio),
            bound_ratio: certificate.map_or(0.0, |certificate| certificate.bound_ratio.clamp(0.0, 1.0)),
            probe_view_count: certificate.map_or(0, |certificate| certificate.views as u32),
            reason: match (broken, outcome) {
                (Some(broken), _) => self.broken_reason(broken, state),
                (None, Some(outcome)) => {
                    let audits = audit.map(|audit| audit.in_words(self.now, other)).unwrap_or_default();
                    let here = if other.is_none() { state.findings.broken_here(self.now) } else { String::new() };
                    format!("{} {CHOICE_OF_BUDGETS}{audits}{here}", outcome.reason)
                }
                (None, None) if state.plan.budget.implies(budget) => state.plan.reason(),
                (None, None) => "A plan for it follows.".to_owned(),
            },
            audit: audit.map(|audit| AuditSummary {
                viewers_above: if other.is_none() { state.findings.viewers_above(self.now) } else { 0 },
                ..audit.summary(self.now)
            }),
        }
    }

    /// Why a budget is not planned for; `None` where it is, or will be.
    fn unreachable_reason(&self, number: u64, state: &BudgetState, budget: &Budget) -> Option<String> {
        let planned = self.planned_budget(number);
        if planned.is_some_and(|planned| planned.implies(budget)) {
            return None;
        }
        if let Some(known) = state.unreachable_by(budget) {
            return Some(known.reason.clone());
        }
        let planned = planned?;
        let together = planned.and(budget)?;
        let known = state.unreachable_by(&together)?;
        Some(format!("Other sessions that share the samples are promised {planned}. {}", known.reason))
    }
}

/// Whether sessions are told of a promise that they know in an earlier form.
fn is_news(now: Duration, (at, known): &(Duration, Promise), promise: &Promise) -> bool {
    let [known_above, above] = [known, promise].map(|promise| promise.audit.map_or(0, |audit| audit.viewers_above));
    let is_other = known.state != promise.state
        || known.budget != promise.budget
        || known.representation != promise.representation
        || known_above != above;
    let interval = if promise.state == PromiseState::Measuring { NEWS } else { NEWS_OF_AUDITS };
    let is_due = now.saturating_sub(*at) >= interval;
    is_other || (is_due && (known.reason != promise.reason || known.audit != promise.audit))
}

fn representation_in_words(workload: &WorkloadState) -> String {
    match &workload.representation {
        _ if workload.policy() == Some(Policy::Direct) => DRAWN.to_owned(),
        Some(Representation::Row { row, .. }) => row.to_string(),
        Some(Representation::Direct) => DRAWN.to_owned(),
        None => {
            let images = workload.load().images;
            format!("{}, S = {images}, {}", workload.requested.sampling, workload.method())
        }
    }
}

/// The promise where every view is drawn directly, in `view_s` seconds: it has no error.
fn direct(budget: &Budget, view_s: f64, reason: String) -> Promise {
    let is_kept = budget.most_view_s().is_none_or(|limit| view_s <= limit);
    let state = if is_kept { PromiseState::Kept } else { PromiseState::Unreachable };
    Promise { representation: DRAWN.to_owned(), ..without_figures(budget, state, reason) }
}

/// The promise where nothing is measured.
fn without_figures(budget: &Budget, state: PromiseState, reason: String) -> Promise {
    Promise {
        budget: budget.to_string(),
        state,
        representation: String::new(),
        expected_ratio: 0.0,
        bound_ratio: 0.0,
        probe_view_count: 0,
        reason,
        audit: None,
    }
}
