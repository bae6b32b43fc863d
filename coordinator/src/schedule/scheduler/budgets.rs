//! Budgets: plans for them, the rows that they choose, and audits.

use std::time::Duration;

use cluster::{AuditOrder, AuditReport, SamplePlanes};
use planner::{ProbeId, Probed};

use super::Scheduler;
use crate::schedule::Command;
use crate::schedule::budget_plan::BudgetPlan;
use crate::schedule::budget_state::{BudgetState, Choice, demand};
use crate::schedule::command::ViewProbe;

/// While anybody is served, measuring takes this share of one node's time.
const PROBING_SHARE: f64 = 0.2;

impl Scheduler {
    /// Commands for budgets that follow from the event that has just been taken.
    pub(super) fn follow_budgets(&mut self) -> Vec<Command> {
        let workloads = &self.workloads;
        self.budgets.retain(|number, _| workloads.contains_key(number));
        let with_budget = self.workloads.iter().filter(|(_, workload)| workload.first.budgeted.is_some());
        let numbers: Vec<u64> = with_budget.map(|(&number, _)| number).collect();
        let mut commands = Vec::new();
        for &number in &numbers {
            self.begin_plan(number);
            let chosen = self.budgets.get(&number).filter(|state| state.choice.is_none());
            if let Some(choice) = chosen.and_then(BudgetState::chosen) {
                commands.extend(self.put_in_force(number, choice));
            }
        }
        commands.extend(self.probe_views());
        commands.extend(numbers.into_iter().filter_map(|number| self.announce(number)));
        commands
    }

    /// Begins a plan where there is none.
    fn begin_plan(&mut self, number: u64) {
        let Some(workload) = self.workloads.get_mut(&number) else { return };
        let Some(budgeted) = workload.first.budgeted.clone().filter(|_| !self.budgets.contains_key(&number)) else {
            return;
        };
        let cells = workload.planned_cells();
        match BudgetPlan::new(number, budgeted, workload.requested.clone(), cells, demand(workload)) {
            Ok(plan) => drop(self.budgets.insert(number, BudgetState::new(plan))),
            Err(error) => workload.not_planned = Some(error.to_string()),
        }
    }

    /// Asks one node for the measurement that is due. There is one at a time, of all workloads.
    fn probe_views(&mut self) -> Vec<Command> {
        let now = self.now;
        if self.running_probe.is_some() || now < self.probing_paused_until {
            return Vec::new();
        }
        let numbers: Vec<u64> = self.budgets.keys().copied().collect();
        for workload_number in numbers {
            let Some((node_name, address)) = self.node_to_measure(workload_number) else { continue };
            let Some(state) = self.budgets.get_mut(&workload_number) else { continue };
            let Some(probe) = state.due_probe(now) else { continue };
            let Some(request) = state.plan.measurement(&probe) else { continue };
            self.running_probe = Some(probe.id);
            let probe = ViewProbe { workload_number, id: probe.id, node_name, address, request };
            return vec![Command::ProbeViews(Box::new(probe))];
        }
        Vec::new()
    }

    /// The least busy node that serves a workload; of several devices, one of the first, so that costs can be compared.
    fn node_to_measure(&self, number: u64) -> Option<(String, String)> {
        let workload = self.workloads.get(&number)?;
        let (name, member) = self.serving(workload).min_by(|(_, a), (_, b)| {
            let busy = a.activity.busy_ratio(self.now).total_cmp(&b.activity.busy_ratio(self.now));
            a.status.device_name.cmp(&b.status.device_name).then(busy)
        })?;
        Some((name.clone(), member.status.address.clone()))
    }

    /// A node has measured views.
    pub(super) fn views_probed(&mut self, number: u64, probed: &Probed, planes: SamplePlanes) -> Vec<Command> {
        // Some node works for a session; measuring is no such work.
        let is_serving = self.members.values().any(|member| member.activity.busy_ratio(self.now) > 0.0);
        let share = if is_serving { PROBING_SHARE } else { 1.0 };
        self.probe_ended(probed.id, probed.busy_s * (1.0 / share - 1.0));
        self.budgets.get_mut(&number).into_iter().for_each(|state| state.measured(probed, planes));
        Vec::new()
    }

