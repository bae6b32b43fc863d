//! Which nodes serve which workload.

use std::collections::BTreeSet;

use super::Scheduler;
use crate::schedule::member::Member;
use crate::schedule::node_shares::{Claim, Need, NodeShares, Tie, weights};
use crate::schedule::workload_state::WorkloadState;
use crate::schedule::{Command, NodeCosts};

impl Scheduler {
    /// Members that may serve some workload, in the order of their names.
    pub(super) fn usable(&self) -> impl Iterator<Item = (&String, &Member)> {
        self.members.iter().filter(|(_, member)| member.quarantined_at.is_none())
    }

    /// Members that serve a workload, in the order of their names.
    pub(super) fn serving<'a>(&'a self, workload: &'a WorkloadState) -> impl Iterator<Item = (&'a String, &'a Member)> {
        self.usable().filter(|(name, _)| workload.nodes.contains(*name))
    }

    /// The division in force, without nodes that are gone.
    pub(super) fn node_shares(&self) -> NodeShares {
        let names: Vec<&String> = self.usable().map(|(name, _)| name).collect();
        let needs = self.workloads.iter().map(|(&number, workload)| {
            // The mean costs are those of all nodes, so that they do not depend on the division.
            let live_nodes = workload.live_nodes(&NodeCosts::mean(&self.costs_of_all(number)));
            Need { live_nodes, has_batch: workload.sessions.has_batch(), is_idle: workload.is_idle(self.now) }
        });
        let weights = weights(&needs.collect::<Vec<_>>(), names.len());
        let claims = self
            .workloads
            .values()
            .zip(weights)
            .map(|(workload, weight)| Claim { weight, ties: names.iter().map(|name| tie(workload, name)).collect() });
        NodeShares::new(claims.collect(), names.len())
    }

    /// Puts a division in force. Gives the workloads that have another node than before.
    fn put(&mut self, shares: &NodeShares) -> BTreeSet<u64> {
        let names: Vec<String> = self.usable().map(|(name, _)| name.clone()).collect();
        let mut gained = BTreeSet::new();
        for ((&number, workload), claim) in self.workloads.iter_mut().zip(&shares.claims) {
            let held = names.iter().zip(&claim.ties).filter(|(_, tie)| tie.is_held).map(|(name, _)| name.clone());
            let before = std::mem::replace(&mut workload.nodes, held.collect());
            if !workload.nodes.is_subset(&before) {
                gained.insert(number);
            }
        }
        gained
    }

    /// Nodes or workloads have come or gone: no workload is left without a node, and no node without a workload. Plans that
    /// have lost a node are replaced at once.
    pub(super) fn nodes_changed(&mut self, why: &str) -> Vec<Command> {
        let mut shares = self.node_shares();
        shares.give_free();
        if shares.house(self.sharing.has_settled(self.now)) {
            self.sharing.note_move(self.now);
        }
        let gained = self.put(&shares);
        let mut commands = Vec::new();
        for number in self.workload_numbers() {
            if !self.is_plan_whole(number) {
                commands.extend(self.replan(number, why));
            } else if gained.contains(&number) {
                commands.extend(self.reevaluate(number));
            }
        }
        commands
    }

    /// Moves a node between workloads where the division has been uneven for a while.
    pub(super) fn share_evenly(&mut self) -> Vec<Command> {
        if self.workloads.len() < 2 || !self.sharing.is_due(self.now) {
            return Vec::new();
        }
        let mut shares = self.node_shares();
        if !self.sharing.confirms(self.now, shares.is_uneven()) || !shares.step() {
            return Vec::new();
        }
        self.sharing.note_move(self.now);
        let gained = self.put(&shares);
        let mut changed = self.workload_numbers();
        changed.retain(|number| gained.contains(number) || !self.is_plan_whole(*number));
        let why = format!("nodes are divided anew among {} workloads", self.workloads.len());
        changed.into_iter().flat_map(|number| self.replan(number, &why)).collect()
    }

    pub(super) fn workload_numbers(&self) -> Vec<u64> {
        self.workloads.keys().copied().collect()
    }

    /// Whether the plan in force, if any, has all the processes that it was made for.
    fn is_plan_whole(&self, number: u64) -> bool {
        let Some(workload) = self.workloads.get(&number) else { return true };
        let mut members = workload.active_plan.iter().flat_map(|active| &active.members);
        members.all(|(name, &incarnation)| {
            workload.nodes.contains(name) && self.members.get(name).is_some_and(|m| m.incarnation == incarnation)
        })
    }
}

fn tie(workload: &WorkloadState, name: &str) -> Tie {
    let is_usable = !workload.excluded.contains_key(name);
    let worth = workload.active_plan.as_ref().map_or(0.0, |active| active.worth_of(name));
    Tie { is_usable, is_held: is_usable && workload.nodes.contains(name), worth }
}
