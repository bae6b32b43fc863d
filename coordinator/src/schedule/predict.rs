//! Predicted seconds of one sample set and its views, for whoever does it: T(A).
//!
//! Images and views are whole. A set is loaded once on each node that makes views of it.

use super::NodeCosts;
use super::deal::{Worker, deal, finish_s};

/// What is asked of the cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    /// S: images of a sample set.
    pub images: usize,
    /// Sample sets that differ, of the whole session.
    pub sets: usize,
    /// V: views of a sample set.
    pub views: usize,
    /// Whether an image can only be sampled after those before it: sets stay on one node, and nodes take them in turn.
    pub in_order: bool,
}

impl Load {
    /// Nodes that can sample at the same time.
    #[must_use]
    pub fn most_at_once(&self) -> usize {
        if self.in_order { self.sets } else { self.images }
    }

    /// Samplers that still leave a node for views; one node does both.
    #[must_use]
    pub fn most_samplers(&self, nodes: usize) -> usize {
        self.most_at_once().min(nodes.saturating_sub(1).max(1)).max(1)
    }

    /// Images that each of `samplers` makes of a set: by speed; or all, where they take sets in turn.
    #[must_use]
    pub fn image_counts(&self, samplers: &[NodeCosts]) -> Vec<usize> {
        if self.in_order {
            return (0..samplers.len()).map(|i| if i < self.sets.max(1) { self.images } else { 0 }).collect();
        }
        let worker = |node: &NodeCosts| Worker { start_s: 0.0, job_s: node.costs.sample_image_s };
        deal(self.images, &samplers.iter().map(worker).collect::<Vec<_>>())
    }

    /// The same, over all sets: of sets in turn a sampler makes some.
    fn mean_image_counts(&self, samplers: &[NodeCosts]) -> Vec<f64> {
        let sets = self.sets.max(1);
        let at_once = samplers.len().clamp(1, sets);
        let share = if self.in_order { sets.div_ceil(at_once) as f64 / sets as f64 } else { 1.0 };
        self.image_counts(samplers).into_iter().map(|count| count as f64 * share).collect()
    }
}

/// max(sampling, transfer, compositing) with `samples[i]` saying whether node i samples; the others composite. One node
/// does all in turn.
#[must_use]
pub fn pipeline_s(load: &Load, nodes: &[NodeCosts], samples: &[bool]) -> f64 {
    if nodes.len() == 1 {
        return time_share_s(load, nodes);
    }
    let who = |sampling: bool| -> Vec<NodeCosts> {
        nodes.iter().zip(samples).filter(|(_, samples)| **samples == sampling).map(|(node, _)| *node).collect()
    };
    let (samplers, compositors) = (who(true), who(false));
    if samplers.is_empty() && load.images > 0 {
        return f64::INFINITY;
    }
    let shares = load.mean_image_counts(&samplers);
    let sample_s = samplers.iter().zip(&shares).map(|(node, share)| share * node.costs.sample_image_s);
    let send_s = samplers.iter().zip(&shares).map(|(n, share)| share * n.transfer_image_s * compositors.len() as f64);
    let receive_s = compositors.iter().map(|node| load.images as f64 * node.transfer_image_s);
    let composite_s = views_s(load, &compositors);
    sample_s.chain(send_s).chain(receive_s).fold(composite_s, f64::max)
}

/// Every node samples its share, gets the rest, and makes its share of the views.
#[must_use]
pub fn time_share_s(load: &Load, nodes: &[NodeCosts]) -> f64 {
    if nodes.is_empty() {
        return f64::INFINITY;
    }
    let shares = load.mean_image_counts(nodes);
    let others = nodes.len() - 1;
    let worker = |(node, &own): (&NodeCosts, &f64)| Worker {
        start_s: own * node.costs.sample_image_s + exchange_s(load, node, own, others) + node.costs.load_set_s,
        job_s: node.view_s(),
    };
    let workers: Vec<Worker> = nodes.iter().zip(&shares).map(worker).collect();
    let sample_s = nodes.iter().zip(&shares).map(|(node, own)| own * node.costs.sample_image_s);
    sample_s.fold(finish_s(load.views, &workers), f64::max)
}

/// A node that samples and composites gets all images but its own, and sends those to all others.
fn exchange_s(load: &Load, node: &NodeCosts, own: f64, others: usize) -> f64 {
    if others == 0 { 0.0 } else { (load.images as f64 - own).max(own * others as f64) * node.transfer_image_s }
}

/// Every node draws its share of the views from the scene.
#[must_use]
pub fn direct_s(load: &Load, nodes: &[NodeCosts]) -> f64 {
    let worker = |node: &NodeCosts| Worker { start_s: 0.0, job_s: node.costs.direct_view_s + node.costs.encode_view_s };
    finish_s(load.views, &nodes.iter().map(worker).collect::<Vec<_>>())
}

fn views_s(load: &Load, compositors: &[NodeCosts]) -> f64 {
    let worker = |node: &NodeCosts| Worker { start_s: node.costs.load_set_s, job_s: node.view_s() };
    finish_s(load.views, &compositors.iter().map(worker).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::test_support::{COSTS, nodes};

    const LOAD: Load = Load { images: 4, sets: 1, views: 1000, in_order: false };

    fn first(count: usize, of: usize) -> Vec<bool> {
        (0..of).map(|i| i < count).collect()
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9
    }

    #[test]
    fn equal_nodes_as_in_the_formulas() {
        assert!(close(pipeline_s(&LOAD, &nodes(5, COSTS), &first(1, 5)), 0.005 + 250.0 * 0.01));
        assert!(close(pipeline_s(&Load { views: 4, ..LOAD }, &nodes(5, COSTS), &first(3, 5)), 0.2), "whole images");
        assert!(close(direct_s(&LOAD, &nodes(5, COSTS)), 200.0 * 0.101));
        assert!(close(time_share_s(&LOAD, &nodes(4, COSTS)), 0.1 + 0.005 + 2.5));
        assert!(close(pipeline_s(&Load { views: 100, ..LOAD }, &nodes(1, COSTS), &[true]), 0.4 + 0.005 + 1.0));
        assert!(pipeline_s(&LOAD, &nodes(3, COSTS), &first(3, 3)).is_infinite());
        assert!(pipeline_s(&LOAD, &nodes(3, COSTS), &first(0, 3)).is_infinite());
    }

    #[test]
    fn whole_sets_in_turn() {
        // 30 sets by 4 nodes: 8 rounds of 0.4 s.
        let load = Load { sets: 30, views: 2, in_order: true, ..LOAD };
        assert!(close(pipeline_s(&load, &nodes(5, COSTS), &first(4, 5)), 8.0 * 0.4 / 30.0));
        let one = Load { in_order: true, views: 20, ..LOAD };
        assert!(close(pipeline_s(&one, &nodes(5, COSTS), &first(1, 5)), 0.4));
    }

    #[test]
    fn every_compositor_receives_the_set_and_every_sampler_sends_it_to_all() {
        let mut unequal = nodes(4, COSTS);
        unequal[3].transfer_image_s = 2.0;
        assert!(close(pipeline_s(&LOAD, &unequal, &first(1, 4)), 8.0), "4 images received by the slow one");
        let slow_sender = [false, false, false, true];
        assert!(close(pipeline_s(&LOAD, &unequal, &slow_sender), 24.0), "4 images sent to 3");
    }
}
