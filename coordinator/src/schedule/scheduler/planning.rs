//! Plans: when another one is made, and how far it goes towards the best.

use std::num::NonZeroU32;

use cluster::{Costs, Policy, SessionPlan};

use super::Scheduler;
use crate::schedule::active_plan::ActivePlan;
use crate::schedule::assign::{Candidate, assignment};
use crate::schedule::choose::{WORTH, step_from};
use crate::schedule::estimate::{Estimate, common_ratios};
use crate::schedule::hysteresis::Gain;
use crate::schedule::overload::UtilizationSample;
use crate::schedule::prediction::{direct_s, pipeline_links, time_share_s};
use crate::schedule::workload_state::WorkloadState;
use crate::schedule::{Choice, Command, CurrentRoles, Demand, Load, NodeCosts, PolicyOverride, choose};

/// A node without a role gets one for a smaller gain than roles are changed for.
const WORTH_OF_IDLE: f64 = 1.02;
/// Sets that are sampled again after a switch: the one that is shown next, and two that were asked for ahead.
const SETS_LOST: usize = 3;
/// Changes of role of one plan, unless a node was lost.
const MOST_CHANGES: usize = 2;

/// The members that serve a workload, in the order of their names, and the demand.
struct PlanningSnapshot {
    nodes: Vec<NodeCosts>,
    current: Option<CurrentRoles>,
    /// Whether each node has a role in the plan in force.
    has_role: Vec<bool>,
    load: Load,
    policy_override: PolicyOverride,
}

impl PlanningSnapshot {
    fn demand(&self) -> Demand<'_> {
        Demand {
            load: self.load,
            nodes: &self.nodes,
            policy_override: self.policy_override,
            current: self.current.as_ref(),
        }
    }

    /// Predicted seconds of a set by the plan in force, at present costs and demand; `None` where it has no node.
    fn current_s(&self) -> Option<f64> {
        let current = self.current.as_ref()?;
        let roles = self.nodes.iter().zip(&current.samples).zip(&self.has_role);
        let with_role = roles.filter(|(_, has_role)| **has_role);
        let (nodes, samples): (Vec<NodeCosts>, Vec<bool>) =
            with_role.map(|((node, samples), _)| (*node, *samples)).unzip();
        let load = self.load.tiled(current.tiles);
        let time_s = match current.policy {
            Policy::Pipeline => pipeline_links(&load, &nodes, &samples).time_s(current.relay_fanout),
            Policy::Direct => direct_s(&load, &nodes),
            Policy::TimeShare => time_share_s(&load, &nodes),
        };
        (!nodes.is_empty()).then_some(time_s)
    }
}

impl Scheduler {
    /// The share of their time that a plan's nodes need for sessions with a rate; `None` without a plan. Batches take what
    /// is left, those of other workloads as well.
    pub(super) fn utilisation(&self, number: u64) -> Option<f64> {
        let workload = self.workloads.get(&number)?;
        let mut snapshot = self.snapshot(number)?;
        snapshot.load = workload.rated_load();
        snapshot.nodes =
            self.costs_beside(number, |other| other.sessions.viewers() > 0, |costs| workload.of_viewers(costs));
        Some(workload.utilisation(snapshot.current_s()?))
    }

    /// Present costs of a workload's operations on each usable node, as if it served nothing else.
    pub(super) fn costs_of_all(&self, number: u64) -> Vec<NodeCosts> {
        costs_among(self.usable().filter_map(|(_, member)| member.estimates.get(&number)))
    }

    /// The same for an admission, with `alone` in place of what was measured alone. Timings of a workload that has been idle for
    /// a while do not count: other programs may have slowed them down, and no new ones come while it is refused.
    pub(super) fn costs_to_admit(&self, number: u64, alone: &Costs) -> Vec<NodeCosts> {
        let estimates = self.usable().filter_map(|(_, member)| member.estimates.get(&number).cloned());
        let rebased = estimates.map(|mut estimate| {
            estimate.rebase(alone);
            estimate
        });
        if self.workloads.get(&number).is_some_and(|workload| workload.is_idle(self.now)) {
            return rebased.map(|estimate| estimate.alone()).collect();
        }
        let rebased: Vec<Estimate> = rebased.collect();
        costs_among(rebased.iter())
    }

    /// Present costs of the nodes that serve a workload, in their order. A node that serves several takes turns.
    pub(super) fn costs_now(&self, number: u64) -> Vec<NodeCosts> {
        self.costs_beside(number, |_| true, |costs| *costs)
    }

