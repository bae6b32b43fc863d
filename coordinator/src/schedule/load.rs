//! The work that sessions ask of the cluster, and a node's part in it.

use cluster::{Costs, Policy};

use super::NodeCosts;
use super::makespan::{Worker, distribute};

/// The load of the cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    /// S: images of a sample set.
    pub images: usize,
    /// Tiles of each image, to be shared among samplers: at least 1.
    pub tiles: usize,
    /// View cells that the images belong to: at least 1.
    pub cells: usize,
    /// Common cells, which every compositor loads.
    pub common_cells: usize,
    /// Sample sets that differ, of the whole session.
    pub sets: usize,
    /// V: views of a sample set.
    pub views: usize,
    /// An image can only be sampled after those before it: sets stay on one node, and nodes take them in turn.
    pub images_are_sequential: bool,
    /// The set has been sampled and is shown again and again: only views cost anything.
    pub is_already_sampled: bool,
}

impl Default for Load {
    fn default() -> Self {
        Self {
            images: 0,
            tiles: 1,
            cells: 1,
            common_cells: 0,
            sets: 1,
            views: 0,
            images_are_sequential: false,
            is_already_sampled: false,
        }
    }
}

impl Load {
    /// The same, with images in `tiles` tiles.
    #[must_use]
    pub fn tiled(self, tiles: usize) -> Self {
        Self { tiles, ..self }
    }

    /// Parts of a set that are sampled: images, or tiles.
    #[must_use]
    pub fn parts(&self) -> usize {
        self.images * self.tiles
    }

    /// Seconds of one part.
    #[must_use]
    pub fn part_s(&self, costs: &Costs) -> f64 {
        if self.is_already_sampled { 0.0 } else { costs.sample_tile_s(self.tiles) }
    }

    /// The nodes that make views, and when each can begin.
    pub(super) fn view_workers(&self, policy: Policy, nodes: &[NodeCosts]) -> Vec<Worker> {
        match policy {
            Policy::Pipeline if nodes.len() > 1 => self.compositors(nodes),
            Policy::Pipeline | Policy::TimeShare => self.sharers(nodes),
            Policy::Direct => drawers(nodes),
        }
    }

    /// Nodes that load the set and make views.
    pub(super) fn compositors(&self, nodes: &[NodeCosts]) -> Vec<Worker> {
        let workers =
            nodes.iter().map(|node| Worker { start_s: self.load_set_s(node, nodes.len()), job_s: node.view_s() });
        workers.collect()
    }

    /// Each samples its part and gets the rest before it makes views.
    pub(super) fn sharers(&self, nodes: &[NodeCosts]) -> Vec<Worker> {
        let others = nodes.len().saturating_sub(1);
        let workers = nodes.iter().zip(self.mean_part_counts(nodes)).map(|(node, own)| {
            let sampled_s = own * self.part_s(&node.costs);
            let exchanged_s = self.exchange_s(node, own, others);
            Worker { start_s: sampled_s + exchanged_s + self.load_set_s(node, nodes.len()), job_s: node.view_s() }
        });
        workers.collect()
    }

    /// Seconds in which a node that samples and composites gets all images but its own, and sends those to all others.
    pub(super) fn exchange_s(&self, node: &NodeCosts, own_parts: f64, others: usize) -> f64 {
        let own_images = own_parts / self.tiles as f64;
        let exchanged = (self.images as f64 - own_images).max(own_images * others as f64);
        if others == 0 || self.is_already_sampled { 0.0 } else { exchanged * node.transfer_s() }
    }

    /// d for each cell that one of `compositors` nodes has views of, where sets are loaded at all.
    fn load_set_s(&self, node: &NodeCosts, compositors: usize) -> f64 {
        if self.is_already_sampled { 0.0 } else { self.cells_each(compositors) as f64 * node.costs.load_set_s }
    }

    /// Views are shared cell by cell: a node has an even share of the view cells, and part of another; and all common cells.
    fn cells_each(&self, compositors: usize) -> usize {
        (self.cells.div_ceil(compositors.max(1)) + 1).min(self.cells) + self.common_cells
    }

    /// Nodes that can sample at the same time.
    fn most_at_once(&self) -> usize {
        if self.images_are_sequential { self.sets } else { self.parts() }
    }

    /// Samplers that still leave a node for views; one node does both.
    #[must_use]
    pub fn most_samplers(&self, nodes: usize) -> usize {
        self.most_at_once().min(nodes.saturating_sub(1).max(1)).max(1)
    }

    /// Parts of a set that each sampler makes: by speed; or all, where samplers take sets in turn.
    pub(super) fn part_counts(&self, samplers: &[NodeCosts]) -> Vec<usize> {
        if self.images_are_sequential {
            return (0..samplers.len()).map(|i| if i < self.sets.max(1) { self.parts() } else { 0 }).collect();
        }
        let workers = samplers.iter().map(|node| Worker { start_s: 0.0, job_s: self.part_s(&node.costs) });
        distribute(self.parts(), &workers.collect::<Vec<_>>())
    }

    /// The same, as the mean over all sets: where samplers take sets in turn, each makes some of the sets.
    pub(super) fn mean_part_counts(&self, samplers: &[NodeCosts]) -> Vec<f64> {
        let sets = self.sets.max(1);
        let at_once = samplers.len().clamp(1, sets);
        let share = if self.images_are_sequential { sets.div_ceil(at_once) as f64 / sets as f64 } else { 1.0 };
        self.part_counts(samplers).into_iter().map(|count| count as f64 * share).collect()
    }
}

/// Nodes that draw views from the scene.
pub(super) fn drawers(nodes: &[NodeCosts]) -> Vec<Worker> {
    let views_s = nodes.iter().map(|node| node.costs.direct_view_s + node.costs.encode_view_s);
    views_s.map(|job_s| Worker { start_s: 0.0, job_s }).collect()
}
