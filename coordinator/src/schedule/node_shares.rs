//! The division of the nodes among workloads: in proportion to their work, by few changes at a time.
//!
//! A workload has nodes of its own. Idle workloads, and workloads that outnumber the nodes, share nodes with others.

/// The least share of all nodes for a workload with batches, so that they end.
const LEAST_BATCH_SHARE: f64 = 0.05;
/// The weight of a workload that asks for next to nothing, which is more than that of an idle one.
const LEAST_WEIGHT: f64 = 1e-6;
/// The division is uneven where a node has more work than the worst node of an even one, by this factor.
const UNEVEN: f64 = 1.25;

/// The work of one workload.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Need {
    /// Nodes that do nothing but serve its sessions with a rate.
    pub(super) live_nodes: f64,
    /// It has sessions without a rate, which take what is left.
    pub(super) has_batch: bool,
    /// Nothing has been asked of it for a while.
    pub(super) is_idle: bool,
}

/// Nodes' worth of work of each workload: live before batch. 0 for idle ones.
pub(super) fn weights(needs: &[Need], nodes: usize) -> Vec<f64> {
    let awake = needs.iter().filter(|need| !need.is_idle);
    let live: f64 = awake.clone().map(|need| need.live_nodes).sum();
    let batches = awake.filter(|need| need.has_batch).count().max(1) as f64;
    let batch = ((nodes as f64 - live) / batches).max(LEAST_BATCH_SHARE * nodes as f64);
    let weights = needs.iter().map(|need| match (need.is_idle, need.has_batch) {
        (true, _) => 0.0,
        (false, true) => (need.live_nodes + batch).max(LEAST_WEIGHT),
        (false, false) => need.live_nodes.max(LEAST_WEIGHT),
    });
    weights.collect()
}

/// Nodes of each workload in proportion to its weight: one at least, the rest by largest remainder; none for weights of 0.
/// Where workloads outnumber nodes, one each.
pub(super) fn even_counts(weights: &[f64], nodes: usize) -> Vec<usize> {
    let mut counts: Vec<usize> = weights.iter().map(|&weight| usize::from(weight > 0.0)).collect();
    let mut rest: Vec<usize> = (0..weights.len()).filter(|&i| weights[i] > 0.0).collect();
    let awake = rest.len();
    if awake >= nodes {
        return counts;
    }
    let mut quotas = loop {
        let all: f64 = rest.iter().map(|&i| weights[i]).sum();
        let nodes_of_rest = (nodes - (awake - rest.len())) as f64;
        let quotas: Vec<(usize, f64)> = rest.iter().map(|&i| (i, weights[i] / all * nodes_of_rest)).collect();
        // Those whose share is less than the one node that they have leave the others less.
        match quotas.iter().position(|(_, quota)| *quota < 1.0) {
            Some(small) => {
                rest.remove(small);
            }
            None => break quotas,
        }
    };
    quotas.iter().for_each(|&(i, quota)| counts[i] = quota as usize);
    quotas.sort_by(|(_, a), (_, b)| b.fract().total_cmp(&a.fract()));
    let left = nodes.saturating_sub(counts.iter().sum());
    quotas.iter().cycle().take(left).for_each(|&(i, _)| counts[i] += 1);
    counts
}

/// What a workload has to do with one node.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Tie {
    /// The node can serve the workload.
    pub(super) is_usable: bool,
    /// The node serves it.
    pub(super) is_held: bool,
    /// What the workload would lose with it: more for a role, and for more views.
    pub(super) worth: f64,
}

/// One workload's part of the division.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Claim {
    pub(super) weight: f64,
    /// For each node.
    pub(super) ties: Vec<Tie>,
}

impl Claim {
    fn holds(&self, node: usize) -> bool {
        self.ties[node].is_held
    }

    fn held(&self) -> usize {
        self.ties.iter().filter(|tie| tie.is_held).count()
    }

    fn is_awake(&self) -> bool {
        self.weight > 0.0
    }
}

/// What the loss of a node costs those that it serves.
struct Loss {
    /// Of the one with the most work for each of its nodes.
    work_per_node: f64,
    worth: f64,
    node: usize,
}

/// The division, and its changes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NodeShares {
    pub(super) claims: Vec<Claim>,
    nodes: usize,
}

impl NodeShares {
    pub(super) fn new(claims: Vec<Claim>, nodes: usize) -> Self {
        Self { claims, nodes }
    }