    /// Another measurement may begin after a pause.
    fn probe_ended(&mut self, id: ProbeId, pause_s: f64) {
        if self.running_probe == Some(id) {
            self.running_probe = None;
            self.probing_paused_until = self.now + Duration::try_from_secs_f64(pause_s).unwrap_or_default();
        }
    }

    /// A node has failed to measure views: the row fails, or another node is asked.
    pub(super) fn probe_failed(&mut self, number: u64, id: ProbeId, is_lost: bool) -> Vec<Command> {
        self.probe_ended(id, 0.0);
        let now = self.now;
        match self.budgets.get_mut(&number) {
            Some(state) if is_lost => state.lose(now, id),
            Some(state) => state.plan.planner.fail(id),
            None => (),
        }
        Vec::new()
    }

    /// Puts a choice in force. Timings of another row are of other work.
    fn put_in_force(&mut self, number: u64, choice: Choice) -> Vec<Command> {
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        let Some(workload) = self.workloads.get_mut(&number) else { return Vec::new() };
        let asked = workload.asked_costs();
        let representation = choice.row.and_then(|row| state.representation(row, &asked));
        let reason = format!("what is drawn was chosen for {}", state.plan.budgeted.budget);
        let is_audited = choice.audit.is_some() && self.limits.audit_time_ratio > 0.0;
        state.choice = Some(choice);
        let Some(representation) = representation else { return Vec::new() };
        workload.audit = workload.first.budgeted.as_ref().filter(|_| is_audited).map(|budgeted| AuditOrder {
            time_ratio: self.limits.audit_time_ratio,
            antialias: budgeted.antialias(),
            planned_pixel_count: u32::try_from(budgeted.typical_view.pixel_count()).unwrap_or(u32::MAX),
            truth_lighting: workload.requested.lighting.clone(),
        });
        workload.represent(representation);
        let costs = workload.costs;
        for estimate in self.members.values_mut().filter_map(|member| member.estimates.get_mut(&number)) {
            estimate.restart();
            estimate.rebase(&costs);
        }
        let commands = self.replan(number, &reason);
        let is_new = commands.iter().any(|command| matches!(command, Command::Apply { .. }));
        let has_plan = self.active_plan(number).is_some();
        // Without a plan, the next one is the first with it.
        let plan_epoch = self.plan_epoch + u64::from(!is_new);
        if let Some(choice) = self.budgets.get_mut(&number).and_then(|state| state.choice.as_mut()) {
            (choice.plan_epoch, choice.is_applied) = (plan_epoch, !is_new && has_plan);
        }
        commands
    }

    /// Nodes and sessions have a plan: promises hold from then on.
    pub(super) fn note_applied(&mut self, plan_epoch: u64) {
        let number = self.workload_of_plan(plan_epoch);
        let Some(state) = number.and_then(|number| self.budgets.get_mut(&number)) else { return };
        let Some(choice) = state.choice.as_mut().filter(|choice| plan_epoch >= choice.plan_epoch) else { return };
        if !std::mem::replace(&mut choice.is_applied, true) {
            state.broken = None;
        }
    }

    /// A member has audited views. The next safer row takes the place of one whose promise is broken.
    pub(super) fn audited(&mut self, number: u64, node: &str, report: &AuditReport) -> Vec<Command> {
        let now = self.now;
        let is_member = self.members.contains_key(node);
        let Some(state) = self.budgets.get_mut(&number).filter(|_| is_member) else { return Vec::new() };
        let Some(reason) = state.audited(now, report) else { return Vec::new() };
        let safer = state.safer(&reason);
        safer.map_or_else(Vec::new, |choice| self.put_in_force(number, choice))
    }
}
