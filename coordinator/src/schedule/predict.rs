//! Predicted seconds of one sample set and its views, for whoever does it: T(A).
//!
//! Tiles of images, and views, are whole. A set is loaded once on each node that makes views of it.

use std::num::NonZeroU32;

use cluster::Policy;

use super::NodeCosts;
use super::deal::{Worker, deal, finish_s};
use super::transfer::{Links, best_way};

/// What is asked of the cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    /// S: images of a sample set.
    pub images: usize,
    /// Into how many tiles each image is cut, to be shared among samplers: at least 1.
    pub tiles: usize,
    /// View cells that the images belong to: at least 1.
    pub cells: usize,
    /// Sample sets that differ, of the whole session.
    pub sets: usize,
    /// V: views of a sample set.
    pub views: usize,
    /// Whether an image can only be sampled after those before it: sets stay on one node, and nodes take them in turn.
    pub in_order: bool,
    /// Whether the set has been sampled and is shown again and again: then only views cost anything.
    pub still: bool,
}

impl Default for Load {
    fn default() -> Self {
        Self { images: 0, tiles: 1, cells: 1, sets: 1, views: 0, in_order: false, still: false }
    }
}

impl Load {
    /// The same, with images cut into so many tiles.
    #[must_use]
    pub fn cut(self, tiles: usize) -> Self {
        Self { tiles, ..self }
    }

    /// What is sampled of a set: images, or tiles.
    #[must_use]
    pub fn parts(&self) -> usize {
        self.images * self.tiles
    }

    /// One of them.
    #[must_use]
    pub fn part_s(&self, node: &NodeCosts) -> f64 {
        if self.still { 0.0 } else { node.costs.sample_tile_s(self.tiles) }
    }

    /// Who makes views, and from when on.
    #[must_use]
    pub fn view_workers(&self, policy: Policy, nodes: &[NodeCosts]) -> Vec<Worker> {
        match policy {
            Policy::Pipeline if nodes.len() > 1 => {
                nodes.iter().map(|node| self.compositor(node, nodes.len())).collect()
            }
            Policy::Pipeline | Policy::TimeShare => self.sharers(nodes),
            Policy::Direct => nodes.iter().map(drawer).collect(),
        }
    }

    fn compositor(&self, node: &NodeCosts, of: usize) -> Worker {
        Worker { start_s: self.load_set_s(node, of), job_s: node.view_s() }
    }

    /// Each samples its part and gets the rest before it makes views.
    fn sharers(&self, nodes: &[NodeCosts]) -> Vec<Worker> {
        let others = nodes.len().saturating_sub(1);
        let worker = |(node, own): (&NodeCosts, f64)| Worker {
            start_s: own * self.part_s(node) + exchange_s(self, node, own, others) + self.load_set_s(node, nodes.len()),
            job_s: node.view_s(),
        };
        nodes.iter().zip(self.mean_image_counts(nodes)).map(worker).collect()
    }

    /// d, where sets are loaded at all, of each cell that a node has views of: it is one of so many that make them.
    fn load_set_s(&self, node: &NodeCosts, of: usize) -> f64 {
        if self.still { 0.0 } else { self.cells_each(of) as f64 * node.costs.load_set_s }
    }

    /// Views are dealt cell by cell: a node has an even share of the cells, and part of another.
    fn cells_each(&self, of: usize) -> usize {
        (self.cells.div_ceil(of.max(1)) + 1).min(self.cells)
    }

    /// Nodes that can sample at the same time.
    #[must_use]
    pub fn most_at_once(&self) -> usize {
        if self.in_order { self.sets } else { self.parts() }
    }

    /// Samplers that still leave a node for views; one node does both.
    #[must_use]
    pub fn most_samplers(&self, nodes: usize) -> usize {
        self.most_at_once().min(nodes.saturating_sub(1).max(1)).max(1)
    }

    /// Images, or tiles, that each of `samplers` makes of a set: by speed; or all, where they take sets in turn.
    #[must_use]
    pub fn image_counts(&self, samplers: &[NodeCosts]) -> Vec<usize> {
        if self.in_order {
            return (0..samplers.len()).map(|i| if i < self.sets.max(1) { self.parts() } else { 0 }).collect();
        }
        let worker = |node: &NodeCosts| Worker { start_s: 0.0, job_s: self.part_s(node) };
        deal(self.parts(), &samplers.iter().map(worker).collect::<Vec<_>>())
    }

    /// The same, over all sets: of sets in turn a sampler makes some.
    fn mean_image_counts(&self, samplers: &[NodeCosts]) -> Vec<f64> {
        let sets = self.sets.max(1);
        let at_once = samplers.len().clamp(1, sets);
        let share = if self.in_order { sets.div_ceil(at_once) as f64 / sets as f64 } else { 1.0 };
        self.image_counts(samplers).into_iter().map(|count| count as f64 * share).collect()
    }
}

/// max(sampling, transfer, compositing) with `samples[i]` saying whether node i samples; the others composite. Images go
/// the best way. One node does all in turn.
#[must_use]
pub fn pipeline_s(load: &Load, nodes: &[NodeCosts], samples: &[bool]) -> f64 {
    pipeline(load, nodes, samples, best_way).1
}

/// The same, where images go a given way: from the samplers, or by relays with so many others each.
#[must_use]
pub fn pipeline_by_s(load: &Load, nodes: &[NodeCosts], samples: &[bool], relay_fanout: Option<NonZeroU32>) -> f64 {
    let given = |links: &Links, rest_s: f64| (relay_fanout, rest_s.max(links.slowest_s(relay_fanout)));
    pipeline(load, nodes, samples, given).1
}

