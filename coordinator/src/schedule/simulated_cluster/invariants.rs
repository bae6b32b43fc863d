//! The invariants that are checked after every step.

use std::collections::{BTreeMap, BTreeSet};

use cluster::{Assignment, NodeStatus, SessionPlan, WorkloadStatus};

use super::{DWELL, LastPlan, World};

impl World {
    /// Without losses, and without sessions that come or go, plans dwell, and pipelines change two roles at most.
    pub(super) fn check_calm_change(&self, last: &LastPlan, plan: &SessionPlan) {
        if last.may_replan {
            return;
        }
        let lasted = self.now - last.at;
        assert!(lasted >= DWELL, "{lasted:?} after the last plan: {}", plan.reason);
        let last = &last.plan.assignment;
        let is_pipeline = [last.policy, plan.assignment.policy] == [cluster::Policy::Pipeline; 2];
        assert!(!is_pipeline || changes(last, &plan.assignment) <= 2, "{}", plan.reason);
    }

    pub(super) fn may_use(&self, number: u64, name: &str) -> bool {
        [None, Some(number)].iter().all(|scope| !self.quarantined.contains(&(*scope, name.to_owned())))
    }

    /// Every node of a plan is a member, and each image is sampled once.
    pub(super) fn check_plan(&self, plan: &Assignment, nodes: &[NodeStatus]) {
        let names = plan.samplers.iter().map(|s| (&s.node_name, &s.address));
        for (name, address) in names.chain(plan.compositors.iter().map(|c| (&c.node_name, &c.address))) {
            let incarnation = self.members.get(name).expect("a member");
            assert_eq!(*address, format!("http://{name}:{incarnation}"));
            assert!(nodes.iter().any(|node| node.address == *address), "{name}");
            assert!(self.may_use(plan.workload_number, name), "{name}");
        }
        assert!(!plan.compositors.is_empty());
        let mut images: Vec<u32> = plan.samplers.iter().flat_map(|s| s.image_indices.clone()).collect();
        images.sort_unstable();
        let all = 0..plan.image_count() as u32;
        assert_eq!(images, if plan.policy == cluster::Policy::Direct { vec![] } else { all.collect::<Vec<_>>() });
    }

    /// A workload has a plan while it has sessions and there is a node for it; every node that can serve one does.
    pub(super) fn check_always(&self) {
        let (workloads, nodes) = (self.scheduler.status().workloads, self.scheduler.nodes_of_workloads());
        let kinds: BTreeSet<usize> = self.sessions.values().copied().collect();
        assert_eq!(workloads.len(), kinds.len(), "{:?}", self.sessions);
        for WorkloadStatus { number, plan, .. } in &workloads {
            let usable = self.members.keys().any(|name| self.may_use(*number, name));
            assert_eq!(plan.is_some(), usable, "{number} of {:?} {:?}", self.members, self.quarantined);
            assert_eq!(nodes[number].is_empty(), !usable, "every workload has a node");
            assert!(nodes[number].iter().all(|name| self.may_use(*number, name)));
            let assignment = plan.as_ref().map(|plan| &plan.assignment);
            assert!(assignment.is_none_or(|plan| roles(plan).keys().all(|name| nodes[number].contains(*name))));
        }
        let serves = |name: &String| nodes.values().any(|nodes| nodes.contains(name));
        let could = |name: &String| workloads.iter().any(|workload| self.may_use(workload.number, name));
        assert!(self.members.keys().all(|name| serves(name) == could(name)), "{nodes:?}");
    }

    /// Workloads of equal weight have about as many nodes.
    pub(super) fn check_equal_shares(&self) {
        let (nodes, weights) = (self.scheduler.nodes_of_workloads(), self.scheduler.weights_of_workloads());
        let carriers = |node: &String| weights.keys().filter(|number| nodes[number].contains(node)).count();
        // A node that serves several counts in part.
        let count = |number: &u64| nodes[number].iter().map(|node| 1.0 / carriers(node) as f64).sum::<f64>();
        let all = nodes.values().flatten().collect::<BTreeSet<_>>().len();
        for (a, weight) in weights.iter().filter(|_| weights.len() <= all) {
            for (b, _) in weights.iter().filter(|(_, other)| (*other / weight - 1.0).abs() < 0.01) {
                assert!(count(a) <= (count(b) + 1.0) * 1.25, "{nodes:?} by {weights:?}");
            }
        }
    }
}

/// Whether each node samples, and whether it composites.
fn roles(plan: &Assignment) -> BTreeMap<&str, (bool, bool)> {
    let mut roles: BTreeMap<&str, (bool, bool)> = BTreeMap::new();
    plan.samplers.iter().for_each(|share| roles.entry(&share.node_name).or_default().0 = true);
    plan.compositors.iter().for_each(|share| roles.entry(&share.node_name).or_default().1 = true);
    roles
}

/// Nodes that had a role and have another.
fn changes(from: &Assignment, to: &Assignment) -> usize {
    let (from, to) = (roles(from), roles(to));
    from.iter().filter(|(name, role)| to.get(*name).is_some_and(|new| new != *role)).count()
}
