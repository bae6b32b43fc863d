//! The cluster as a state machine: events in, commands out. The service does what they say.

mod admission;

use std::collections::BTreeMap;
use std::time::Duration;

use cluster::{
    Assignment, ClusterStatus, Costs, JoinCluster, MeasuredCosts, NodeCondition, NodeStatus, Policy, SessionPlan,
};
use depth_image::{Camera, PinholeCamera};

use super::assign::assignment;
use super::choose::{Demand, Present, WORTH, step_from};
use super::costs::{Estimate, Sampled, common_ratios};
use super::overload::Look;
use super::patience::Gain;
use super::work::{InForce, Work};
use super::{Choice, Command, Event, Load, NodeCosts, Opening, Wish, choose, direct_s, pipeline_by_s, time_share_s};

/// A node that has nothing to do is given a role for less than roles are changed for.
const WORTH_OF_IDLE: f64 = 1.02;
/// Sets that are sampled anew when another plan comes: the one that is shown next, and the two that were asked for ahead.
const SETS_LOST: usize = 3;
/// Changes of role of one plan, unless a node was lost.
const MOST_CHANGES: usize = 2;

#[derive(Debug, Clone)]
struct Member {
    incarnation: u64,
    status: NodeStatus,
    estimate: Estimate,
    /// It could not take a plan of this workload.
    is_out: bool,
    reported: Reported,
}

/// What a node says it has done since it joined.
#[derive(Debug, Clone, Copy, Default)]
struct Reported {
    at: Duration,
    views: u64,
    dropped_views: u64,
    busy_ratio: f64,
}

/// Members by name, the last epoch, and what sessions ask for.
#[derive(Debug, Clone, Default)]
pub struct Scheduler {
    now: Duration,
    plan_epoch: u64,
    members: BTreeMap<String, Member>,
    work: Option<Work>,
}

/// What a plan follows at once.
#[derive(PartialEq)]
struct Wanted {
    wish: Wish,
    sample_cameras: Vec<Camera>,
}

impl Wanted {
    fn of(work: &Work) -> Self {
        Self { wish: work.wish(), sample_cameras: work.asked.sample_cameras.clone() }
    }
}

/// The members that can be planned with, in the order of their names.
struct Crew<'a> {
    names: Vec<&'a str>,
    nodes: Vec<NodeCosts>,
    present: Option<Present>,
    load: Load,
    wish: Wish,
}

impl Crew<'_> {
    fn demand(&self) -> Demand<'_> {
        Demand { load: self.load, nodes: &self.nodes, wish: self.wish, present: self.present.as_ref() }
    }
}

impl Scheduler {
    /// What follows from an event. `now` is the time since the coordinator started; time that seems to run back stands
    /// still.
    pub fn step(&mut self, now: Duration, event: Event) -> Vec<Command> {
        self.now = self.now.max(now);
        match event {
            Event::Joined { incarnation, join } => self.joined(incarnation, join),
            Event::Left { incarnation, node_name } => self.left(incarnation, &node_name),
            Event::Opened(opening) => self.opened(&opening),
            Event::Demanded { session, views_per_set, frames_per_s } => {
                self.demanded(session, views_per_set, frames_per_s)
            }
            Event::Looked { session, viewpoints } => self.looked(session, &viewpoints),
            Event::Measured { node_name, plan_epoch, costs, busy_s, views, dropped_views } => {
                self.worked(&node_name, plan_epoch, busy_s, (views, dropped_views));
                self.measured(&node_name, plan_epoch, &costs)
            }
            Event::Ready { plan_epoch, node_name } => self.ready(plan_epoch, node_name),
            Event::Unready { plan_epoch, node_name, reason } => self.unready(plan_epoch, &node_name, &reason),
            Event::Closed { session } => self.closed(session),
            Event::Tick => self.look(),
        }
    }

