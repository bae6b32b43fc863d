//! The cluster as a state machine: events in, commands out.

mod faults;
mod planning;
mod sessions;

use std::collections::BTreeMap;
use std::time::Duration;

use cluster::{ClusterStatus, JoinCluster, MeasuredCosts, NodeCondition};

use super::active_plan::ActivePlan;
use super::estimate::SampledParts;
use super::member::Member;
use super::reports::SamplerReports;
use super::workload_state::WorkloadState;
use super::{Command, Event};

/// Members by name, the last epoch, and the demand of all sessions.
#[derive(Debug, Clone, Default)]
pub struct Scheduler {
    now: Duration,
    plan_epoch: u64,
    members: BTreeMap<String, Member>,
    workload: Option<WorkloadState>,
    reports: SamplerReports,
    liveness_probed_at: Duration,
}

impl Scheduler {
    /// The commands that follow from an event. `now` is the time since the coordinator started; time that runs back counts
    /// as standing still.
    pub fn step(&mut self, now: Duration, event: Event) -> Vec<Command> {
        self.now = self.now.max(now);
        match event {
            Event::Joined { incarnation, join } => self.joined(incarnation, join),
            Event::Left { incarnation, node_name } => self.left(incarnation, &node_name),
            Event::Opened(opening) => self.opened(&opening),
            Event::DemandChanged { session, views_per_set, frames_per_s } => {
                self.demand_changed(session, views_per_set, frames_per_s)
            }
            Event::ViewpointsChanged { session, viewpoints } => self.viewpoints_changed(session, &viewpoints),
            Event::Measured { node_name, plan_epoch, costs, busy_s, views, dropped_views } => {
                self.count_work(&node_name, plan_epoch, busy_s, views, dropped_views);
                self.measured(&node_name, plan_epoch, &costs)
            }
            Event::Ready { plan_epoch, node_name } => self.ready(plan_epoch, node_name),
            Event::Rejected { plan_epoch, node_name, reason } => self.rejected(plan_epoch, node_name, reason),
            Event::Unready { plan_epoch, node_name, reason } => self.unready(plan_epoch, &node_name, &reason),
            Event::Applied { plan_epoch } => self.applied(plan_epoch),
            Event::Reported(report) => self.reported(report),
            Event::Probed { plan_epoch, node_name, incarnation, kind, failure } => {
                self.probed(plan_epoch, &node_name, incarnation, kind, failure)
            }
            Event::Closed { session } => self.closed(session),
            Event::Tick => self.tick(),
        }
    }

    fn active_plan(&self) -> Option<&ActivePlan> {
        self.workload.as_ref()?.active_plan.as_ref()
    }

    /// The plan in force, if it has this epoch.
    fn active_plan_of(&mut self, plan_epoch: u64) -> Option<&mut ActivePlan> {
        self.workload.as_mut()?.active_plan.as_mut().filter(|active| active.epoch() == plan_epoch)
    }

    /// The plan in force, if it has this epoch and is for this node.
    fn active_plan_for(&mut self, plan_epoch: u64, name: &str) -> Option<&mut ActivePlan> {
        self.active_plan_of(plan_epoch).filter(|active| active.members.contains_key(name))
    }

    /// The later of two processes with one name counts. A node's epoch may be above ours where the coordinator was
    /// restarted: plans go on above it.
    fn joined(&mut self, incarnation: u64, join: JoinCluster) -> Vec<Command> {
        self.plan_epoch = self.plan_epoch.max(join.plan_epoch);
        let name = join.node.node_name.clone();
        let costs = self.workload.as_ref().map(|workload| &workload.costs);
        let member = Member::new(self.now, incarnation, join.node, costs);
        self.members.insert(name.clone(), member);
        let planned = self.active_plan().and_then(|active| active.members.get(&name));
        if planned.is_some_and(|&planned| planned != incarnation) {
            return self.replan(&format!("node {name} was started again"));
        }
        self.reevaluate()
    }

