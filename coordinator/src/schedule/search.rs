//! The division of the nodes with the least predicted time: every K over the nodes in order, then moves and swaps.

use std::cmp::Ordering;

use super::{Load, NodeCosts, pipeline_s};

/// Most nodes of which moves and swaps are tried: beyond, the search takes longer than it saves.
const MOST_NODES_TO_MOVE: usize = 32;
/// Divisions that are improved by moves.
const STARTS: usize = 4;
/// A move that gains less is ignored: rounding would move nodes back and forth.
const LEAST_GAIN: f64 = 1e-9;

/// A division of the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Division {
    /// Whether each node samples; the others composite.
    pub samples: Vec<bool>,
    /// T of the division.
    pub time_s: f64,
}

impl Division {
    /// With its predicted time.
    #[must_use]
    pub fn new(load: &Load, nodes: &[NodeCosts], samples: Vec<bool>) -> Self {
        let time_s = pipeline_s(load, nodes, &samples);
        Self { samples, time_s }
    }

    /// K.
    #[must_use]
    pub fn sampler_count(&self) -> usize {
        self.samples.iter().filter(|samples| **samples).count()
    }

    fn flipped(&self, load: &Load, nodes: &[NodeCosts], flips: &[usize]) -> Self {
        let mut samples = self.samples.clone();
        for &i in flips {
            samples[i] = !samples[i];
        }
        Self::new(load, nodes, samples)
    }
}

/// Nodes in the order in which they become samplers. Equal nodes: present samplers (`sampled`) first, so that K ± 1 is one
/// change of role. Unequal nodes: by s/q, how much faster they sample than they composite.
pub(super) fn order(nodes: &[NodeCosts], sampled: &[bool]) -> Vec<usize> {
    let equal = NodeCosts::are_equal(nodes);
    let ratios = nodes.iter().map(|node| node.view_s() / node.costs.sample_image_s.max(f64::MIN_POSITIVE));
    let ratios: Vec<f64> = ratios.collect();
    let mut order: Vec<usize> = (0..nodes.len()).collect();
    order.sort_by_key(|&i| !sampled.get(i).copied().unwrap_or(false));
    if !equal {
        order.sort_by(|&a, &b| ratios[b].total_cmp(&ratios[a]));
    }
    order
}

/// The first K in `order` sample.
pub(super) fn first(load: &Load, nodes: &[NodeCosts], order: &[usize], k: usize) -> Division {
    let mut samples = vec![false; nodes.len()];
    for &i in order.iter().take(k) {
        samples[i] = true;
    }
    Division::new(load, nodes, samples)
}

/// The best division of every K; with `moves`, and unequal nodes, the best few are improved. The least K of equal times.
pub(super) fn enumerate(load: &Load, nodes: &[NodeCosts], order: &[usize], moves: bool) -> Division {
    let mut all: Vec<Division> = (1..=load.most_samplers(nodes.len())).map(|k| first(load, nodes, order, k)).collect();
    all.sort_by(by_time);
    if moves && !NodeCosts::are_equal(nodes) && nodes.len() <= MOST_NODES_TO_MOVE {
        all.truncate(STARTS);
        all = all.into_iter().map(|division| improve(load, nodes, division, true)).collect();
    }
    all.into_iter().min_by(by_time).unwrap_or_else(|| first(load, nodes, order, 1))
}

fn by_time(a: &Division, b: &Division) -> Ordering {
    a.time_s.total_cmp(&b.time_s)
}

/// Single moves (where K may change) and swaps, the best one first, until none gains.
pub(super) fn improve(load: &Load, nodes: &[NodeCosts], mut best: Division, k_may_change: bool) -> Division {
    while let Some(better) = neighbours(load, nodes, &best, k_may_change).min_by(by_time) {
        if better.time_s >= best.time_s * (1.0 - LEAST_GAIN) {
            break;
        }
        best = better;
    }
    best
}

fn neighbours<'a>(
    load: &'a Load,
    nodes: &'a [NodeCosts],
    from: &'a Division,
    k_may_change: bool,
) -> impl Iterator<Item = Division> + 'a {
    let count = nodes.len();
    let singles = (0..if k_may_change { count } else { 0 }).map(|i| vec![i]);
    let swaps = (0..count)
        .flat_map(move |i| (0..i).filter(move |&j| from.samples[i] != from.samples[j]).map(move |j| vec![i, j]));
    let divisions = singles.chain(swaps).map(|flips| from.flipped(load, nodes, &flips));
    divisions.filter(|division| (1..=load.most_samplers(nodes.len())).contains(&division.sampler_count()))
}

/// A step from the present division towards another by at most `changes` changes of role, the best change first. Nodes
/// without `has_role` take their role at once, uncounted.
pub(super) fn towards(
    load: &Load,
    nodes: &[NodeCosts],
    present: &[bool],
    target: &Division,
    has_role: &[bool],
    changes: usize,
) -> Division {
    let start = (0..nodes.len()).map(|i| if has_role[i] { present[i] } else { target.samples[i] });
    let mut division = Division::new(load, nodes, start.collect());
    for _ in 0..changes {
        let open = (0..nodes.len()).filter(|&i| division.samples[i] != target.samples[i]);
        let Some(next) = open.map(|i| division.flipped(load, nodes, &[i])).min_by(by_time) else { break };
        division = next;
    }
    division
}

#[cfg(test)]
#[path = "search_tests.rs"]
mod tests;