    /// For whoever asks.
    #[must_use]
    pub fn status(&self) -> ClusterStatus {
        let work = self.work.as_ref();
        ClusterStatus {
            plan_epoch: self.plan_epoch,
            nodes: self.members.values().map(|member| member.status.clone()).collect(),
            offer: None,
            plan: self.in_force().map(|in_force| Box::new(in_force.plan.clone())),
            session_count: work.map_or(0, |work| work.sessions().len() as u32),
            views_per_set: work.map_or(0, |work| work.views() as u64),
            conditions: work.map_or_else(Vec::new, |_| self.conditions()),
            achieved: work.map_or_else(Vec::new, |work| work.achieved.clone()),
            utilisation: self.utilisation().filter(|&utilisation| utilisation > 0.0),
        }
    }

    /// What share of their time the plan's nodes need for what is asked; `None` without a plan.
    fn utilisation(&self) -> Option<f64> {
        let (work, crew) = (self.work.as_ref()?, self.crew()?);
        Some(work.utilisation(present_s(&crew, &self.has_role(&crew)?)?))
    }

    /// Of each of the crew, whether the plan in force gives it anything to do.
    fn has_role(&self, crew: &Crew<'_>) -> Option<Vec<bool>> {
        let in_force = self.in_force()?;
        Some(crew.names.iter().map(|name| in_force.has_role(name)).collect())
    }

    fn conditions(&self) -> Vec<NodeCondition> {
        let is_ready = |name: &str| self.in_force().is_some_and(|in_force| in_force.patience.ready.contains(name));
        let condition = |(name, member): (&String, &Member)| NodeCondition {
            node_name: name.clone(),
            is_ready: is_ready(name),
            costs: member.estimate.now().costs,
            views: member.reported.views,
            dropped_views: member.reported.dropped_views,
            busy_ratio: member.reported.busy_ratio,
        };
        self.members.iter().map(condition).collect()
    }

    pub(super) fn in_force(&self) -> Option<&InForce> {
        self.work.as_ref()?.in_force.as_ref()
    }

    /// The plan in force, if it has this epoch and is for this node.
    fn in_force_on(&mut self, plan_epoch: u64, name: &str) -> Option<&mut InForce> {
        let in_force = self.work.as_mut()?.in_force.as_mut()?;
        let holds = in_force.plan.assignment.plan_epoch == plan_epoch && in_force.members.contains_key(name);
        holds.then_some(in_force)
    }

    /// Of two processes with one name the later counts. A node's epoch may be above ours where we were
    /// restarted: plans go on above it.
    fn joined(&mut self, incarnation: u64, join: JoinCluster) -> Vec<Command> {
        self.plan_epoch = self.plan_epoch.max(join.plan_epoch);
        let name = join.node.node_name.clone();
        let estimate = self.work.as_ref().map(|work| Estimate::starting_at(&work.costs)).unwrap_or_default();
        let reported = Reported { at: self.now, ..Reported::default() };
        let member = Member { incarnation, status: join.node, estimate, is_out: false, reported };
        self.members.insert(name.clone(), member);
        let planned = self.in_force().and_then(|in_force| in_force.members.get(&name));
        if planned.is_some_and(|&planned| planned != incarnation) {
            return self.replan(&format!("node {name} was started again"));
        }
        self.look()
    }

    fn left(&mut self, incarnation: u64, name: &str) -> Vec<Command> {
        if self.members.get(name).is_none_or(|member| member.incarnation != incarnation) {
            return Vec::new();
        }
        self.members.remove(name);
        self.lost(name, &format!("node {name} left the cluster"))
    }

    /// A plan without one of its nodes is none: the next one is made at once.
    fn lost(&mut self, name: &str, why: &str) -> Vec<Command> {
        let planned = self.in_force().is_some_and(|in_force| in_force.members.contains_key(name));
        if planned { self.replan(why) } else { Vec::new() }
    }

    fn opened(&mut self, opening: &Opening) -> Vec<Command> {
        let session = opening.session;
        if let Err(error) = self.check(opening) {
            return vec![Command::Refuse { session, error }];
        }
        let mut commands = self.take_over(opening);
        let work = self.work.get_or_insert_with(|| Work::new(opening));
        let before = Wanted::of(work);
        work.add(opening);
        commands.extend(self.follow(before));
        let is_told = commands.iter().any(|command| matches!(command, Command::Apply { .. }));
        commands.extend(self.in_force().filter(|_| !is_told).map(|in_force| self.tell(in_force, vec![session])));
        commands
    }

