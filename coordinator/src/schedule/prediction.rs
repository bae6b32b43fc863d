//! Predicted seconds of one sample set and its views by each policy: T(A) of a set of samplers A.
//!
//! Tiles of images, and views, are whole. A set is loaded once on each node that makes views of it.

use super::load::drawers;
use super::makespan::makespan_s;
use super::relay_tree::Links;
use super::{Load, NodeCosts};

/// T of the pipeline: max(sampling, transfer, compositing), where `samples[i]` says whether node i samples; the others
/// composite. Images take the best way. One node does all in turn.
#[must_use]
pub fn pipeline_s(load: &Load, nodes: &[NodeCosts], samples: &[bool]) -> f64 {
    pipeline_links(load, nodes, samples).best().time_s
}

/// The load of links in a pipeline, and the time of all other work.
pub(super) fn pipeline_links(load: &Load, nodes: &[NodeCosts], samples: &[bool]) -> Links {
    if nodes.len() == 1 {
        return Links { rest_s: time_share_s(load, nodes), ..Links::default() };
    }
    let [samplers, compositors] = by_role(nodes, samples);
    if samplers.is_empty() && load.images > 0 {
        return Links { rest_s: f64::INFINITY, ..Links::default() };
    }
    let part_counts = load.mean_part_counts(&samplers);
    let sample_s = samplers.iter().zip(&part_counts).map(|(node, parts)| parts * load.part_s(&node.costs));
    let rest_s = sample_s.fold(makespan_s(load.views, &load.compositors(&compositors)), f64::max);
    if load.is_already_sampled {
        return Links { rest_s, ..Links::default() };
    }
    let images = part_counts.iter().map(|parts| parts / load.tiles as f64);
    Links {
        sends_s: samplers.iter().zip(images).map(|(node, images)| images * node.transfer_s()).collect(),
        receives_s: compositors.iter().map(|node| load.images as f64 * node.transfer_s()).collect(),
        rest_s,
    }
}

/// The nodes that sample, and the others.
pub(super) fn by_role<T: Copy>(nodes: &[T], samples: &[bool]) -> [Vec<T>; 2] {
    [true, false]
        .map(|role| nodes.iter().zip(samples).filter(|(_, samples)| **samples == role).map(|(node, _)| *node).collect())
}

/// T of time-share: every node samples its share, gets the rest, and makes its share of the views.
pub(super) fn time_share_s(load: &Load, nodes: &[NodeCosts]) -> f64 {
    if nodes.is_empty() {
        return f64::INFINITY;
    }
    let part_counts = load.mean_part_counts(nodes);
    let others = nodes.len() - 1;
    // A node samples its share of every set, and sends it, though it may make no view.
    let own_s = nodes
        .iter()
        .zip(part_counts)
        .map(|(node, own_parts)| (own_parts * load.part_s(&node.costs)).max(load.exchange_s(node, own_parts, others)));
    own_s.fold(makespan_s(load.views, &load.sharers(nodes)), f64::max)
}

/// T of direct rendering: every node draws its share of the views from the scene.
pub(super) fn direct_s(load: &Load, nodes: &[NodeCosts]) -> f64 {
    makespan_s(load.views, &drawers(nodes))
}

#[cfg(test)]
mod tests {
    use cluster::{Costs, TileCosts};

    use super::*;
    use crate::schedule::test_support::{COSTS, nodes};

    const LOAD: Load = Load {
        images: 4,
        tiles: 1,
        cells: 1,
        common_cells: 0,
        sets: 1,
        views: 1000,
        images_are_sequential: false,
        is_already_sampled: false,
    };

    fn first(count: usize, of: usize) -> Vec<bool> {
        (0..of).map(|i| i < count).collect()
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9
    }

    #[test]
    fn times_of_equal_nodes_are_those_of_the_formulas() {
        assert!(close(pipeline_s(&LOAD, &nodes(5, COSTS), &first(1, 5)), 0.005 + 250.0 * 0.01));
        assert!(close(pipeline_s(&Load { views: 4, ..LOAD }, &nodes(5, COSTS), &first(3, 5)), 0.2), "whole images");
        assert!(close(direct_s(&LOAD, &nodes(5, COSTS)), 200.0 * 0.101));
        assert!(close(time_share_s(&LOAD, &nodes(4, COSTS)), 0.1 + 0.005 + 2.5));
        assert!(close(pipeline_s(&Load { views: 100, ..LOAD }, &nodes(1, COSTS), &[true]), 0.4 + 0.005 + 1.0));
        assert!(pipeline_s(&LOAD, &nodes(3, COSTS), &first(3, 3)).is_infinite());
        assert!(pipeline_s(&LOAD, &nodes(3, COSTS), &first(0, 3)).is_infinite());
    }

    #[test]
    fn a_sampler_sends_to_all_nodes_though_it_makes_no_view() {
        let slow: Vec<NodeCosts> =
            nodes(50, COSTS).into_iter().map(|node| NodeCosts { transfer_image_s: Some(0.01), ..node }).collect();
        let time_s = time_share_s(&LOAD, &slow);
        assert!(close(time_s, 49.0 * 0.01), "{time_s}: 46 nodes alone would make the views sooner");
    }

    #[test]
    fn sequential_images_are_sampled_by_sets_in_turn() {
        // 30 sets by 4 nodes: 8 rounds of 0.4 s.
        let load = Load { sets: 30, views: 2, images_are_sequential: true, ..LOAD };
        assert!(close(pipeline_s(&load, &nodes(5, COSTS), &first(4, 5)), 8.0 * 0.4 / 30.0));
        let one = Load { images_are_sequential: true, views: 20, ..LOAD };
        assert!(close(pipeline_s(&one, &nodes(5, COSTS), &first(1, 5)), 0.4));
    }

    #[test]
    fn tiles_employ_samplers_that_whole_images_leave_idle() {
        let tiles = Some(TileCosts { overhead_s: 0.02, row_shares: None });
        let node = NodeCosts { costs: Costs { tiles, ..COSTS }, transfer_image_s: None };
        let load = Load { views: 1, ..LOAD };
        let nodes = [node; 12];
        assert!(close(pipeline_s(&load, &nodes, &first(8, 12)), 0.1), "four of eight have nothing to do");
        assert!(close(pipeline_s(&load.tiled(2), &nodes, &first(8, 12)), 0.06), "0.02 + 0.08 / 2 each");
        assert!(close(pipeline_s(&load.tiled(4), &nodes, &first(8, 12)), 0.08), "two tiles of 0.02 + 0.08 / 4");
    }

    #[test]
    fn a_set_that_is_already_sampled_costs_views_only() {
        let load = Load { is_already_sampled: true, ..LOAD };
        assert!(close(pipeline_s(&load, &nodes(5, COSTS), &first(1, 5)), 2.5));
        assert!(close(time_share_s(&load, &nodes(5, COSTS)), 2.0));
        assert!(close(direct_s(&load, &nodes(5, COSTS)), direct_s(&LOAD, &nodes(5, COSTS))));
    }

    #[test]
    fn slow_links_bound_samplers_and_compositors() {
        let mut unequal = nodes(4, COSTS);
        unequal[3].transfer_image_s = Some(2.0);
        assert!(close(pipeline_s(&LOAD, &unequal, &first(1, 4)), 8.0), "4 images received by the slow one");
        let slow_sender = [false, false, false, true];
        assert!(close(pipeline_s(&LOAD, &unequal, &slow_sender), 8.0), "4 images sent to one, which relays them");
    }
}