    fn left(&mut self, incarnation: u64, name: &str) -> Vec<Command> {
        if self.members.get(name).is_none_or(|member| member.incarnation != incarnation) {
            return Vec::new();
        }
        self.members.remove(name);
        self.replan_without(name, &format!("node {name} left the cluster"))
    }

    /// A plan that has lost a node is invalid: the next one is made at once.
    fn replan_without(&mut self, name: &str, why: &str) -> Vec<Command> {
        let planned = self.active_plan().is_some_and(|active| active.members.contains_key(name));
        if planned { self.replan(why) } else { Vec::new() }
    }

    /// Work for the plan in force says how long a set takes.
    fn count_work(&mut self, name: &str, plan_epoch: u64, busy_s: f64, views: u64, dropped_views: u64) {
        let now = self.now;
        if let Some(member) = self.members.get_mut(name) {
            member.activity.add(now, busy_s, views, dropped_views);
        }
        if let Some(active) = self.active_plan_for(plan_epoch, name) {
            active.add_work(name, busy_s, views);
        }
        let Some(workload) = &mut self.workload else { return };
        let views_per_set = workload.load().views;
        let achieved = workload.active_plan.as_ref().and_then(|active| active.achieved(views_per_set));
        let Some(achieved) = achieved else { return };
        workload.achieved.retain(|other| other.policy != achieved.policy);
        workload.achieved.push(achieved);
    }

    /// Timings of another plan than the one in force are of other work, and change no cost.
    fn measured(&mut self, name: &str, plan_epoch: u64, costs: &MeasuredCosts) -> Vec<Command> {
        let active = self.workload.as_ref().and_then(|workload| workload.active_plan.as_ref());
        if let Some(active) = active.filter(|active| active.epoch() == plan_epoch)
            && let Some(member) = self.members.get_mut(name)
        {
            let plan = &active.plan.assignment;
            let share = plan.samplers.iter().find(|share| share.node_name == name);
            let sampled = share.map(|share| SampledParts { parts: &share.image_indices, tiles: plan.tile_count });
            member.estimate.add(costs, sampled);
        }
        self.reevaluate()
    }

    fn tick(&mut self) -> Vec<Command> {
        let mut commands = self.readmit();
        commands.extend(self.reevaluate());
        commands.extend(self.probe_liveness());
        commands
    }

    /// The state of the cluster: members, the plan in force, and the demand of all sessions.
    #[must_use]
    pub fn status(&self) -> ClusterStatus {
        let workload = self.workload.as_ref();
        ClusterStatus {
            plan_epoch: self.plan_epoch,
            nodes: self.members.values().map(|member| member.status.clone()).collect(),
            offers: Vec::new(),
            plan: self.active_plan().map(|active| active.plan.clone()),
            session_count: workload.map_or(0, |workload| workload.sessions().len() as u32),
            views_per_set: workload.map_or(0, |workload| workload.views() as u64),
            conditions: workload.map_or_else(Vec::new, |_| self.conditions()),
            achieved: workload.map_or_else(Vec::new, |workload| workload.achieved.clone()),
            utilisation: self.utilisation().filter(|&utilisation| utilisation > 0.0),
        }
    }

    fn conditions(&self) -> Vec<NodeCondition> {
        let is_ready = |name: &str| self.active_plan().is_some_and(|active| active.ready.contains(name));
        let condition = |(name, member): (&String, &Member)| NodeCondition {
            node_name: name.clone(),
            is_ready: is_ready(name),
            costs: member.estimate.now().costs,
            views: member.activity.views,
            dropped_views: member.activity.dropped_views,
            busy_ratio: member.activity.busy_ratio,
        };
        self.members.iter().map(condition).collect()
    }
}

/// For tests of the whole schedule.
#[cfg(test)]
impl Scheduler {
    pub(in crate::schedule) fn active_plan_epoch(&self) -> Option<u64> {
        Some(self.active_plan()?.epoch())
    }

    /// Whether the plan in force was made for this node, with or without a role.
    pub(in crate::schedule) fn plans_with(&self, name: &str) -> bool {
        self.active_plan().is_some_and(|active| active.members.contains_key(name))
    }
}

#[cfg(test)]
#[path = "scheduler_tests.rs"]
mod tests;
