//! Whole images to samplers, whole views to compositors.

use cluster::{Assignment, CompositorShare, NodeStatus, Policy, SamplerShare, Workload};

use super::deal::deal;
use super::{Choice, Load, NodeCosts, relay_fanout};

/// So many views at least are dealt to see who should make how many: of few, some nodes would get none.
const LEAST_VIEWS: usize = 1000;

/// A node and what it costs.
pub(super) type Candidate<'a> = (&'a NodeStatus, NodeCosts);

/// The plan of a choice. In the direct policy all make views; a single node, and in time-share every node, samples too,
/// as far as there are images.
pub(super) fn assignment(plan_epoch: u64, workload: Workload, choice: &Choice, nodes: &[Candidate<'_>]) -> Assignment {
    let samples = |i: usize| nodes.len() == 1 || choice.division.samples[i];
    let who = |role: &dyn Fn(usize) -> bool| -> Vec<Candidate<'_>> {
        (0..nodes.len()).filter(|&i| role(i)).map(|i| nodes[i]).collect()
    };
    let (sampling, making) = match choice.policy {
        Policy::Direct => (Vec::new(), nodes.to_vec()),
        Policy::TimeShare => (nodes.to_vec(), nodes.to_vec()),
        Policy::Pipeline if nodes.len() == 1 => (nodes.to_vec(), nodes.to_vec()),
        Policy::Pipeline => (who(&samples), who(&|i| !samples(i))),
    };
    let costs: Vec<NodeCosts> = nodes.iter().map(|(_, costs)| *costs).collect();
    let relays = choice.policy == Policy::Pipeline && nodes.len() > 1;
    Assignment {
        plan_epoch,
        policy: choice.policy,
        workload,
        samplers: sampler_shares(&choice.load, &sampling),
        compositors: compositor_shares(choice, &making),
        tile_count: choice.load.tiles as u32,
        relay_fanout: if relays { relay_fanout(&choice.load, &costs, &choice.division.samples) } else { None },
    }
}

/// Views by speed; where nodes also sample, by what time that leaves.
fn compositor_shares(choice: &Choice, making: &[Candidate<'_>]) -> Vec<CompositorShare> {
    let costs: Vec<NodeCosts> = making.iter().map(|(_, costs)| *costs).collect();
    let workers = choice.load.view_workers(choice.policy, &costs);
    let weights = deal(choice.load.views.max(LEAST_VIEWS), &workers);
    let share = |((node, _), weight): (&Candidate<'_>, usize)| CompositorShare {
        node_name: node.node_name.clone(),
        address: node.address.clone(),
        view_weight: u32::try_from(weight).unwrap_or(u32::MAX),
    };
    making.iter().zip(weights).map(share).collect()
}

/// Nodes without an image are left out: nobody would ask them.
fn sampler_shares(load: &Load, sampling: &[Candidate<'_>]) -> Vec<SamplerShare> {
    let costs: Vec<NodeCosts> = sampling.iter().map(|(_, costs)| *costs).collect();
    let counts = load.image_counts(&costs);
    let mean = NodeCosts::mean(&costs).costs;
    let part_s = |part: usize| mean.sample_this_tile_s(part % load.tiles, load.tiles);
    let parts_s: Vec<f64> = (0..load.parts()).map(part_s).collect();
    let images = if load.in_order { share_sets(load.images, &counts) } else { share_images(&counts, &parts_s) };
    let share = |((node, _), image_indices): (&Candidate<'_>, Vec<u32>)| SamplerShare {
        node_name: node.node_name.clone(),
        address: node.address.clone(),
        image_indices,
    };
    sampling.iter().zip(images).map(share).filter(|share| !share.image_indices.is_empty()).collect()
}

/// So many images, or tiles, to each node, the dearest first to whom has least for its number.
#[must_use]
pub fn share_images(counts: &[usize], images_s: &[f64]) -> Vec<Vec<u32>> {
    let mut shares = vec![(0.0, Vec::new()); counts.len()];
    let mut dearest_first: Vec<usize> = (0..counts.iter().sum()).collect();
    dearest_first.sort_by(|&a, &b| images_s[b].total_cmp(&images_s[a]));
    for image in dearest_first {
        let with_room = shares.iter_mut().zip(counts).filter(|((_, share), count)| share.len() < **count);
        let least = with_room.min_by(|((a, _), m), ((b, _), n)| (a / **m as f64).total_cmp(&(b / **n as f64)));
        let Some(((share_s, share), _)) = least else { break };
        *share_s += images_s[image];
        share.push(image as u32);
    }
    shares.iter_mut().for_each(|(_, share)| share.sort_unstable());
    shares.into_iter().map(|(_, share)| share).collect()
}

/// All images to each node that has any; they then sample sets in turn.
fn share_sets(images: usize, counts: &[usize]) -> Vec<Vec<u32>> {
    counts.iter().map(|&count| (0..images.min(count) as u32).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_image_is_dealt_once_and_evenly() {
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
    fn dear_tiles_are_spread() {
        // Four images in four tiles, the upper half of which shows the sky.
        let tiles_s: Vec<f64> = [0.1, 0.3, 1.0, 1.2].repeat(4);
        let shares = share_images(&[4; 4], &tiles_s);
        let seconds = shares.iter().map(|share| share.iter().map(|&tile| tiles_s[tile as usize]).sum::<f64>());
        assert!(seconds.clone().all(|seconds| (seconds - 2.6).abs() < 0.2), "{:?}", seconds.collect::<Vec<_>>());
        let uneven = share_images(&[6, 6, 2, 2], &tiles_s);
        assert!(uneven.iter().map(Vec::len).eq([6, 6, 2, 2]));
    }
}
