//! Budgets: plans for them, and the representations that they choose.

use std::time::Duration;

use cluster::{Costs, PolicyChoice, SamplePlanes};
use planner::{Budget, Kept, ProbeId, PromiseState};

use super::Scheduler;
use crate::schedule::Command;
use crate::schedule::budget_plan::{BudgetPlan, answered, prices};
use crate::schedule::budget_state::{BudgetState, InForce, Unreachable};
use crate::schedule::chosen::Chosen;
use crate::schedule::estimate::Estimate;
use crate::schedule::member::Member;
use crate::schedule::prices::EqualNodes;
use crate::schedule::representation::Representation;
use crate::schedule::workload_state::WorkloadState;

/// A representation stays in force for so long at least, unless its budget has become stricter.
const DWELL: Duration = Duration::from_secs(60);
/// Demand that has changed by this ratio may have another cheapest representation.
const OTHER_DEMAND: f64 = 2.0;
/// While anybody is served, measuring takes this share of one node's time.
const PROBING_SHARE: f64 = 0.2;

impl Scheduler {
    /// Commands for budgets that follow from the event that has just been taken.
    pub(super) fn follow_budgets(&mut self) -> Vec<Command> {
        let mut commands = self.end_plans();
        self.follow_audits();
        let with_budget = self.workloads.iter().filter(|(_, workload)| workload.first.budgeted.is_some());
        let numbers: Vec<u64> = with_budget.map(|(&number, _)| number).collect();
        commands.extend(numbers.iter().filter_map(|&number| self.plan_for_budget(number)).flatten());
        commands.extend(self.probe_views());
        commands.extend(numbers.into_iter().flat_map(|number| self.announce(number)));
        commands
    }

    /// Plans of workloads that have ended.
    fn end_plans(&mut self) -> Vec<Command> {
        let numbers = self.budgets.keys().copied();
        let ended: Vec<u64> = numbers.filter(|number| !self.workloads.contains_key(number)).collect();
        let ended = ended.into_iter().filter_map(|number| self.budgets.remove(&number)?.plan.unfinished());
        ended.map(|kept| Command::Keep(Box::new(kept))).collect()
    }

    /// Begins a plan where there is none, or where the last one does not serve any more.
    fn plan_for_budget(&mut self, number: u64) -> Option<Vec<Command>> {
        let workload = self.workloads.get(&number)?;
        let budget = self.planned_budget(number).or_else(|| self.abandoned(number))?;
        let device_name = self.device_to_measure(workload)?;
        if workload.sessions.policy_override().policy == PolicyChoice::Direct
            || self.budgets.get(&number).is_some_and(|state| !self.is_outdated(state, workload, budget))
        {
            return None;
        }
        let plan_number = self.last_budget_plan + 1;
        let poses = self.budgets.get(&number).map(|state| state.findings.poses_to_join()).unwrap_or_default();
        let begun = BudgetPlan::begin(self.now, plan_number, workload, budget, &device_name, poses);
        self.workloads.get_mut(&number)?.not_planned = begun.as_ref().err().map(ToString::to_string);
        let plan = begun.ok()?;
        self.last_budget_plan = plan_number;
        let recall = Command::Recall { workload_number: number, key: plan.key() };
        let before = self.budgets.remove(&number);
        let unfinished = before.as_ref().and_then(|state| state.plan.unfinished());
        self.budgets.insert(number, BudgetState::begin(plan, before));
        let keep = unfinished.map(|kept| Command::Keep(Box::new(kept)));
        Some(keep.into_iter().chain([recall]).collect())
    }

    /// The budget of those sessions of a workload, the first of them first, that may be kept together; `None` where nothing
    /// keeps any of them.
    pub(super) fn planned_budget(&self, number: u64) -> Option<Budget> {
        let workload = self.workloads.get(&number)?;
        let state = self.budgets.get(&number);
        let prices = prices(workload);
        workload.sessions.strictest_budget(|budget| {
            let unreachable = state.and_then(|state| state.unreachable_by(budget)).filter(|known| {
                let is_recent = self.now.saturating_sub(known.since) < DWELL;
                let is_valid = known.is_final && !is_other_demand(&known.prices, &prices);
                may_draw(&known.prices) == may_draw(&prices) && (is_recent || is_valid)
            });
            unreachable.is_none()
        })
    }