    /// Present costs as `of_views` changes them, of nodes that take turns with those of the other workloads that `counts`
    /// chooses and that are not idle.
    fn costs_beside(
        &self,
        number: u64,
        counts: impl Fn(&WorkloadState) -> bool,
        of_views: impl Fn(&Costs) -> Costs,
    ) -> Vec<NodeCosts> {
        let Some(workload) = self.workloads.get(&number) else { return Vec::new() };
        let mut nodes = costs_among(self.serving(workload).filter_map(|(_, member)| member.estimates.get(&number)));
        if workload.active_plan.as_ref().is_some_and(|active| active.plan.assignment.tile_count > 1) {
            NodeCosts::level_sampling(&mut nodes);
        }
        for ((name, _), node) in self.serving(workload).zip(&mut nodes) {
            node.costs = of_views(&node.costs);
            let others = self.workloads.iter().filter(|(other, _)| **other != number).map(|(_, other)| other);
            let sharing =
                others.filter(|other| other.nodes.contains(name) && !other.is_idle(self.now) && counts(other));
            match sharing.count() {
                0 => (),
                count => *node = node.times((1 + count) as f64),
            }
        }
        nodes
    }

    fn snapshot(&self, number: u64) -> Option<PlanningSnapshot> {
        let workload = self.workloads.get(&number)?;
        let names: Vec<_> = self.serving(workload).map(|(name, _)| name.as_str()).collect();
        let active = workload.active_plan.as_ref();
        let has_role = names.iter().map(|name| active.is_some_and(|active| active.has_role(name))).collect();
        let current = active.map(|active| CurrentRoles {
            policy: active.policy(),
            samples: names.iter().map(|name| active.samples(name)).collect(),
            tiles: active.plan.assignment.tile_count as usize,
            relay_fanout: active.plan.assignment.relay_fanout,
        });
        let load = workload.load();
        let policy_override = workload.policy_override().possible(&load, names.len());
        Some(PlanningSnapshot { nodes: self.costs_now(number), current, has_role, load, policy_override })
    }

    /// Plans at once, for any plan in force; without nodes, sessions wait for the next one that joins.
    pub(super) fn replan(&mut self, number: u64, why: &str) -> Vec<Command> {
        let Some(snapshot) = self.snapshot(number) else { return Vec::new() };
        match choose(&snapshot.demand()) {
            Ok(choice) => self.activate(number, &choice, why),
            Err(_) => {
                self.workloads.get_mut(&number).into_iter().for_each(|workload| workload.active_plan = None);
                Vec::new()
            }
        }
    }

    /// Plans where there is no plan, where overload asks for another quality, or where a better plan is worth the switch.
    pub(super) fn reevaluate(&mut self, number: u64) -> Vec<Command> {
        let now = self.now;
        let Some(active) = self.active_plan(number) else { return self.replan(number, "") };
        if !active.hysteresis.is_due(now) {
            return Vec::new();
        }
        if let Some(why) = self.step_of_overload(number) {
            let estimates = self.members.values_mut().filter_map(|member| member.estimates.get_mut(&number));
            estimates.for_each(Estimate::restart);
            return self.replan(number, &why);
        }
        let Some((choice, gain)) = self.better_plan(number) else { return Vec::new() };
        let active = self.workloads.get_mut(&number).and_then(|workload| workload.active_plan.as_mut());
        let Some(ActivePlan { hysteresis, ready, members, .. }) = active else { return Vec::new() };
        match hysteresis.confirms(now, gain, ready.len() >= members.len()) {
            true => self.activate(number, &choice, "demand, costs or nodes have changed"),
            false => Vec::new(),
        }
    }

    /// Falls back under overload, and returns where there is room: why, if the quality changes.
    fn step_of_overload(&mut self, number: u64) -> Option<String> {
        let utilisation = self.utilisation(number)?;
        let now = self.now;
        let workload = self.workloads.get_mut(&number)?;
        let fallbacks = workload.sessions.fallbacks();
        let frame_rate_ratios: Vec<f64> = fallbacks.iter().map(|quality| quality.frame_rate_ratio).collect();
        let views_per_s = workload.sessions.views_per_s();
        let sample = UtilizationSample { utilisation, views_per_s, frame_rate_ratios: &frame_rate_ratios };
        let before = workload.overload.step;
        if !workload.overload.add(now, sample) {
            return None;
        }
        let step = workload.overload.step;
        let share = format!("the demand takes {:.0} % of the nodes' time", utilisation * 100.0);
        Some(if step > before { format!("{share}: fallback {step}") } else { format!("{share}: back to {step}") })
    }

