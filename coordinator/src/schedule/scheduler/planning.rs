//! Plans: when another one is made, and how far it goes towards the best.

use std::num::NonZeroU32;

use cluster::{Assignment, Costs, Policy, SessionPlan};

use super::Scheduler;
use crate::schedule::active_plan::ActivePlan;
use crate::schedule::assign::{Candidate, assignment};
use crate::schedule::choose::{WORTH, step_from};
use crate::schedule::estimate::common_ratios;
use crate::schedule::hysteresis::Gain;
use crate::schedule::member::Member;
use crate::schedule::overload::UtilizationSample;
use crate::schedule::prediction::{direct_s, pipeline_by_s, time_share_s};
use crate::schedule::{Choice, Command, CurrentRoles, Demand, Load, NodeCosts, PolicyOverride, choose};

/// A node without a role gets one for a smaller gain than roles are changed for.
const WORTH_OF_IDLE: f64 = 1.02;
/// Sets that are sampled again after a switch: the one that is shown next, and two that were asked for ahead.
const SETS_LOST: usize = 3;
/// Changes of role of one plan, unless a node was lost.
const MOST_CHANGES: usize = 2;

/// The members that can be planned with, in the order of their names, and the demand.
struct PlanningSnapshot<'a> {
    names: Vec<&'a str>,
    nodes: Vec<NodeCosts>,
    current: Option<CurrentRoles>,
    load: Load,
    policy_override: PolicyOverride,
}

impl PlanningSnapshot<'_> {
    fn demand(&self) -> Demand<'_> {
        Demand {
            load: self.load,
            nodes: &self.nodes,
            policy_override: self.policy_override,
            current: self.current.as_ref(),
        }
    }

    /// Predicted seconds of a set by the plan in force, at present costs and demand; `None` where it has no node.
    fn current_s(&self, has_role: &[bool]) -> Option<f64> {
        let current = self.current.as_ref()?;
        let with_role = self.nodes.iter().zip(&current.samples).zip(has_role).filter(|(_, has_role)| **has_role);
        let (nodes, samples): (Vec<NodeCosts>, Vec<bool>) =
            with_role.map(|((node, samples), _)| (*node, *samples)).unzip();
        let load = self.load.tiled(current.tiles);
        let time_s = match current.policy {
            Policy::Pipeline => pipeline_by_s(&load, &nodes, &samples, current.relay_fanout),
            Policy::Direct => direct_s(&load, &nodes),
            Policy::TimeShare => time_share_s(&load, &nodes),
        };
        (!nodes.is_empty()).then_some(time_s)
    }
}

/// The next plan, and the gain of the best one.
struct BetterPlan {
    choice: Choice,
    gain: Gain,
}

impl Scheduler {
    /// The share of their time that the plan's nodes need for the demand; `None` without a plan.
    pub(super) fn utilisation(&self) -> Option<f64> {
        let (workload, snapshot) = (self.workload.as_ref()?, self.snapshot()?);
        Some(workload.utilisation(snapshot.current_s(&self.has_role(&snapshot)?)?))
    }

    /// For each node of the snapshot, whether it has a role in the plan in force.
    fn has_role(&self, snapshot: &PlanningSnapshot<'_>) -> Option<Vec<bool>> {
        let active = self.active_plan()?;
        Some(snapshot.names.iter().map(|name| active.has_role(name)).collect())
    }

    fn usable(&self) -> impl Iterator<Item = (&String, &Member)> {
        self.members.iter().filter(|(_, member)| member.quarantined_at.is_none())
    }

    /// Present costs of usable nodes, in their order.
    pub(super) fn costs_now(&self) -> Vec<NodeCosts> {
        let common = common_ratios(self.usable().map(|(_, member)| &member.estimate));
        let mut nodes: Vec<NodeCosts> = self.usable().map(|(_, member)| member.estimate.now_among(&common)).collect();
        if self.active_plan().is_some_and(|active| active.plan.assignment.tile_count > 1) {
            NodeCosts::level_sampling(&mut nodes);
        }
        nodes
    }

