//! The cluster as a state machine: events in, commands out. The service does what they say.

use std::collections::BTreeMap;

use wire::{
    Assignment, ClusterStatus, CompositorShare, Costs, JoinCluster, NodeStatus, Policy, PolicyChoice, SamplerShare,
    SessionPlan, Workload,
};

use super::{ChoiceError, Demand, choose, share_images, share_sets};

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A node came, or came again.
    Joined {
        /// Rises with every joining, so that two processes of one name are told apart.
        incarnation: u64,
        /// Who.
        join: JoinCluster,
    },
    /// A membership ended.
    Left {
        /// Which joining.
        incarnation: u64,
        /// Who.
        node_name: String,
    },
    /// A session is ready to be planned.
    Opened(Box<Opening>),
    /// A client went, or its session failed.
    Closed {
        /// Which.
        session: u64,
    },
}

/// A session whose costs are known.
#[derive(Debug, Clone, PartialEq)]
pub struct Opening {
    /// Its number.
    pub session: u64,
    /// What is sampled.
    pub workload: Workload,
    /// V.
    pub views_per_set: usize,
    /// Who decides.
    pub policy: PolicyChoice,
    /// K, instead of the formula's.
    pub forced_samplers: Option<usize>,
    /// As measured.
    pub costs: Costs,
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Tell every node of the plan; when all are ready, tell the client.
    Apply {
        /// For whom.
        session: u64,
        /// The plan.
        plan: Box<SessionPlan>,
        /// Addresses of the plan's nodes.
        addresses: Vec<String>,
    },
    /// No plan can be made.
    Refuse {
        /// Whose.
        session: u64,
        /// Why.
        error: ChoiceError,
    },
    /// A plan no longer holds.
    End {
        /// Whose.
        session: u64,
        /// Why.
        reason: String,
    },
}

#[derive(Debug, Clone)]
struct Member {
    incarnation: u64,
    status: NodeStatus,
}

/// A session and the members its plan needs.
#[derive(Debug, Clone)]
struct Active {
    session: u64,
    members: BTreeMap<String, u64>,
}

/// Members by name, the last epoch, and the one session whose plan is in force.
#[derive(Debug, Clone, Default)]
pub struct ClusterState {
    plan_epoch: u64,
    members: BTreeMap<String, Member>,
    active: Option<Active>,
}

impl ClusterState {
    /// What follows from an event.
    pub fn step(&mut self, event: Event) -> Vec<Command> {
        match event {
            Event::Joined { incarnation, join } => self.joined(incarnation, join),
            Event::Left { incarnation, node_name } => self.left(incarnation, &node_name),
            Event::Opened(opening) => self.opened(*opening),
            Event::Closed { session } => {
                self.active.take_if(|active| active.session == session);
                Vec::new()
            }
        }
    }

    /// For whoever asks.
    #[must_use]
    pub fn status(&self) -> ClusterStatus {
        ClusterStatus {
            plan_epoch: self.plan_epoch,
            nodes: self.members.values().map(|member| member.status.clone()).collect(),
            offer: None,
        }
    }

    /// Of two processes with one name the later counts. A node's epoch may be above ours where we were
    /// restarted: plans go on above it.
    fn joined(&mut self, incarnation: u64, join: JoinCluster) -> Vec<Command> {
        self.plan_epoch = self.plan_epoch.max(join.plan_epoch);
        let name = join.node.node_name.clone();
        self.members.insert(name.clone(), Member { incarnation, status: join.node });
        self.end_where(
            |active| active.members.get(&name).is_some_and(|&planned| planned != incarnation),
            format!("node {name} was started again"),
        )
    }

    fn left(&mut self, incarnation: u64, name: &str) -> Vec<Command> {
        if self.members.get(name).is_none_or(|member| member.incarnation != incarnation) {
            return Vec::new();
        }
        self.members.remove(name);
        self.end_where(|active| active.members.contains_key(name), format!("node {name} left the cluster"))
    }

    fn end_where(&mut self, holds: impl FnOnce(&mut Active) -> bool, reason: String) -> Vec<Command> {
        let ended = self.active.take_if(holds);
        ended.map(|active| Command::End { session: active.session, reason }).into_iter().collect()
    }

    fn opened(&mut self, opening: Opening) -> Vec<Command> {
        let session = opening.session;
        let demand = Demand {
            images: opening.workload.sample_cameras.len(),
            // A still picture is one set, though it be refined: its sums are kept where it is sampled.
            sets: if opening.workload.timeline.moves() { opening.workload.timeline.set_count as usize } else { 1 },
            views: opening.views_per_set,
            nodes: self.members.len(),
            policy: opening.policy,
            forced_samplers: opening.forced_samplers,
        };
        let choice = match choose(&opening.costs, &demand) {
            Ok(choice) => choice,
            Err(error) => return vec![Command::Refuse { session, error }],
        };
        self.plan_epoch += 1;
        let mut commands = self.end_where(|_| true, format!("plan {} took its place", self.plan_epoch));
        let plan = SessionPlan {
            assignment: self.assignment(opening.workload, choice.policy, choice.samplers, opening.costs.in_order),
            costs: opening.costs,
            reason: choice.reason,
            predicted_pipeline_s: choice.predicted_pipeline_s,
            predicted_direct_s: choice.predicted_direct_s,
            scene_load_s: 0.0,
        };
        self.active = Some(Active {
            session,
            members: self.members.iter().map(|(name, member)| (name.clone(), member.incarnation)).collect(),
        });
        let addresses = self.members.values().map(|member| member.status.address.clone()).collect();
        commands.push(Command::Apply { session, plan: Box::new(plan), addresses });
        commands
    }

    /// The first K members sample and the others composite; in the direct policy all make views, and a
    /// single node does both.
    fn assignment(&self, workload: Workload, policy: Policy, sampler_count: usize, in_order: bool) -> Assignment {
        let nodes: Vec<&NodeStatus> = self.members.values().map(|member| &member.status).collect();
        let (sampling, making) = match policy {
            Policy::Direct => (&[][..], &nodes[..]),
            Policy::Pipeline if nodes.len() == 1 => (&nodes[..], &nodes[..]),
            Policy::Pipeline => nodes.split_at(sampler_count),
        };
        let share = if in_order { share_sets } else { share_images };
        let shares = share(workload.sample_cameras.len(), sampling.len());
        let sampler = |(node, image_indices): (&&NodeStatus, Vec<u32>)| SamplerShare {
            node_name: node.node_name.clone(),
            address: node.address.clone(),
            image_indices,
        };
        let compositor =
            |node: &&NodeStatus| CompositorShare { node_name: node.node_name.clone(), address: node.address.clone() };
        Assignment {
            plan_epoch: self.plan_epoch,
            policy,
            samplers: sampling.iter().zip(shares).map(sampler).collect(),
            compositors: making.iter().map(compositor).collect(),
            workload,
        }
    }
}

#[cfg(test)]
#[path = "state_tests.rs"]
mod tests;