    /// A node that could not take plans of one workload may take those of another.
    fn counts(&self, member: &Member, opening: &Opening) -> bool {
        !member.is_out || self.work.as_ref().is_none_or(|work| !work.suits(opening))
    }

    /// Ends sessions of another workload; costs are those of the new one from here on.
    fn take_over(&mut self, opening: &Opening) -> Vec<Command> {
        if self.work.as_ref().is_some_and(|work| work.suits(opening)) {
            return Vec::new();
        }
        for member in self.members.values_mut() {
            (member.estimate, member.is_out) = (Estimate::starting_at(&opening.costs), false);
        }
        let reason = format!("plan {} took its place", self.plan_epoch + 1);
        let ended = self.work.take().map(|work| work.sessions()).unwrap_or_default();
        ended.into_iter().map(|session| Command::End { session, reason: reason.clone() }).collect()
    }

    fn demanded(&mut self, session: u64, views_per_set: usize, frames_per_s: f64) -> Vec<Command> {
        if let Some(work) = &mut self.work {
            work.demand(session, views_per_set, frames_per_s);
        }
        self.look()
    }

    /// Counts what a node did; for the plan in force it says how long a set takes.
    fn worked(&mut self, name: &str, plan_epoch: u64, busy_s: f64, (views, dropped_views): (u64, u64)) {
        let now = self.now;
        if let Some(Member { reported, .. }) = self.members.get_mut(name) {
            let since_s = now.saturating_sub(reported.at).as_secs_f64();
            *reported = Reported {
                at: now,
                views: reported.views.saturating_add(views),
                dropped_views: reported.dropped_views.saturating_add(dropped_views),
                busy_ratio: if since_s > 0.0 { busy_s / since_s } else { 0.0 },
            };
        }
        if let Some(in_force) = self.in_force_on(plan_epoch, name) {
            in_force.worked(name, busy_s, views);
        }
        self.note_achieved();
    }

    fn note_achieved(&mut self) {
        let Some(work) = &mut self.work else { return };
        let views = work.load().views;
        let Some(achieved) = work.in_force.as_ref().and_then(|in_force| in_force.achieved(views)) else { return };
        work.achieved.retain(|other| other.policy != achieved.policy);
        work.achieved.push(achieved);
    }

    fn measured(&mut self, name: &str, plan_epoch: u64, costs: &MeasuredCosts) -> Vec<Command> {
        let in_force = self.work.as_ref().and_then(|work| work.in_force.as_ref());
        let plan = in_force.map(|in_force| &in_force.plan.assignment).filter(|plan| plan.plan_epoch == plan_epoch);
        let share = plan.and_then(|plan| Some((plan, plan.samplers.iter().find(|share| share.node_name == name)?)));
        let sampled = share.map(|(plan, share)| Sampled { parts: &share.image_indices, tiles: plan.tile_count });
        if let Some(member) = self.members.get_mut(name) {
            member.estimate.add(costs, sampled);
        }
        self.look()
    }

    fn ready(&mut self, plan_epoch: u64, name: String) -> Vec<Command> {
        if let Some(in_force) = self.in_force_on(plan_epoch, &name) {
            in_force.patience.ready.insert(name);
        }
        Vec::new()
    }

    fn unready(&mut self, plan_epoch: u64, name: &str, reason: &str) -> Vec<Command> {
        if self.in_force_on(plan_epoch, name).is_none() {
            return Vec::new();
        }
        if let Some(member) = self.members.get_mut(name) {
            member.is_out = true;
        }
        self.lost(name, &format!("node {name} could not take plan {plan_epoch}: {reason}"))
    }

    fn closed(&mut self, session: u64) -> Vec<Command> {
        let Some(work) = &mut self.work else { return Vec::new() };
        let before = Wanted::of(work);
        work.remove(session);
        if work.sessions().is_empty() {
            self.work = None;
            return Vec::new();
        }
        self.follow(before)
    }

