//! The distribution of views among compositors, and the receivers of images under a relay.

use client::WorkStealing;
use cluster::Assignment;

use crate::planning::number_of;

/// Nodes that make views, in the plan's order.
pub(crate) fn compositors_of(plan: &Assignment) -> Vec<usize> {
    plan.compositors.iter().filter_map(|share| number_of(&share.node_name)).collect()
}

/// The views of all sets, shared out as clients do.
pub(crate) fn unrequested_views(plan: &Assignment, views: usize, sets: u32) -> WorkStealing {
    let weights: Vec<u32> = plan.compositors.iter().map(|share| share.view_weight).collect();
    WorkStealing::new((0..sets).map(|_| views), &weights)
}

/// The receivers of each sampler's images, by node: all compositors, from the one behind it on, so that several samplers
/// begin with different ones.
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
