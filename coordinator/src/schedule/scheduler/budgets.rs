//! Budgets: plans for them, the representations that they choose, and the promises to sessions.

use std::time::Duration;

use cluster::{Costs, PolicyChoice, Promise, PromiseState, SamplePlanes};
use planner::{Budget, Choice, Kept, ProbeId};

use super::Scheduler;
use crate::schedule::budget_plan::{BudgetPlan, BudgetState, prices};
use crate::schedule::estimate::Estimate;
use crate::schedule::member::Member;
use crate::schedule::prices::EqualNodes;
use crate::schedule::representation::{DRAWN, Representation};
use crate::schedule::workload_state::WorkloadState;
use crate::schedule::{Command, Load};

/// A representation stays in force for so long at least, unless its budget has become stricter.
const DWELL: Duration = Duration::from_secs(60);
/// Demand that has changed by this ratio may have another cheapest representation.
const OTHER_DEMAND: f64 = 2.0;
/// Sessions are told so often how measuring goes on.
const NEWS: Duration = Duration::from_secs(5);

impl Scheduler {
    /// What follows for budgets from the event that has just been taken.
    pub(super) fn follow_budgets(&mut self) -> Vec<Command> {
        let mut commands = self.end_plans();
        let with_budget = self.workloads.iter().filter(|(_, workload)| workload.budgeted.is_some());
        let numbers: Vec<u64> = with_budget.map(|(&number, _)| number).collect();
        commands.extend(numbers.iter().filter_map(|&number| self.plan_for_budget(number)));
        commands.extend(self.probe_views());
        commands.extend(numbers.into_iter().filter_map(|number| self.announce(number)));
        commands
    }

    /// Plans of workloads that have ended.
    fn end_plans(&mut self) -> Vec<Command> {
        let has_ended = |number: &u64| !self.workloads.contains_key(number);
        let ended: Vec<u64> = self.budgets.keys().copied().filter(has_ended).collect();
        let ended = ended.into_iter().filter_map(|number| self.budgets.remove(&number)?.plan.unfinished());
        ended.map(|kept| Command::Keep(Box::new(kept))).collect()
    }

    /// Begins a plan where there is none, or where the last one does not serve any more.
    fn plan_for_budget(&mut self, number: u64) -> Option<Command> {
        let workload = self.workloads.get(&number)?;
        let budget = workload.sessions.budget()?;
        let device_name = self.device_to_measure(workload)?;
        if workload.sessions.policy_override().policy == PolicyChoice::Direct
            || self.budgets.get(&number).is_some_and(|state| !self.is_outdated(state, workload, budget))
        {
            return None;
        }
        let plan_number = self.last_budget_plan + 1;
        let begun = BudgetPlan::begin(self.now, plan_number, workload, (budget, &device_name));
        self.workloads.get_mut(&number)?.not_planned = begun.as_ref().err().map(ToString::to_string);
        let plan = begun.ok()?;
        self.last_budget_plan = plan_number;
        let key = plan.key();
        match self.budgets.get_mut(&number) {
            Some(state) => state.plan = plan,
            None => drop(self.budgets.insert(number, BudgetState { plan, in_force: None })),
        }
        Some(Command::Recall { workload_number: number, key })
    }

    fn is_outdated(&self, state: &BudgetState, workload: &WorkloadState, budget: Budget) -> bool {
        let BudgetPlan { budget: planned, device_name, prices: at, began, outcome, .. } = &state.plan;
        let has_device = self.serving(workload).any(|(_, member)| member.status.device_name == *device_name);
        let is_lasting = self.now.saturating_sub(*began) >= DWELL && outcome.is_some();
        let is_other = *planned != budget || is_other_demand(at, &prices(workload));
        !planned.implies(&budget) || (outcome.is_none() && !has_device) || (is_lasting && is_other)
    }

    /// The device of the least busy node that serves a workload.
    fn device_to_measure(&self, workload: &WorkloadState) -> Option<String> {
        let least = self.serving(workload).min_by(|(_, a), (_, b)| self.by_work(a, b));
        least.map(|(_, member)| member.status.device_name.clone())
    }

    fn by_work(&self, a: &Member, b: &Member) -> std::cmp::Ordering {
        a.activity.busy_ratio(self.now).total_cmp(&b.activity.busy_ratio(self.now))
    }

