//! Costs of one node, and their comparison between nodes.

use cluster::{Costs, TileCosts};

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
        let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s, .. } = self.costs;
        let tiles = |tiles: TileCosts| TileCosts { overhead_s: tiles.overhead_s * times, ..tiles };
        Self {
            costs: Costs {
                sample_image_s: sample_image_s * times,
                direct_view_s: direct_view_s * times,
                reconstruct_view_s: reconstruct_view_s * times,
                load_set_s: load_set_s * times,
                encode_view_s: encode_view_s * times,
                in_order: self.costs.in_order,
                tiles: self.costs.tiles.map(tiles),
            },
            transfer_image_s: self.transfer_image_s.map(|transfer_s| transfer_s * times),
        }
    }

    /// A link that is not measured counts as free.
    pub(super) fn transfer_s(&self) -> f64 {
        self.transfer_image_s.unwrap_or(0.0)
    }

    /// The mean of each cost. Shares of rows are the scene's: the first node's.
    pub(super) fn mean(nodes: &[Self]) -> Costs {
        let mean =
            |of: fn(&Costs) -> f64| nodes.iter().map(|node| of(&node.costs)).sum::<f64>() / nodes.len().max(1) as f64;
        let sample_image_s = mean(|costs| costs.sample_image_s);
        let row_shares = nodes.first().and_then(|node| node.costs.tiles?.row_shares);
        Costs {
            sample_image_s,
            direct_view_s: mean(|costs| costs.direct_view_s),
            reconstruct_view_s: mean(|costs| costs.reconstruct_view_s),
            load_set_s: mean(|costs| costs.load_set_s),
            encode_view_s: mean(|costs| costs.encode_view_s),
            in_order: nodes.iter().any(|node| node.costs.in_order),
            tiles: TileCosts::of_image(sample_image_s, mean(Costs::tile_overhead_s), row_shares),
        }
    }

    /// Levels the cost of sampling where nodes sample tiles: a node about as slow as most had more expensive tiles.
    pub(super) fn level_sampling(nodes: &mut [Self]) {
        let Some(middle_s) = median(nodes.iter().map(|node| node.costs.sample_image_s)) else { return };
        let is_like_most = |node: &Self| is_within_tiles_error(node.costs.sample_image_s / middle_s);
        let mean = Self::mean(&nodes.iter().copied().filter(is_like_most).collect::<Vec<_>>());
        for node in nodes.iter_mut().filter(|node| is_like_most(node)) {
            node.costs.sample_image_s = mean.sample_image_s;
            let tiles = node.costs.tiles.zip(mean.tiles);
            node.costs.tiles = tiles.map(|(tiles, mean)| TileCosts { overhead_s: mean.overhead_s, ..tiles });
        }
    }

    /// Whether all nodes are about as fast, so that any may have any role.
    #[must_use]
    pub fn are_equal(nodes: &[Self]) -> bool {
        let equal = |of: fn(&Self) -> f64| {
            let least = nodes.iter().map(of).fold(f64::INFINITY, f64::min);
            nodes.iter().all(|node| of(node) <= least * EQUAL_WITHIN)
        };
        equal(|node| node.costs.sample_image_s) && equal(Self::view_s)
    }
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
