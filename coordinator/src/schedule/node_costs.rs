//! Costs of one node, and their comparison between nodes.

use std::array;

use cluster::{Costs, TileCosts};

use super::operations::{SAMPLE_IMAGE, operations, with_operations};
use super::smoothing::median;

/// Nodes are equal when none needs this many times what another does.
const EQUAL_WITHIN: f64 = 1.1;
/// The expected cost of tiles is wrong by up to this factor.
const TILES_WITHIN: f64 = 1.5;

/// Whether the expected cost of tiles may be wrong by this ratio.
pub(super) fn is_within_tiles_error(ratio: f64) -> bool {
    (TILES_WITHIN.recip()..=TILES_WITHIN).contains(&ratio)
}

/// The costs of one node.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NodeCosts {
    /// Seconds of one operation.
    pub costs: Costs,
    /// Seconds of one sample image to or from this node; `None` before it is measured.
    pub transfer_image_s: Option<f64>,
}

impl NodeCosts {
    /// c + e.
    #[must_use]
    pub fn view_s(&self) -> f64 {
        view_s(&self.costs)
    }

    /// Costs of a node that serves several workloads in turn.
    pub(super) fn times(self, times: f64) -> Self {
        let mut costs = with_operations(&self.costs, operations(&self.costs).map(|seconds| seconds * times));
        if let Some(tiles) = &mut costs.tiles {
            tiles.overhead_s *= times;
        }
        Self { costs, transfer_image_s: self.transfer_image_s.map(|transfer_s| transfer_s * times) }
    }

    /// A link that is not measured counts as free.
    pub(super) fn transfer_s(&self) -> f64 {
        self.transfer_image_s.unwrap_or(0.0)
    }

    /// The mean of each cost. Shares of rows are the scene's: the first node's.
    pub(super) fn mean(nodes: &[Self]) -> Costs {
        let count = nodes.len().max(1) as f64;
        let means_s = array::from_fn(|i| nodes.iter().map(|node| operations(&node.costs)[i]).sum::<f64>() / count);
        let overhead_s = nodes.iter().map(|node| node.costs.tile_overhead_s()).sum::<f64>() / count;
        let row_shares = nodes.first().and_then(|node| node.costs.tiles?.row_shares);
        let rest = Costs {
            in_order: nodes.iter().any(|node| node.costs.in_order),
            tiles: TileCosts::of_image(means_s[SAMPLE_IMAGE], overhead_s, row_shares),
            ..Costs::default()
        };
        with_operations(&rest, means_s)
    }

    /// Levels the cost of sampling where nodes sample tiles: a node about as slow as most had more expensive tiles.
    pub(super) fn level_sampling(nodes: &mut [Self]) {
        let Some(middle_s) = median(nodes.iter().map(|node| node.costs.sample_image_s)) else { return };
        let all = nodes.iter_mut();
        let alike: Vec<&mut Self> =
            all.filter(|node| is_within_tiles_error(node.costs.sample_image_s / middle_s)).collect();
        let mean = Self::mean(&alike.iter().map(|node| **node).collect::<Vec<_>>());
        for node in alike {
            node.costs.sample_image_s = mean.sample_image_s;
            let tiles = node.costs.tiles.zip(mean.tiles);
            node.costs.tiles = tiles.map(|(tiles, mean)| TileCosts { overhead_s: mean.overhead_s, ..tiles });
        }
    }

    /// Whether all nodes are about as fast, so that any may have any role.
    #[must_use]
    pub fn are_equal(nodes: &[Self]) -> bool {
        are_close(nodes.iter().map(|node| node.costs.sample_image_s)) && are_close(nodes.iter().map(Self::view_s))
    }
}

fn are_close(mut seconds: impl Iterator<Item = f64> + Clone) -> bool {
    let least_s = seconds.clone().fold(f64::INFINITY, f64::min);
    seconds.all(|seconds| seconds <= least_s * EQUAL_WITHIN)
}

/// c + e.
pub(super) fn view_s(costs: &Costs) -> f64 {
    costs.reconstruct_view_s + costs.encode_view_s
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampling(sample_image_s: f64) -> NodeCosts {
        NodeCosts { costs: Costs { sample_image_s, ..Costs::default() }, ..NodeCosts::default() }
    }

    #[test]
    fn a_slow_sampler_of_tiles_differs_from_one_with_expensive_tiles() {
        let mut nodes = [4.0, 5.0, 6.0, 5.0, 20.0].map(sampling);
        NodeCosts::level_sampling(&mut nodes);
        assert_eq!(nodes.map(|node| node.costs.sample_image_s), [5.0, 5.0, 5.0, 5.0, 20.0]);
        NodeCosts::level_sampling(&mut []);
        let mut idle = [0.0; 2].map(sampling);
        NodeCosts::level_sampling(&mut idle);
        assert_eq!(idle[0].costs.sample_image_s, 0.0, "no node has sampled");
    }

    #[test]
    fn nodes_within_a_tenth_are_equal() {
        let node = |g: f64, c: f64| NodeCosts {
            costs: Costs { sample_image_s: g, reconstruct_view_s: c, ..Costs::default() },
            transfer_image_s: None,
        };
        assert!(NodeCosts::are_equal(&[node(1.0, 0.1), node(1.09, 0.1)]));
        assert!(!NodeCosts::are_equal(&[node(1.0, 0.1), node(1.2, 0.1)]));
        assert!(!NodeCosts::are_equal(&[node(1.0, 0.1), node(1.0, 0.12)]));
        assert!((view_s(&NodeCosts::mean(&[node(1.0, 0.1), node(2.0, 0.3)])) - 0.2).abs() < 1e-12);
    }
}