    /// The strictest budget of sessions whose budgets nothing keeps, where what is in force is for others that have left.
    fn abandoned(&self, number: u64) -> Option<Budget> {
        let workload = self.workloads.get(&number)?;
        let state = self.budgets.get(&number)?;
        let planned = state.plan.budget;
        let is_stated = workload.sessions.budgets().iter().any(|(stated, _)| *stated == planned);
        let strictest = workload.sessions.strictest_budget(|_| true)?;
        (!is_stated && planned != strictest).then_some(strictest)
    }

    fn is_outdated(&self, state: &BudgetState, workload: &WorkloadState, budget: Budget) -> bool {
        let BudgetPlan { budget: planned, device_name, prices: at, began, outcome, .. } = &state.plan;
        if state.findings.is_given_up && workload.sessions.policy_override().may_draw_directly() {
            return false;
        }
        let has_device = self.serving(workload).any(|(_, member)| member.status.device_name == *device_name);
        let since = state.in_force.as_ref().map_or(*began, |in_force| in_force.since.max(*began));
        let is_lasting = self.now.saturating_sub(since) >= DWELL && outcome.is_some();
        let prices = prices(workload);
        let is_other = *planned != budget || is_other_demand(at, &prices) || state.is_to_be_tried_again;
        // Nothing keeps the budget that was planned for, or it could not be put in force.
        let is_for_others =
            outcome.is_some() && *planned != budget && state.unreachable_by(planned).is_some() && !state.keeps(&budget);
        let is_wrong = !planned.implies(&budget) || may_draw(at) != may_draw(&prices) || is_for_others;
        let is_broken = state.findings.is_to_be_planned
            && (outcome.is_some() || state.is_superseded())
            && state.switching.is_none()
            && self.now.saturating_sub(*began) >= DWELL;
        is_wrong || (outcome.is_none() && !has_device) || (is_lasting && is_other) || is_broken
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
        let now = self.now;
        if self.running_probe.is_some() || now < self.probing_paused_until {
            return Vec::new();
        }
        let states = self.budgets.values();
        let plans = states.filter(|state| !state.findings.is_given_up && state.plan.outcome.is_none()).count();
        let due = self.budgets.iter().filter(|(_, state)| !state.findings.is_given_up && state.plan.is_due(now));
        let mut with_node = due.filter_map(|(&number, _)| Some((number, self.node_to_measure(number)?)));
        let Some((number, (name, address))) = with_node.next() else { return Vec::new() };
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        if let Some(kept) = state.plan.allow(now, plans) {
            return self.concluded(number, kept);
        }
        let probe = state.plan.probe(number, &name, &address);
        self.running_probe = probe.as_ref().map(|probe| probe.id);
        probe.map(|probe| Command::ProbeViews(Box::new(probe))).into_iter().collect()
    }

    /// The least busy node with the plan's device.
    fn node_to_measure(&self, number: u64) -> Option<(String, String)> {
        let workload = self.workloads.get(&number)?;
        let state = self.budgets.get(&number)?;
        let alike = self.serving(workload).filter(|(_, member)| member.status.device_name == state.plan.device_name);
        let (name, member) = alike.min_by(|(_, a), (_, b)| self.by_work(a, b))?;
        Some((name.clone(), member.status.address.clone()))
    }

    /// Takes an event of a workload's plan.
    pub(super) fn planned(&mut self, number: u64, event: planner::Event) -> Vec<Command> {
        if let Some((id, busy_s)) = answered(&event) {
            // Some node works for a session; measuring is no such work.
            let is_serving = self.members.values().any(|member| member.activity.busy_ratio(self.now) > 0.0);
            let share = if is_serving { PROBING_SHARE } else { 1.0 };
            self.probe_ended(id, busy_s * (1.0 / share - 1.0));
        }
        let measured = self.budgets.get_mut(&number).and_then(|state| state.plan.take(event));
        measured.map_or_else(Vec::new, |kept| self.concluded(number, kept))
    }

