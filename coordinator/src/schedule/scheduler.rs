//! The cluster as a state machine: events in, commands out.

mod admission;
mod budgets;
mod faults;
mod planning;
mod promises;
mod sessions;
mod sharing;
mod state;
mod viewers;

use std::collections::BTreeMap;
use std::time::Duration;

use cluster::{JoinCluster, MeasuredCosts};
use planner::ProbeId;

use super::active_plan::ActivePlan;
use super::budget_state::BudgetState;
use super::estimate::SampledParts;
use super::hysteresis::SharingHysteresis;
use super::member::Member;
use super::reports::SamplerReports;
use super::workload_state::WorkloadState;
use super::{Command, Event};

/// Sessions of a coordinator before open again within this time.
const RESUMED_WITHIN: Duration = Duration::from_secs(30);

/// Members by name, workloads by number, and the last epoch.
#[derive(Debug, Clone, Default)]
pub struct Scheduler {
    now: Duration,
    /// Of all workloads together: no two plans have the same.
    plan_epoch: u64,
    last_workload: u64,
    limits: Limits,
    members: BTreeMap<String, Member>,
    workloads: BTreeMap<u64, WorkloadState>,
    /// The budget of each workload that has one.
    budgets: BTreeMap<u64, BudgetState>,
    /// The measurement that a node makes for a budget, and the time before which no other begins.
    running_probe: Option<ProbeId>,
    probing_paused_until: Duration,
    sharing: SharingHysteresis,
    reports: SamplerReports,
    liveness_probed_at: Duration,
    /// The last plan because viewers had moved.
    cells_changed_at: Option<Duration>,
    /// The last time that a node came with a plan of a coordinator before.
    resumed_at: Option<Duration>,
}

/// Limits that [`Event::Limits`] may change.
#[derive(Debug, Clone)]
struct Limits {
    max_workloads: usize,
    /// The share of compositors' time that audits may take.
    audit_time_ratio: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { max_workloads: 8, audit_time_ratio: 0.0 }
    }
}

impl Scheduler {
    /// The commands that follow from an event. `now` is the time since the coordinator started; time that runs back counts
    /// as standing still.
    pub fn step(&mut self, now: Duration, event: Event) -> Vec<Command> {
        self.now = self.now.max(now);
        let mut commands = self.take(event);
        commands.extend(self.follow_budgets());
        commands
    }

    fn take(&mut self, event: Event) -> Vec<Command> {
        match event {
            Event::Limits { max_workloads, audit_time_ratio } => {
                self.limits = Limits { max_workloads, audit_time_ratio };
                Vec::new()
            }
            Event::Joined { incarnation, join } => self.joined(incarnation, join),
            Event::Left { incarnation, node_name } => self.left(incarnation, &node_name),
            Event::Opened(opening) => self.opened(&opening),
            Event::DemandChanged { session, views_per_set, frames_per_s } => {
                self.demand_changed(session, views_per_set, frames_per_s)
            }
            Event::ViewpointsChanged { session, viewpoints } => self.viewpoints_changed(session, &viewpoints),
            Event::ViewersMoved { workload_number, node_name, viewpoints } => {
                self.viewers_moved(workload_number, node_name, viewpoints)
            }
            Event::Measured { node_name, plan_epoch, costs, busy_s, views, dropped_views } => {
                self.count_work(&node_name, plan_epoch, busy_s, views, dropped_views);
                self.measured(&node_name, plan_epoch, &costs)
            }
            Event::Audited { workload_number, node_name, report } => self.audited(workload_number, &node_name, &report),
            Event::Ready { plan_epoch, node_name } => self.ready(plan_epoch, node_name),
            Event::Rejected { plan_epoch, node_name, reason } => self.rejected(plan_epoch, node_name, reason),
            Event::Unready { plan_epoch, node_name, reason } => self.unready(plan_epoch, &node_name, &reason),
            Event::Applied { plan_epoch } => {
                self.note_applied(plan_epoch);
                self.applied(plan_epoch)
            }
            Event::Reported(report) => self.reported(report),
            Event::Probed { plan_epoch, node_name, incarnation, kind, failure } => {
                self.probed(plan_epoch, &node_name, incarnation, kind, failure)
            }
            Event::ViewsProbed { workload_number, probed, planes } => {
                self.views_probed(workload_number, &probed, planes)
            }
            Event::ProbeFailed { workload_number, id, is_lost } => self.probe_failed(workload_number, id, is_lost),
            Event::Closed { session } => self.closed(session),
            Event::Tick => self.tick(),
        }
    }