/// How images reach the compositors of a division best.
#[must_use]
pub fn relay_fanout(load: &Load, nodes: &[NodeCosts], samples: &[bool]) -> Option<NonZeroU32> {
    pipeline(load, nodes, samples, best_way).0
}

type Way = (Option<NonZeroU32>, f64);

fn pipeline(load: &Load, nodes: &[NodeCosts], samples: &[bool], way: impl Fn(&Links, f64) -> Way) -> Way {
    if nodes.len() == 1 {
        return (None, time_share_s(load, nodes));
    }
    let who = |sampling: bool| -> Vec<NodeCosts> {
        nodes.iter().zip(samples).filter(|(_, samples)| **samples == sampling).map(|(node, _)| *node).collect()
    };
    let (samplers, compositors) = (who(true), who(false));
    if samplers.is_empty() && load.images > 0 {
        return (None, f64::INFINITY);
    }
    let shares = load.mean_image_counts(&samplers);
    let sample_s = samplers.iter().zip(&shares).map(|(node, share)| share * load.part_s(node));
    let rest_s = sample_s.fold(views_s(load, &compositors), f64::max);
    if load.still { (None, rest_s) } else { way(&links(load, (&samplers, &shares), &compositors), rest_s) }
}

fn links(load: &Load, (samplers, shares): (&[NodeCosts], &[f64]), compositors: &[NodeCosts]) -> Links {
    let images = shares.iter().map(|parts| parts / load.tiles as f64);
    Links {
        sends_s: samplers.iter().zip(images).map(|(node, images)| images * node.transfer_image_s).collect(),
        receives_s: compositors.iter().map(|node| load.images as f64 * node.transfer_image_s).collect(),
    }
}

/// Every node samples its share, gets the rest, and makes its share of the views.
#[must_use]
pub fn time_share_s(load: &Load, nodes: &[NodeCosts]) -> f64 {
    if nodes.is_empty() {
        return f64::INFINITY;
    }
    let (shares, others) = (load.mean_image_counts(nodes), nodes.len() - 1);
    // Who samples does so for every set, and sends it, though it may make no view.
    let own_s = |(node, &own): (&NodeCosts, &f64)| (own * load.part_s(node)).max(exchange_s(load, node, own, others));
    nodes.iter().zip(&shares).map(own_s).fold(finish_s(load.views, &load.sharers(nodes)), f64::max)
}

/// A node that samples and composites gets all images but its own, and sends those to all others.
fn exchange_s(load: &Load, node: &NodeCosts, own: f64, others: usize) -> f64 {
    let own_images = own / load.tiles as f64;
    let exchanged = (load.images as f64 - own_images).max(own_images * others as f64);
    if others == 0 || load.still { 0.0 } else { exchanged * node.transfer_image_s }
}

/// Every node draws its share of the views from the scene.
#[must_use]
pub fn direct_s(load: &Load, nodes: &[NodeCosts]) -> f64 {
    finish_s(load.views, &nodes.iter().map(drawer).collect::<Vec<_>>())
}

fn drawer(node: &NodeCosts) -> Worker {
    Worker { start_s: 0.0, job_s: node.costs.direct_view_s + node.costs.encode_view_s }
}

fn views_s(load: &Load, compositors: &[NodeCosts]) -> f64 {
    finish_s(load.views, &compositors.iter().map(|node| load.compositor(node, compositors.len())).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use cluster::{Costs, TileCosts};

    use super::*;
    use crate::schedule::test_support::{COSTS, nodes};

    const LOAD: Load = Load { images: 4, tiles: 1, cells: 1, sets: 1, views: 1000, in_order: false, still: false };

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
    fn who_samples_sends_to_all_though_it_makes_no_view() {
        let slow: Vec<NodeCosts> =
            nodes(50, COSTS).into_iter().map(|node| NodeCosts { transfer_image_s: 0.01, ..node }).collect();
        let time_s = time_share_s(&LOAD, &slow);
        assert!(close(time_s, 49.0 * 0.01), "{time_s}: 46 nodes alone would make the views sooner");
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
    fn tiles_share_what_whole_images_cannot() {
        let node = NodeCosts {
            costs: Costs { tiles: Some(TileCosts { overhead_s: 0.02, row_shares: None }), ..COSTS },
            transfer_image_s: 0.0,
        };
        let (load, nodes) = (Load { views: 1, ..LOAD }, [node; 12]);
        assert!(close(pipeline_s(&load, &nodes, &first(8, 12)), 0.1), "four of eight have nothing to do");
        assert!(close(pipeline_s(&load.cut(2), &nodes, &first(8, 12)), 0.06), "0.02 + 0.08 / 2 each");
        assert!(close(pipeline_s(&load.cut(4), &nodes, &first(8, 12)), 0.08), "two tiles of 0.02 + 0.08 / 4");
    }

    #[test]
    fn what_is_still_costs_views_only() {
        let load = Load { still: true, ..LOAD };
        assert!(close(pipeline_s(&load, &nodes(5, COSTS), &first(1, 5)), 2.5));
        assert!(close(time_share_s(&load, &nodes(5, COSTS)), 2.0));
        assert!(close(direct_s(&load, &nodes(5, COSTS)), direct_s(&LOAD, &nodes(5, COSTS))));
    }

    #[test]
    fn every_compositor_receives_the_set_and_every_sampler_sends_it_to_all() {
        let mut unequal = nodes(4, COSTS);
        unequal[3].transfer_image_s = 2.0;
        assert!(close(pipeline_s(&LOAD, &unequal, &first(1, 4)), 8.0), "4 images received by the slow one");
        let slow_sender = [false, false, false, true];
        assert!(close(pipeline_s(&LOAD, &unequal, &slow_sender), 8.0), "4 images sent to one, who passes them on");
    }
}