    /// Another measurement may begin after a pause.
    fn probe_ended(&mut self, id: ProbeId, pause_s: f64) {
        if self.running_probe == Some(id) {
            self.running_probe = None;
            self.probing_paused_until = self.now + Duration::try_from_secs_f64(pause_s).unwrap_or(DWELL);
        }
    }

    pub(super) fn probe_lost(&mut self, number: u64, id: ProbeId, reason: String) -> Vec<Command> {
        let now = self.now;
        self.probe_ended(id, 0.0);
        let measured = self.budgets.get_mut(&number).and_then(|state| state.plan.lose(now, id, reason));
        measured.map_or_else(Vec::new, |kept| self.concluded(number, kept))
    }

    /// A plan is made: a row's costs are measured before it is in force, unless it is in force already.
    fn concluded(&mut self, number: u64, kept: Box<Kept>) -> Vec<Command> {
        let mut commands = vec![Command::Keep(kept)];
        let now = self.now;
        let Some(state) = self.budgets.get_mut(&number) else { return commands };
        let Some(chosen) = state.plan.chosen().filter(|_| !state.is_superseded()) else { return commands };
        if chosen.outcome.state == PromiseState::Unreachable {
            let budget = chosen.budget;
            let prices = state.plan.prices;
            let reason = chosen.outcome.reason.clone();
            let is_final = state.plan.is_final();
            state.note_unreachable(Unreachable { budget, since: now, prices, is_final, reason });
            // Other sessions have what they had, or a plan of their own.
            if self.planned_budget(number).is_some() {
                return commands;
            }
        }
        let Some(workload) = self.workloads.get(&number) else { return commands };
        let in_force = workload.representation.as_ref().and_then(Representation::row);
        match &chosen.row {
            Some(row) if in_force == Some(row) => commands.extend(self.choose_again(number, chosen)),
            Some(_) => commands.extend(self.measure_choice(number, chosen)),
            None if workload.sessions.policy_override().may_draw_directly() => {
                commands.extend(self.represent(number, chosen, Representation::Direct));
            }
            // Nothing is better than what sessions ask for.
            None => commands.extend(self.choose_again(number, chosen)),
        }
        commands
    }

    /// A choice that is in force already: what is promised, and how it is audited, may be new.
    fn choose_again(&mut self, number: u64, chosen: Chosen) -> Vec<Command> {
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        state.switching = None;
        state.in_force = Some(state.again(self.now, chosen));
        self.order_audits(number)
    }

    /// Has views audited as the choice in force wants it, by another plan where that is new.
    fn order_audits(&mut self, number: u64) -> Vec<Command> {
        let order = self.audit_order(number);
        match self.workloads.get_mut(&number) {
            Some(workload) if workload.audit != order => {
                workload.audit = order;
                self.replan(number, "views are audited otherwise")
            }
            _ => Vec::new(),
        }
    }

    /// Has the costs of a chosen row measured, before it is in force.
    pub(super) fn measure_choice(&mut self, number: u64, chosen: Chosen) -> Vec<Command> {
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        let Some(row) = &chosen.row else { return Vec::new() };
        let measurement = Box::new(state.plan.measurement(row));
        let command = Command::Represent { workload_number: number, choice: chosen.number, measurement };
        state.switching = Some(chosen);
        vec![command]
    }

    /// A number that no plan and no choice has had.
    pub(super) fn next_choice(&mut self) -> u64 {
        self.last_budget_plan += 1;
        self.last_budget_plan
    }

    /// The costs of the chosen row are known.
    pub(super) fn represented(&mut self, number: u64, choice: u64, costs: Costs, planes: SamplePlanes) -> Vec<Command> {
        let Some(chosen) = self.switched(number, choice) else { return Vec::new() };
        let Some(row) = chosen.row.clone() else { return Vec::new() };
        self.represent(number, chosen, Representation::Row { row, costs, planes })
    }