    /// The number of the workload whose plan in force has this epoch.
    fn workload_of_plan(&self, plan_epoch: u64) -> Option<u64> {
        let mut plans =
            self.workloads.iter().filter_map(|(&number, workload)| Some((number, workload.active_plan.as_ref()?)));
        plans.find(|(_, active)| active.epoch() == plan_epoch).map(|(number, _)| number)
    }

    fn workload_of_session(&self, session: u64) -> Option<u64> {
        self.workloads.iter().find(|(_, workload)| workload.sessions.contains(session)).map(|(&number, _)| number)
    }

    fn active_plan(&self, number: u64) -> Option<&ActivePlan> {
        self.workloads.get(&number)?.active_plan.as_ref()
    }

    /// The plan in force with this epoch, and the number of its workload.
    fn active_plan_of(&mut self, plan_epoch: u64) -> Option<(u64, &mut ActivePlan)> {
        let workloads = self.workloads.iter_mut();
        let mut plans = workloads.filter_map(|(&number, workload)| Some((number, workload.active_plan.as_mut()?)));
        plans.find(|(_, active)| active.epoch() == plan_epoch)
    }

    /// The plan in force with this epoch, if it is for this node.
    fn active_plan_for(&mut self, plan_epoch: u64, name: &str) -> Option<(u64, &mut ActivePlan)> {
        self.active_plan_of(plan_epoch).filter(|(_, active)| active.members.contains_key(name))
    }

    /// The later of two processes with one name counts. A node's epoch may be above ours where the coordinator was
    /// restarted: plans go on above it.
    fn joined(&mut self, incarnation: u64, join: JoinCluster) -> Vec<Command> {
        if join.plan_epoch > self.plan_epoch {
            (self.plan_epoch, self.resumed_at) = (join.plan_epoch, Some(self.now));
        }
        let name = join.node.node_name.clone();
        let mut member = Member::new(self.now, incarnation, join.node);
        self.workloads.iter().for_each(|(&number, workload)| member.expect(number, &workload.costs));
        self.members.insert(name.clone(), member);
        self.forgive(&name);
        self.nodes_changed(&format!("node {name} was started again"))
    }

    fn left(&mut self, incarnation: u64, name: &str) -> Vec<Command> {
        if self.members.get(name).is_none_or(|member| member.incarnation != incarnation) {
            return Vec::new();
        }
        self.members.remove(name);
        self.forgive(name);
        self.nodes_changed(&format!("node {name} left the cluster"))
    }

    /// Whatever an earlier process could not take, the next may.
    fn forgive(&mut self, name: &str) {
        for workload in self.workloads.values_mut() {
            workload.excluded.remove(name);
        }
    }

    /// Work for a plan in force says how long a set takes, and that its workload is not idle.
    fn count_work(&mut self, name: &str, plan_epoch: u64, busy_s: f64, views: u64, dropped_views: u64) {
        let now = self.now;
        if let Some(member) = self.members.get_mut(name) {
            member.activity.add(now, busy_s, views, dropped_views);
        }
        let number = self.workload_of_plan(plan_epoch);
        let Some(workload) = number.and_then(|number| self.workloads.get_mut(&number)) else { return };
        workload.count_work(now, name, busy_s, views);
    }

    /// Timings of another plan than those in force are of other work, and change no cost.
    fn measured(&mut self, name: &str, plan_epoch: u64, costs: &MeasuredCosts) -> Vec<Command> {
        let Some(number) = self.workload_of_plan(plan_epoch) else { return Vec::new() };
        let plan = self.workloads.get(&number).and_then(|workload| workload.active_plan.as_ref());
        let plan = plan.map(|active| &active.plan.assignment);
        let share = plan.and_then(|plan| plan.samplers.iter().find(|share| share.node_name == name));
        let sampled =
            plan.zip(share).map(|(plan, share)| SampledParts { parts: &share.image_indices, tiles: plan.tile_count });
        if let Some(estimate) = self.members.get_mut(name).and_then(|member| member.estimates.get_mut(&number)) {
            estimate.add(costs, sampled);
        }
        self.reevaluate(number)
    }

    fn tick(&mut self) -> Vec<Command> {
        let mut commands = self.readmit();
        commands.extend(self.share_evenly());
        commands.extend(self.follow_viewers());
        commands.extend(self.workload_numbers().into_iter().flat_map(|number| self.reevaluate(number)));
        commands.extend(self.probe_liveness());
        commands
    }
}

#[cfg(test)]
#[path = "scheduler_tests.rs"]
mod tests;