    fn weights(&self) -> Vec<f64> {
        self.claims.iter().map(|claim| claim.weight).collect()
    }

    fn awake(&self) -> impl Iterator<Item = usize> {
        (0..self.claims.len()).filter(|&i| self.claims[i].is_awake())
    }

    /// Workloads that are not idle and that a node serves.
    fn carried_awake(&self, node: usize) -> impl Iterator<Item = usize> {
        self.awake().filter(move |&i| self.claims[i].holds(node))
    }

    fn is_own(&self, of: usize, node: usize) -> bool {
        self.claims[of].holds(node) && self.carried_awake(node).all(|i| i == of)
    }

    /// Nodes that serve no other workload but idle ones.
    fn own(&self, of: usize) -> usize {
        (0..self.nodes).filter(|&node| self.is_own(of, node)).count()
    }

    /// Work for each node of a workload's own; infinite where it has none.
    fn work_per_node(&self, of: usize) -> f64 {
        self.claims[of].weight / self.own(of) as f64
    }

    /// Work of each node, if workloads spread theirs evenly over their nodes.
    fn work(&self) -> Vec<f64> {
        let each: Vec<f64> = self.claims.iter().map(|claim| claim.weight / claim.held().max(1) as f64).collect();
        (0..self.nodes).map(|node| self.carried_awake(node).map(|i| each[i]).sum()).collect()
    }

    /// The work of the worst node.
    fn worst_work(&self) -> f64 {
        self.work().into_iter().fold(0.0, f64::max)
    }

    fn outnumber(&self) -> bool {
        self.awake().count() > self.nodes
    }

    /// Whether a node has clearly more work than the worst node of an even division, or a workload only shares nodes though
    /// there is one for it.
    pub(super) fn is_uneven(&self) -> bool {
        let only_shares = !self.outnumber() && self.awake().any(|i| self.own(i) == 0);
        only_shares || self.worst_work() > UNEVEN * self.even_work()
    }

    /// The work of the worst node of an even division.
    fn even_work(&self) -> f64 {
        let weights = self.weights();
        if !self.outnumber() {
            let counts = even_counts(&weights, self.nodes);
            let each = weights.iter().zip(&counts).filter(|(_, count)| **count > 0).map(|(w, &count)| w / count as f64);
            return each.fold(0.0, f64::max);
        }
        let mut heaviest_first = weights;
        heaviest_first.sort_by(|a, b| b.total_cmp(a));
        let mut work = vec![0.0; self.nodes];
        for weight in heaviest_first {
            if let Some(least) = work.iter_mut().min_by(|a, b| f64::total_cmp(a, b)) {
                *least += weight;
            }
        }
        work.into_iter().fold(0.0, f64::max)
    }

    /// Gives every node that serves nobody to the workload with the most work for each of its nodes. Idle ones get one only
    /// where all are idle, or they have none.
    pub(super) fn give_free(&mut self) {
        for node in 0..self.nodes {
            if self.claims.iter().any(|claim| claim.holds(node)) {
                continue;
            }
            let candidates = (0..self.claims.len()).filter(|&i| self.claims[i].ties[node].is_usable);
            // The first of equals.
            let neediest = candidates.rev().max_by(|&a, &b| {
                let [held_a, held_b] = [a, b].map(|i| self.claims[i].held());
                let [awake_a, awake_b] = [a, b].map(|i| self.claims[i].is_awake());
                let by_work = self.work_per_node(a).total_cmp(&self.work_per_node(b));
                (held_a == 0, awake_a).cmp(&(held_b == 0, awake_b)).then(by_work).then(held_b.cmp(&held_a))
            });
            if let Some(neediest) = neediest {
                self.claims[neediest].ties[node].is_held = true;
            }
        }
    }

    /// Gives nodes to every workload that has none: its even share of the nodes, if it may take any; else it shares the node
    /// with the least work. Whether any was taken.
    pub(super) fn house(&mut self, may_take: bool) -> bool {
        let mut has_taken = false;
        for homeless in 0..self.claims.len() {
            if self.claims[homeless].held() > 0 {
                continue;
            }
            while may_take && self.claims[homeless].is_awake() && self.take(homeless) {
                has_taken = true;
            }
            if self.claims[homeless].held() == 0 {
                self.share_least(homeless);
            }
        }
        has_taken
    }