    /// The choice whose costs are measured, if it has this number. It is no longer waited for.
    fn switched(&mut self, number: u64, choice: u64) -> Option<Chosen> {
        self.budgets.get_mut(&number)?.switching.take_if(|chosen| chosen.number == choice)
    }

    /// The chosen row cannot be measured: what is in force stays.
    pub(super) fn unrepresented(&mut self, number: u64, choice: u64, reason: &str) -> Vec<Command> {
        let Some(chosen) = self.switched(number, choice) else { return Vec::new() };
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        let broken = state.broken().map(|broken| broken.reason.clone());
        if let (Some(broken), Some(in_force)) = (broken, &mut state.in_force) {
            in_force.chosen.certified.retain(|certified| Some(&certified.row) != chosen.row.as_ref());
            state.is_to_be_tried_again = true;
            return self.retreat(number, &broken);
        }
        state.is_to_be_tried_again = true;
        let chosen = chosen.without_row(reason);
        let budget = chosen.budget;
        let prices = state.plan.prices;
        let reason = chosen.outcome.reason.clone();
        state.note_unreachable(Unreachable { budget, since: self.now, prices, is_final: false, reason });
        // Other sessions have what they had, or a plan of their own.
        if self.planned_budget(number).is_some() {
            return Vec::new();
        }
        let now = self.now;
        if let Some(state) = self.budgets.get_mut(&number) {
            state.in_force = Some(InForce::begin(now, chosen));
        }
        self.order_audits(number)
    }

    /// Puts a choice in force. Timings of another representation are of other work.
    pub(super) fn represent(&mut self, number: u64, chosen: Chosen, representation: Representation) -> Vec<Command> {
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        let budget = chosen.budget;
        state.switching = None;
        state.findings.forget_viewers();
        state.in_force = Some(InForce::begin(self.now, chosen));
        let order = self.audit_order(number);
        let Some(workload) = self.workloads.get_mut(&number) else { return Vec::new() };
        workload.audit = order;
        workload.represent(representation);
        let costs = workload.costs;
        let estimates = self.members.values_mut().filter_map(|member| member.estimates.get_mut(&number));
        estimates.for_each(|estimate| {
            Estimate::restart(estimate);
            estimate.rebase(&costs);
        });
        let commands = self.replan(number, &format!("a representation was chosen for {budget}"));
        let is_new = commands.iter().any(|command| matches!(command, Command::Apply { .. }));
        let plan_epoch = self.plan_epoch;
        let has_plan = self.active_plan(number).is_some();
        if let Some(in_force) = self.budgets.get_mut(&number).and_then(|state| state.in_force.as_mut()) {
            // Without a plan, the next one is the first with it.
            in_force.plan_epoch = if is_new { plan_epoch } else { plan_epoch + 1 };
            in_force.is_applied = !is_new && has_plan;
        }
        commands
    }

    /// Nodes and sessions have a plan: promises hold from then on.
    pub(super) fn note_applied(&mut self, plan_epoch: u64) {
        let number = self.workload_of_plan(plan_epoch);
        let state = number.and_then(|number| self.budgets.get_mut(&number));
        if let Some(in_force) = state.and_then(|state| state.in_force.as_mut()) {
            in_force.is_applied |= plan_epoch >= in_force.plan_epoch;
        }
    }
}

fn may_draw(prices: &EqualNodes) -> bool {
    prices.direct_view_s.is_some()
}

/// Whether another representation may be the cheapest.
fn is_other_demand(a: &EqualNodes, b: &EqualNodes) -> bool {
    let pairs = [[a.nodes, b.nodes], [a.views_a_set, b.views_a_set], [a.cells, b.cells]];
    pairs.iter().any(|[a, b]| (*a as f64 / *b as f64).max(*b as f64 / *a as f64) >= OTHER_DEMAND)
}