    /// Asks one node for the measurement that is due. There is one at a time, of all workloads.
    fn probe_views(&mut self) -> Vec<Command> {
        if self.budgets.values().any(|state| state.plan.is_running()) {
            return Vec::new();
        }
        let now = self.now;
        let plans = self.budgets.values().filter(|state| state.plan.outcome.is_none()).count();
        let Some((&number, _)) = self.budgets.iter().find(|(_, state)| state.plan.is_due(now)) else {
            return Vec::new();
        };
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        if let Some(kept) = state.plan.allow(now, plans) {
            return self.concluded(number, kept);
        }
        let Some((name, address)) = self.node_to_measure(number) else { return Vec::new() };
        let state = self.budgets.get_mut(&number);
        let probe = state.and_then(|state| state.plan.probe(number, &name, &address));
        probe.map(|probe| Command::ProbeViews(Box::new(probe))).into_iter().collect()
    }

    /// The least busy node with the plan's device.
    fn node_to_measure(&self, number: u64) -> Option<(String, String)> {
        let (workload, state) = (self.workloads.get(&number)?, self.budgets.get(&number)?);
        let alike = self.serving(workload).filter(|(_, member)| member.status.device_name == state.plan.device_name);
        let (name, member) = alike.min_by(|(_, a), (_, b)| self.by_work(a, b))?;
        Some((name.clone(), member.status.address.clone()))
    }

    /// Whether some node works for a session; measuring is no such work.
    fn is_serving(&self) -> bool {
        self.members.values().any(|member| member.activity.busy_ratio(self.now) > 0.0)
    }

    /// Takes an event of a workload's plan.
    pub(super) fn planned(&mut self, number: u64, event: planner::Event) -> Vec<Command> {
        let (now, is_serving) = (self.now, self.is_serving());
        let state = self.budgets.get_mut(&number);
        let measured = state.and_then(|state| state.plan.take(now, event, is_serving));
        measured.map_or_else(Vec::new, |kept| self.concluded(number, kept))
    }

    pub(super) fn probe_lost(&mut self, number: u64, id: ProbeId, reason: String) -> Vec<Command> {
        let now = self.now;
        let measured = self.budgets.get_mut(&number).and_then(|state| state.plan.lose(now, id, reason));
        measured.map_or_else(Vec::new, |kept| self.concluded(number, kept))
    }

    /// A plan is made: a row's costs are measured before it is in force, unless it is in force already.
    fn concluded(&mut self, number: u64, kept: Box<Kept>) -> Vec<Command> {
        let mut commands = vec![Command::Keep(kept)];
        let (Some(state), Some(workload)) = (self.budgets.get_mut(&number), self.workloads.get(&number)) else {
            return commands;
        };
        let Some(outcome) = state.plan.outcome.clone() else { return commands };
        let in_force = workload.representation.as_ref();
        match state.plan.row(outcome.choice) {
            Some(row) if in_force.and_then(Representation::row) == Some(row) => {
                state.in_force = Some((state.plan.budget, outcome));
            }
            Some(row) => commands.push(Command::Represent {
                workload_number: number,
                plan: state.plan.number,
                measurement: Box::new(state.plan.measurement(row)),
            }),
            None if workload.sessions.policy_override().may_draw_directly() => {
                commands.extend(self.represent(number, Representation::Direct));
            }
            // Nothing is better than what sessions ask for.
            None => state.in_force = Some((state.plan.budget, outcome)),
        }
        commands
    }

    /// The costs of the chosen row are known.
    pub(super) fn represented(&mut self, number: u64, plan: u64, costs: Costs, planes: SamplePlanes) -> Vec<Command> {
        let state = self.budgets.get(&number).filter(|state| state.plan.number == plan);
        let row = state.and_then(|state| state.plan.row(state.plan.outcome.as_ref()?.choice)).cloned();
        row.map_or_else(Vec::new, |row| self.represent(number, Representation::Row { row, costs, planes }))
    }

    /// The chosen row cannot be measured: what is in force stays.
    pub(super) fn unrepresented(&mut self, number: u64, plan: u64, reason: &str) -> Vec<Command> {
        let Some(state) = self.budgets.get_mut(&number).filter(|state| state.plan.number == plan) else {
            return Vec::new();
        };
        if let Some(outcome) = &mut state.plan.outcome {
            outcome.reason = format!("{} It cannot be put in force: {reason}", outcome.reason);
            (outcome.choice, outcome.state) = (Choice::Direct, planner::PromiseState::Unreachable);
            state.in_force = Some((state.plan.budget, outcome.clone()));
        }
        Vec::new()
    }