    fn share_least(&mut self, homeless: usize) {
        let work = self.work();
        let usable = (0..self.nodes).filter(|&node| self.claims[homeless].ties[node].is_usable);
        let least = usable.min_by(|&a, &b| {
            let [carried_a, carried_b] = [a, b].map(|node| self.claims.iter().filter(|c| c.holds(node)).count());
            work[a].total_cmp(&work[b]).then(carried_a.cmp(&carried_b))
        });
        if let Some(node) = least {
            self.claims[homeless].ties[node].is_held = true;
        }
    }

    /// Gives a workload with less than its even count one node more of its own: of the workload with the most nodes for its
    /// work. An idle one shares its last node instead.
    fn take(&mut self, receiver: usize) -> bool {
        let counts = even_counts(&self.weights(), self.nodes);
        let own: Vec<usize> = (0..self.claims.len()).map(|i| self.own(i)).collect();
        if self.outnumber() || own[receiver] >= counts[receiver] {
            return false;
        }
        let losses = (0..self.nodes).filter_map(|node| self.loss_of(node, receiver, &own, &counts));
        let least = losses.min_by(|a, b| a.work_per_node.total_cmp(&b.work_per_node).then(a.worth.total_cmp(&b.worth)));
        let Some(Loss { node, .. }) = least else { return false };
        self.hand_over(node, receiver);
        true
    }

    /// The loss of the workloads that a node serves, if the receiver takes it; `None` where the receiver cannot. `own` has the
    /// number of each workload's own nodes, `counts` the even one.
    fn loss_of(&self, node: usize, receiver: usize, own: &[usize], counts: &[usize]) -> Option<Loss> {
        if !self.claims[receiver].ties[node].is_usable || self.is_own(receiver, node) {
            return None;
        }
        let mut work_per_node = 0.0_f64;
        for loser in self.carried_awake(node).filter(|&i| i != receiver) {
            let can_lose =
                if self.is_own(loser, node) { own[loser] > counts[loser] } else { self.claims[loser].held() > 1 };
            if !can_lose {
                return None;
            }
            work_per_node = work_per_node.max(self.claims[loser].weight / own[loser] as f64);
        }
        let worth = self.claims.iter().filter(|claim| claim.holds(node)).map(|claim| claim.ties[node].worth).sum();
        Some(Loss { work_per_node, worth, node })
    }

    fn hand_over(&mut self, node: usize, receiver: usize) {
        for claim in &mut self.claims {
            if claim.is_awake() || claim.held() > 1 {
                claim.ties[node].is_held = false;
            }
        }
        self.claims[receiver].ties[node].is_held = true;
        // With one of its own it need not share others.
        for other in 0..self.nodes {
            if self.carried_awake(other).any(|i| i != receiver) {
                self.claims[receiver].ties[other].is_held = false;
            }
        }
    }

    /// One change towards an even division, if there is one.
    pub(super) fn step(&mut self) -> bool {
        if self.outnumber() {
            return self.relieve();
        }
        let mut receivers: Vec<usize> = self.awake().collect();
        receivers.sort_by(|&a, &b| self.work_per_node(b).total_cmp(&self.work_per_node(a)));
        receivers.into_iter().any(|receiver| self.take(receiver))
    }

    /// Moves a workload from the node with the most work to another, where that makes the worst node better.
    fn relieve(&mut self) -> bool {
        let work = self.work();
        let Some(from) = (0..self.nodes).max_by(|&a, &b| work[a].total_cmp(&work[b])) else { return false };
        let moves = self.carried_awake(from).flat_map(|carried| {
            let claim = &self.claims[carried];
            let elsewhere = (0..self.nodes).filter(|&to| claim.ties[to].is_usable && !claim.holds(to)).map(Some);
            let away = (claim.held() > 1).then_some(None);
            elsewhere.chain(away).map(move |to| (carried, to))
        });
        let all = moves.map(|(carried, to)| {
            let mut shares = self.clone();
            shares.claims[carried].ties[from].is_held = false;
            if let Some(to) = to {
                shares.claims[carried].ties[to].is_held = true;
            }
            (shares.worst_work(), shares)
        });
        match all.min_by(|(a, _), (b, _)| a.total_cmp(b)) {
            Some((worst, shares)) if worst < self.worst_work() * (1.0 - 1e-9) => {
                *self = shares;
                true
            }
            _ => false,
        }
    }
}

#[cfg(test)]
#[path = "node_shares_tests.rs"]
mod tests;
