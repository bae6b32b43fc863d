//! Who gets which views, and who passes images on to whom.

use coordinator::schedule::{Worker, deal, share_views};
use wire::{Assignment, CompositorShare, Policy};

use crate::cluster::{Cluster, Dealing};
use crate::planning::number_of;

/// Nodes that make views, in the plan's order.
pub(crate) fn compositors_of(plan: &Assignment) -> Vec<usize> {
    plan.compositors.iter().filter_map(|share| number_of(&share.node_name)).collect()
}

/// Views of a set for each compositor.
pub(crate) fn shares(
    cluster: &Cluster,
    plan: &Assignment,
    compositors: &[usize],
    views: usize,
    dealing: Dealing,
) -> Vec<usize> {
    match dealing {
        Dealing::AsPlanned => return planned(plan, views),
        Dealing::Even => return share_views(views, compositors.len()).into_iter().map(|range| range.len()).collect(),
        Dealing::BySpeed => (),
    }
    let worker = |&node: &usize| {
        let costs = cluster.machines[node].costs;
        let own = plan.samplers.iter().find(|share| number_of(&share.node_name) == Some(node));
        let sample_s =
            own.map_or(0.0, |own| own.image_indices.len() as f64 * costs.sample_tile_s(plan.tile_count as usize));
        match plan.policy {
            Policy::Direct => Worker { start_s: 0.0, job_s: costs.direct_view_s + costs.encode_view_s },
            _ => Worker { start_s: sample_s + costs.load_set_s, job_s: costs.reconstruct_view_s + costs.encode_view_s },
        }
    };
    deal(views, &compositors.iter().map(worker).collect::<Vec<_>>())
}

/// As clients deal them: contiguous, in proportion to the plan's weights.
fn planned(plan: &Assignment, views: usize) -> Vec<usize> {
    let all: u64 = plan.compositors.iter().map(|share| u64::from(share.view_weight)).sum();
    let end = |before: u64| (views as u64 * before + all / 2) / all.max(1);
    let mut before = 0;
    let of = |share: &CompositorShare| {
        let first = end(before);
        before += u64::from(share.view_weight);
        (end(before) - first) as usize
    };
    plan.compositors.iter().map(of).collect()
}

/// The receivers of each of `nodes` nodes that samples: all compositors, from the one behind it on, so that several
/// samplers begin with different ones.
pub(crate) fn receivers(plan: &Assignment, compositors: &[usize], nodes: usize) -> Vec<Vec<usize>> {
    let mut receivers = vec![Vec::new(); nodes];
    for sampler in plan.samplers.iter().filter_map(|share| number_of(&share.node_name)) {
        let own = compositors.iter().position(|&node| node == sampler);
        let split = own.map_or(sampler % compositors.len().max(1), |own| own + 1);
        let (before, behind) = compositors.split_at(split);
        receivers[sampler] = behind.iter().chain(before).copied().filter(|&node| node != sampler).collect();
    }
    receivers
}