    fn looked(&mut self, session: u64, viewpoints: &[PinholeCamera]) -> Vec<Command> {
        let Some(work) = &mut self.work else { return Vec::new() };
        let before = Wanted::of(work);
        work.look(session, viewpoints);
        self.follow(before)
    }

    /// At once, where another session decides or other images are sampled; else when it is worth it.
    fn follow(&mut self, before: Wanted) -> Vec<Command> {
        let Some(now) = self.work.as_ref().map(Wanted::of) else { return Vec::new() };
        if now.wish != before.wish {
            self.replan("another session decides")
        } else if now.sample_cameras != before.sample_cameras {
            self.replan("sessions look from elsewhere")
        } else {
            self.look()
        }
    }

    fn crew(&self) -> Option<Crew<'_>> {
        let work = self.work.as_ref()?;
        let (names, nodes) = (self.usable().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), self.costs_now());
        let samples = |in_force: &InForce| names.iter().map(|name| in_force.samples(name)).collect();
        let present = work.in_force.as_ref().map(|plan| Present {
            policy: plan.policy(),
            samples: samples(plan),
            tiles: plan.plan.assignment.tile_count as usize,
            relay_fanout: plan.plan.assignment.relay_fanout,
        });
        let (load, mut wish) = (work.load(), work.wish());
        // What could be when it was asked for may be too much when nodes are lost.
        let most = load.cut(wish.forced_tiles.unwrap_or(1)).most_samplers(names.len());
        wish.forced_samplers = wish.forced_samplers.map(|forced| forced.min(most));
        Some(Crew { names, nodes, present, load, wish })
    }

    /// Of usable nodes, in their order.
    pub(super) fn costs_now(&self) -> Vec<NodeCosts> {
        let common = common_ratios(self.usable().map(|(_, member)| &member.estimate));
        let now = |(_, member): (&String, &Member)| member.estimate.now_among(&common);
        let mut nodes: Vec<NodeCosts> = self.usable().map(now).collect();
        if self.in_force().is_some_and(|in_force| in_force.plan.assignment.tile_count > 1) {
            NodeCosts::level_sampling(&mut nodes);
        }
        nodes
    }

    fn usable(&self) -> impl Iterator<Item = (&String, &Member)> {
        self.members.iter().filter(|(_, member)| !member.is_out)
    }

    /// At once, whatever the plan in force; without nodes sessions wait for the next one that joins.
    fn replan(&mut self, why: &str) -> Vec<Command> {
        let Some(crew) = self.crew() else { return Vec::new() };
        match choose(&crew.demand()) {
            Ok(choice) => self.put_in_force(&choice, why),
            Err(_) => {
                self.work.iter_mut().for_each(|work| work.in_force = None);
                Vec::new()
            }
        }
    }

    /// Whether another plan is worth it by now.
    fn look(&mut self) -> Vec<Command> {
        if self.in_force().is_none() {
            return self.replan("");
        }
        if !self.in_force().is_some_and(|in_force| in_force.patience.is_due(self.now)) {
            return Vec::new();
        }
        if let Some(why) = self.step_of_overload() {
            self.members.values_mut().for_each(|member| member.estimate.begin_anew());
            return self.replan(&why);
        }
        let Some((choice, gain)) = self.better() else { return Vec::new() };
        let now = self.now;
        let over = |plan: &mut InForce| plan.patience.is_over(now, gain, plan.members.len());
        match self.work.as_mut().and_then(|work| work.in_force.as_mut()).is_some_and(over) {
            true => self.put_in_force(&choice, "demand, costs or nodes have changed"),
            false => Vec::new(),
        }
    }

    /// Less where nodes have no time left, more again where they have: why, if that changes anything.
    fn step_of_overload(&mut self) -> Option<String> {
        let (utilisation, now) = (self.utilisation()?, self.now);
        let work = self.work.as_mut()?;
        let frame_rate_ratios: Vec<f64> = work.fallbacks().iter().map(|quality| quality.frame_rate_ratio).collect();
        let look = Look { utilisation, views_per_s: work.views_per_s(), frame_rate_ratios: &frame_rate_ratios };
        let before = work.overload.step;
        if !work.overload.judge(now, look) {
            return None;
        }
        let step = work.overload.step;
        let share = format!("what is asked for takes {:.0} % of the nodes' time", utilisation * 100.0);
        Some(if step > before { format!("{share}: fallback {step}") } else { format!("{share}: back to {step}") })
    }

    /// The next plan towards the best one, and what the best one would bring.
    fn better(&self) -> Option<(Choice, Gain)> {
        let (crew, in_force) = (self.crew()?, self.in_force()?);
        let choice = choose(&crew.demand()).ok()?;
        let has_role: Vec<bool> = crew.names.iter().map(|name| in_force.has_role(name)).collect();
        let mean = NodeCosts::mean(&crew.nodes).costs;
        let sampled_s = crew.load.images as f64 * mean.sample_image_s / choice.division.sampler_count().max(1) as f64;
        let gain = Gain {
            ratio: present_s(&crew, &has_role)? / choice.time_s(),
            worth: if has_role.contains(&false) { WORTH_OF_IDLE } else { WORTH },
            switch_s: crew.load.sets.min(SETS_LOST) as f64 * sampled_s + mean.load_set_s,
        };
        Some((step_from(&crew.demand(), choice, &has_role, MOST_CHANGES), gain))
    }

    /// A plan that changes nothing is not made: epochs rise only where nodes have something new to do.
    fn put_in_force(&mut self, choice: &Choice, why: &str) -> Vec<Command> {
        let Some(work) = &self.work else { return Vec::new() };
        let crew: Vec<_> = self.usable().map(|(_, member)| &member.status).zip(self.costs_now()).collect();
        let members = self.usable().map(|(name, member)| (name.clone(), member.incarnation)).collect();
        let assignment = assignment(self.plan_epoch + 1, work.workload(), choice, &crew);
        if work.in_force.as_ref().is_some_and(|old| old.members == members && old.assigns(&assignment)) {
            return Vec::new();
        }
        let slowest = crew.iter().fold(Costs::default(), |slowest, (_, node)| slowest.max(node.costs));
        let anew = if work.in_force.is_some() { format!(" Planned anew: {why}.") } else { String::new() };
        let mut plan = session_plan(assignment, slowest, choice, format!("{}{anew}", choice.reason));
        plan.fallback_index = work.overload.step.checked_sub(1).map(|index| index as u32);
        plan.frame_rate_ratio = work.frame_rate_ratio();
        self.enforce(InForce::new(plan, members, self.now))
    }

    fn enforce(&mut self, in_force: InForce) -> Vec<Command> {
        self.plan_epoch = in_force.plan.assignment.plan_epoch;
        let sessions = self.work.as_ref().map(Work::sessions).unwrap_or_default();
        let command = self.tell(&in_force, sessions);
        self.work.iter_mut().for_each(|work| work.in_force = Some(in_force.clone()));
        vec![command]
    }

    fn tell(&self, in_force: &InForce, sessions: Vec<u64>) -> Command {
        let address = |name: &String| self.members.get(name).map(|member| member.status.address.clone());
        let addresses = in_force.members.keys().filter_map(address).collect();
        Command::Apply { sessions, plan: Box::new(in_force.plan.clone()), addresses }
    }
}

/// The plan in force at the costs and the demand of now; `None` where it has no node.
fn present_s(crew: &Crew<'_>, has_role: &[bool]) -> Option<f64> {
    let present = crew.present.as_ref()?;
    let at_work = crew.nodes.iter().zip(&present.samples).zip(has_role).filter(|(_, has_role)| **has_role);
    let (nodes, samples): (Vec<NodeCosts>, Vec<bool>) = at_work.map(|((node, samples), _)| (*node, *samples)).unzip();
    let load = crew.load.cut(present.tiles);
    let time_s = match present.policy {
        Policy::Pipeline => pipeline_by_s(&load, &nodes, &samples, present.relay_fanout),
        Policy::Direct => direct_s(&load, &nodes),
        Policy::TimeShare => time_share_s(&load, &nodes),
    };
    (!nodes.is_empty()).then_some(time_s)
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
        fallback_index: None,
        frame_rate_ratio: 1.0,
    }
}

#[cfg(test)]
#[path = "scheduler_tests.rs"]
mod tests;