    /// Puts the choice of a workload's plan in force. Timings of another representation are of other work.
    fn represent(&mut self, number: u64, representation: Representation) -> Vec<Command> {
        let (Some(state), Some(workload)) = (self.budgets.get_mut(&number), self.workloads.get_mut(&number)) else {
            return Vec::new();
        };
        let budget = state.plan.budget;
        state.in_force = state.plan.outcome.clone().map(|outcome| (budget, outcome));
        workload.represent(representation);
        let costs = workload.costs;
        let estimates = self.members.values_mut().filter_map(|member| member.estimates.get_mut(&number));
        estimates.for_each(|estimate| {
            Estimate::restart(estimate);
            estimate.rebase(&costs);
        });
        self.replan(number, &format!("a representation was chosen for {budget}"))
    }

    /// Tells sessions of a promise that has changed, and now and then how measuring goes on.
    fn announce(&mut self, number: u64) -> Option<Command> {
        let (promise, now) = (self.promise(number)?, self.now);
        let WorkloadState { announced, sessions, .. } = self.workloads.get_mut(&number)?;
        let known = |promise: &Promise| (promise.state, promise.budget.clone(), promise.representation.clone());
        let is_known = announced.as_ref().is_some_and(|(at, announced)| {
            known(announced) == known(&promise)
                && (now.saturating_sub(*at) < NEWS || announced.reason == promise.reason)
        });
        if is_known {
            return None;
        }
        *announced = Some((now, promise.clone()));
        Some(Command::Promise { sessions: sessions.numbers(), promise: Box::new(promise) })
    }

    /// Sessions of a workload are told its promise once more: one of them is new.
    pub(super) fn forget_announcement(&mut self, number: u64) {
        self.workloads.get_mut(&number).into_iter().for_each(|workload| workload.announced = None);
    }

    /// The promise to a workload's sessions; `None` without a budget.
    pub(super) fn promise(&self, number: u64) -> Option<Promise> {
        let workload = self.workloads.get(&number)?;
        let budget = workload.sessions.budget()?;
        if workload.sessions.policy_override().policy == PolicyChoice::Direct {
            return Some(drawn_directly(&budget, &workload.costs));
        }
        if let Some(reason) = &workload.not_planned {
            return Some(without_figures(&budget, PromiseState::Unreachable, reason.clone()));
        }
        let state = self.budgets.get(&number)?;
        let in_force = state.in_force.as_ref().filter(|(planned, _)| planned.implies(&budget));
        let outcome = in_force.map(|(_, outcome)| outcome);
        let certificate = outcome.and_then(|outcome| outcome.certificate.as_ref());
        let asked = || {
            let Load { images, .. } = workload.load();
            format!("{}, S = {images}, {}", workload.requested.sampling, workload.method())
        };
        let policy = workload.policy();
        Some(Promise {
            budget: budget.to_string(),
            state: outcome.map_or(PromiseState::Measuring, |outcome| match outcome.state {
                planner::PromiseState::Measuring => PromiseState::Measuring,
                planner::PromiseState::Kept => PromiseState::Kept,
                planner::PromiseState::Unreachable => PromiseState::Unreachable,
            }),
            representation: Representation::name(workload.representation.as_ref(), asked, policy),
            expected_ratio: certificate.map_or(0.0, |certificate| certificate.expected_ratio),
            bound_ratio: certificate.map_or(0.0, |certificate| certificate.bound_ratio.clamp(0.0, 1.0)),
            probe_view_count: certificate.map_or(0, |certificate| certificate.views as u32),
            reason: outcome.map_or_else(|| state.plan.reason(), |outcome| outcome.reason.clone()),
        })
    }
}

/// The promise where sessions have every view drawn directly.
fn drawn_directly(budget: &Budget, costs: &Costs) -> Promise {
    let view_s = costs.direct_view_s + costs.encode_view_s;
    let is_kept = budget.most_view_s().is_none_or(|limit| view_s <= limit);
    let state = if is_kept { PromiseState::Kept } else { PromiseState::Unreachable };
    let reason = format!("Sessions have every view drawn directly, in {:.1} ms: there is no error.", view_s * 1e3);
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
    }
}

/// Whether another representation may be the cheapest.
fn is_other_demand(a: &EqualNodes, b: &EqualNodes) -> bool {
    let is_other = |a: usize, b: usize| (a as f64 / b as f64).max(b as f64 / a as f64) >= OTHER_DEMAND;
    is_other(a.nodes, b.nodes) || is_other(a.views_a_set, b.views_a_set) || is_other(a.cells, b.cells)
}
