//! The assignment of a choice: whole images to samplers, whole views to compositors.

use cluster::{Assignment, CompositorShare, NodeStatus, Policy, SamplerShare, Workload};

use super::makespan::distribute;
use super::prediction::{by_role, pipeline_links};
use super::{Choice, Load, NodeCosts};

/// Weights are found by distributing this many views at least: of fewer, some nodes would get none.
const LEAST_VIEWS: usize = 1000;

/// A node that can be planned with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate<'a> {
    pub(super) node: &'a NodeStatus,
    pub(super) costs: NodeCosts,
}

impl Candidate<'_> {
    fn costs(candidates: &[Self]) -> Vec<NodeCosts> {
        candidates.iter().map(|candidate| candidate.costs).collect()
    }
}

/// The plan of a choice. In the direct policy all nodes make views; a single node, and in time-share every node, samples
/// too, as far as there are images.
pub(super) fn assignment(
    plan_epoch: u64,
    workload_number: u64,
    workload: Workload,
    choice: &Choice,
    nodes: &[Candidate<'_>],
) -> Assignment {
    let [sampling, compositing] = match choice.policy {
        Policy::Direct => [Vec::new(), nodes.to_vec()],
        Policy::Pipeline if nodes.len() > 1 => by_role(nodes, &choice.division.samples),
        Policy::Pipeline | Policy::TimeShare => [nodes.to_vec(), nodes.to_vec()],
    };
    let relay_fanout = match choice.policy {
        Policy::Pipeline => {
            pipeline_links(&choice.load, &Candidate::costs(nodes), &choice.division.samples).best().fanout
        }
        Policy::Direct | Policy::TimeShare => None,
    };
    Assignment {
        plan_epoch,
        workload_number,
        policy: choice.policy,
        workload,
        samplers: sampler_shares(&choice.load, &sampling),
        compositors: compositor_shares(choice, &compositing),
        tile_count: choice.load.tiles as u32,
        relay_fanout,
        method: None,
        audit: None,
    }
}

/// Views by speed; where nodes also sample, by the time that sampling leaves.
fn compositor_shares(choice: &Choice, compositing: &[Candidate<'_>]) -> Vec<CompositorShare> {
    let workers = choice.load.view_workers(choice.policy, &Candidate::costs(compositing));
    let weights = distribute(choice.load.views.max(LEAST_VIEWS), &workers);
    let shares = compositing.iter().zip(weights).map(|(candidate, weight)| CompositorShare {
        node_name: candidate.node.node_name.clone(),
        address: candidate.node.address.clone(),
        view_weight: u32::try_from(weight).unwrap_or(u32::MAX),
    });
    shares.collect()
}

/// Nodes without an image get no share: no compositor would ask them.
fn sampler_shares(load: &Load, sampling: &[Candidate<'_>]) -> Vec<SamplerShare> {
    let costs = Candidate::costs(sampling);
    let counts = load.part_counts(&costs);
    let mean = NodeCosts::mean(&costs);
    let parts_s: Vec<f64> =
        (0..load.parts()).map(|part| mean.sample_this_tile_s(part % load.tiles, load.tiles)).collect();
    let images = match load.images_are_sequential {
        // All images for each node that has any; these nodes then sample sets in turn.
        true => counts.iter().map(|&count| (0..load.images.min(count) as u32).collect()).collect(),
        false => share_images(&counts, &parts_s),
    };
    let with_images = sampling.iter().zip(images).filter(|(_, image_indices)| !image_indices.is_empty());
    let shares = with_images.map(|(candidate, image_indices)| SamplerShare {
        node_name: candidate.node.node_name.clone(),
        address: candidate.node.address.clone(),
        image_indices,
    });
    shares.collect()
}

/// `counts[i]` images, or tiles, for node i: the most expensive first, each to the node with the least work for its count.
fn share_images(counts: &[usize], images_s: &[f64]) -> Vec<Vec<u32>> {
    let mut shares = vec![(0.0, Vec::new()); counts.len()];
    let mut most_expensive_first: Vec<usize> = (0..counts.iter().sum()).collect();
    most_expensive_first.sort_by(|&a, &b| images_s[b].total_cmp(&images_s[a]));
    for image in most_expensive_first {
        let with_room = shares.iter_mut().zip(counts).filter(|((_, share), count)| share.len() < **count);
        let least = with_room.min_by(|((a, _), m), ((b, _), n)| (a / **m as f64).total_cmp(&(b / **n as f64)));
        let Some(((share_s, share), _)) = least else { break };
        *share_s += images_s[image];
        share.push(image as u32);
    }
    shares.iter_mut().for_each(|(_, share)| share.sort_unstable());
    shares.into_iter().map(|(_, share)| share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_image_has_one_sampler_and_shares_are_even() {
        for nodes in 1..12 {
            for count in 0..40 {
                let counts: Vec<usize> = (0..nodes).map(|i| (count + i) / nodes).collect();
                let shares = share_images(&counts, &vec![1.0; count]);
                let mut images: Vec<u32> = shares.concat();
                images.sort_unstable();
                assert_eq!(images, (0..count as u32).collect::<Vec<_>>());
                assert!(shares.iter().zip(&counts).all(|(share, &count)| share.len() == count));
            }
        }
        assert_eq!(share_images(&[2, 1, 1], &[1.0; 4]), [vec![0, 3], vec![1], vec![2]], "in turn, where all are equal");
    }

    #[test]
    fn expensive_tiles_are_spread_over_samplers() {
        // Four images in four tiles, the upper half of which shows the sky.
        let tiles_s: Vec<f64> = [0.1, 0.3, 1.0, 1.2].repeat(4);
        let shares = share_images(&[4; 4], &tiles_s);
        let seconds = shares.iter().map(|share| share.iter().map(|&tile| tiles_s[tile as usize]).sum::<f64>());
        assert!(seconds.clone().all(|seconds| (seconds - 2.6).abs() < 0.2), "{:?}", seconds.collect::<Vec<_>>());
        let uneven = share_images(&[6, 6, 2, 2], &tiles_s);
        assert!(uneven.iter().map(Vec::len).eq([6, 6, 2, 2]));
    }
}