    /// The next plan towards the best one, and the gain of the best one.
    fn better_plan(&self, number: u64) -> Option<(Choice, Gain)> {
        let snapshot = self.snapshot(number)?;
        let choice = choose(&snapshot.demand()).ok()?;
        let has_role = &snapshot.has_role;
        let mean = NodeCosts::mean(&snapshot.nodes);
        let samplers = choice.division.sampler_count().max(1);
        let sampled_s = snapshot.load.images as f64 * mean.sample_image_s / samplers as f64;
        let gain = Gain {
            ratio: snapshot.current_s()? / choice.time_s(),
            worth: if has_role.contains(&false) { WORTH_OF_IDLE } else { WORTH },
            switch_s: snapshot.load.sets.min(SETS_LOST) as f64 * sampled_s + mean.load_set_s,
        };
        Some((step_from(&snapshot.demand(), choice, has_role, MOST_CHANGES), gain))
    }

    /// Puts a choice in force. A plan that changes nothing is not made: epochs rise only where roles change.
    fn activate(&mut self, number: u64, choice: &Choice, why: &str) -> Vec<Command> {
        let Some(workload) = self.workloads.get(&number) else { return Vec::new() };
        let nodes = self.serving(workload).map(|(_, member)| &member.status).zip(self.costs_now(number));
        let candidates: Vec<_> = nodes.map(|(node, costs)| Candidate { node, costs }).collect();
        let members = self.serving(workload).map(|(name, member)| (name.clone(), member.incarnation)).collect();
        let mut assignment = assignment(self.plan_epoch + 1, number, workload.degraded(), choice, &candidates);
        assignment.method = workload.common_method();
        assignment.audit = workload.audit.clone().filter(|_| workload.is_audited_under(assignment.policy));
        let old = workload.active_plan.as_ref();
        let slowest = candidates.iter().fold(Costs::default(), |slowest, node| slowest.max(node.costs.costs));
        let again = if old.is_some() { format!(" Planned again: {why}.") } else { String::new() };
        let predicted = &choice.predicted;
        let plan = SessionPlan {
            assignment,
            costs: slowest,
            reason: format!("{}{}{again}", choice.reason, workload.first.note),
            predicted_pipeline_s: predicted.pipeline_s,
            predicted_direct_s: predicted.direct_s,
            predicted_time_share_s: predicted.time_share_s,
            k_fd_sampler_count: predicted.k_fd as u32,
            predicted_k_fd_s: predicted.k_fd_s,
            enumerated_sampler_count: predicted.enumerated as u32,
            predicted_enumerated_s: predicted.enumerated_s,
            scene_load_s: 0.0,
            fallback: NonZeroU32::new(workload.overload.step as u32),
            method: workload.method(),
            frame_rate_ratio: workload.frame_rate_ratio(),
            auto_exposure: workload.first.auto_exposure,
        };
        if old.is_some_and(|old| old.members == members && old.is_like(&plan)) {
            return Vec::new();
        }
        let active = ActivePlan::new(plan, members, self.now);
        self.plan_epoch = active.epoch();
        let command = self.apply(&active, workload, workload.sessions.numbers());
        self.workloads.get_mut(&number).into_iter().for_each(|workload| workload.active_plan = Some(active.clone()));
        vec![command]
    }

    /// Tells every node of a plan, and of the one before, then the sessions. Nodes that may be silent are told nothing: the
    /// sessions would wait for them.
    pub(super) fn apply(&self, active: &ActivePlan, workload: &WorkloadState, sessions: Vec<u64>) -> Command {
        let before = workload.active_plan.as_ref().map(|active| &active.members);
        let nodes = self.usable().filter(|(name, _)| {
            let is_told = active.members.contains_key(*name) || before.is_some_and(|b| b.contains_key(*name));
            is_told && !workload.excluded.contains_key(*name)
        });
        let nodes = nodes.map(|(_, member)| member.status.clone()).collect();
        Command::Apply { sessions, plan: Box::new(active.plan.clone()), nodes }
    }
}

/// The costs that timings of all these together suggest.
fn costs_among<'a>(estimates: impl Iterator<Item = &'a Estimate>) -> Vec<NodeCosts> {
    let estimates: Vec<&Estimate> = estimates.collect();
    let common = common_ratios(estimates.iter().copied());
    estimates.into_iter().map(|estimate| estimate.now_among(&common)).collect()
}