    fn snapshot(&self) -> Option<PlanningSnapshot<'_>> {
        let workload = self.workload.as_ref()?;
        let names: Vec<_> = self.usable().map(|(name, _)| name.as_str()).collect();
        let current = workload.active_plan.as_ref().map(|active| CurrentRoles {
            policy: active.policy(),
            samples: names.iter().map(|name| active.samples(name)).collect(),
            tiles: active.plan.assignment.tile_count as usize,
            relay_fanout: active.plan.assignment.relay_fanout,
        });
        let (load, mut policy_override) = (workload.load(), workload.policy_override());
        // A forced K that was possible when it was asked for may be too many when nodes are lost.
        let most = load.tiled(policy_override.forced_tiles.unwrap_or(1)).most_samplers(names.len());
        policy_override.forced_samplers = policy_override.forced_samplers.map(|forced| forced.min(most));
        Some(PlanningSnapshot { names, nodes: self.costs_now(), current, load, policy_override })
    }

    /// Plans at once, for any plan in force; without nodes, sessions wait for the next one that joins.
    pub(super) fn replan(&mut self, why: &str) -> Vec<Command> {
        let Some(snapshot) = self.snapshot() else { return Vec::new() };
        match choose(&snapshot.demand()) {
            Ok(choice) => self.activate(&choice, why),
            Err(_) => {
                self.workload.iter_mut().for_each(|workload| workload.active_plan = None);
                Vec::new()
            }
        }
    }

    /// Plans where there is no plan, where overload asks for another quality, or where a better plan is worth the switch.
    pub(super) fn reevaluate(&mut self) -> Vec<Command> {
        let now = self.now;
        let Some(active) = self.active_plan() else { return self.replan("") };
        if !active.hysteresis.is_due(now) {
            return Vec::new();
        }
        if let Some(why) = self.step_of_overload() {
            self.members.values_mut().for_each(|member| member.estimate.restart());
            return self.replan(&why);
        }
        let Some(BetterPlan { choice, gain }) = self.better_plan() else { return Vec::new() };
        let confirms =
            |active: &mut ActivePlan| active.hysteresis.confirms(now, gain, active.ready.len() >= active.members.len());
        match self.workload.as_mut().and_then(|workload| workload.active_plan.as_mut()).is_some_and(confirms) {
            true => self.activate(&choice, "demand, costs or nodes have changed"),
            false => Vec::new(),
        }
    }

    /// Falls back under overload, and returns where there is room: why, if the quality changes.
    fn step_of_overload(&mut self) -> Option<String> {
        let (utilisation, now) = (self.utilisation()?, self.now);
        let workload = self.workload.as_mut()?;
        let frame_rate_ratios: Vec<f64> = workload.fallbacks().iter().map(|quality| quality.frame_rate_ratio).collect();
        let views_per_s = workload.views_per_s();
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
    fn better_plan(&self) -> Option<BetterPlan> {
        let snapshot = self.snapshot()?;
        let choice = choose(&snapshot.demand()).ok()?;
        let has_role = self.has_role(&snapshot)?;
        let mean = NodeCosts::mean(&snapshot.nodes);
        let samplers = choice.division.sampler_count().max(1);
        let sampled_s = snapshot.load.images as f64 * mean.sample_image_s / samplers as f64;
        let gain = Gain {
            ratio: snapshot.current_s(&has_role)? / choice.time_s(),
            worth: if has_role.contains(&false) { WORTH_OF_IDLE } else { WORTH },
            switch_s: snapshot.load.sets.min(SETS_LOST) as f64 * sampled_s + mean.load_set_s,
        };
        Some(BetterPlan { choice: step_from(&snapshot.demand(), choice, &has_role, MOST_CHANGES), gain })
    }

    /// Puts a choice in force. A plan that changes nothing is not made: epochs rise only where roles change.
    fn activate(&mut self, choice: &Choice, why: &str) -> Vec<Command> {
        let Some(workload) = &self.workload else { return Vec::new() };
        let nodes = self.usable().map(|(_, member)| &member.status).zip(self.costs_now());
        let candidates: Vec<_> = nodes.map(|(node, costs)| Candidate { node, costs }).collect();
        let members = self.usable().map(|(name, member)| (name.clone(), member.incarnation)).collect();
        let assignment = assignment(self.plan_epoch + 1, workload.degraded(), choice, &candidates);
        if workload.active_plan.as_ref().is_some_and(|old| old.members == members && old.assigns(&assignment)) {
            return Vec::new();
        }
        let slowest = candidates.iter().fold(Costs::default(), |slowest, node| slowest.max(node.costs.costs));
        let again = if workload.active_plan.is_some() { format!(" Planned again: {why}.") } else { String::new() };
        let mut plan = session_plan(assignment, slowest, choice, format!("{}{again}", choice.reason));
        plan.fallback = NonZeroU32::new(workload.overload.step as u32);
        plan.frame_rate_ratio = workload.frame_rate_ratio();
        plan.method = workload.method();
        let active = ActivePlan::new(plan, members, self.now);
        self.plan_epoch = active.epoch();
        let command = self.apply(&active, workload.sessions());
        self.workload.iter_mut().for_each(|workload| workload.active_plan = Some(active.clone()));
        vec![command]
    }

    /// Tells every node of a plan, then the sessions.
    pub(super) fn apply(&self, active: &ActivePlan, sessions: Vec<u64>) -> Command {
        let nodes = active.members.keys().filter_map(|name| Some(self.members.get(name)?.status.clone())).collect();
        Command::Apply { sessions, plan: Box::new(active.plan.clone()), nodes }
    }
}

fn session_plan(assignment: Assignment, costs: Costs, choice: &Choice, reason: String) -> SessionPlan {
    let predicted = &choice.predicted;
    SessionPlan {
        assignment,
        costs,
        reason,
        predicted_pipeline_s: predicted.pipeline_s,
        predicted_direct_s: predicted.direct_s,
        predicted_time_share_s: predicted.time_share_s,
        k_fd_sampler_count: predicted.k_fd as u32,
        predicted_k_fd_s: predicted.k_fd_s,
        enumerated_sampler_count: predicted.enumerated as u32,
        predicted_enumerated_s: predicted.enumerated_s,
        scene_load_s: 0.0,
        fallback: None,
        method: String::new(),
        frame_rate_ratio: 1.0,
    }
}
