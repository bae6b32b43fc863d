//! The nodes that clients ask for views, and the receivers of images under a relay.

use std::cmp::Reverse;

use cluster::Assignment;

use crate::planning::number_of;

/// Nodes that make views of sets of `views`, as clients choose them: no more than a set has views, by their weights.
pub(crate) fn compositors_of(plan: &Assignment, views: usize) -> Vec<(usize, u32)> {
    let weighted = plan.compositors.iter().filter_map(|share| Some((number_of(&share.node_name)?, share.view_weight)));
    let mut compositors: Vec<(usize, u32)> = weighted.collect();
    compositors.sort_by_key(|(_, weight)| Reverse(*weight));
    compositors.truncate(views);
    compositors
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
