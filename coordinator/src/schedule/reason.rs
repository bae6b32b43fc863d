//! The reason of a choice, in plain words.

use cluster::{Costs, Policy, PolicyChoice};

use super::{Demand, Load, NodeCosts, Predicted};

/// Every figure that the choice rests on.
pub(super) fn reason(demand: &Demand<'_>, policy: Policy, samplers: usize, predicted: &Predicted) -> String {
    let nodes = demand.nodes.len();
    let views = demand.load.views;
    let mean = NodeCosts::mean(demand.nodes);
    let unequal = if NodeCosts::are_equal(demand.nodes) { "" } else { " Nodes are unequal: costs are their mean." };
    format!(
        "{policy}, {}. {} Time-share: {} a set: each of {nodes} nodes samples and reconstructs its part. Direct: {} a \
         set: {views} views of {} + {} to encode on {nodes} nodes.{unequal}",
        origin(demand),
        pipeline(demand, &mean, samplers, predicted),
        ms(predicted.time_share_s),
        ms(predicted.direct_s),
        ms(mean.direct_view_s),
        ms(mean.encode_view_s),
    )
}

fn origin(demand: &Demand<'_>) -> &'static str {
    match (demand.policy_override.policy, demand.policy_override.forced_samplers) {
        (PolicyChoice::Auto, None) => "predicted to be faster",
        (PolicyChoice::Auto, Some(_)) => "predicted to be faster, with K as asked for",
        (_, None) => "asked for",
        (_, Some(_)) => "asked for, and K too",
    }
}

fn ms(seconds: f64) -> String {
    format!("{:.3} ms", seconds * 1e3)
}

fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// The cells that images belong to, where there are several.
fn near(load: &Load) -> String {
    match (load.cells, load.common_cells) {
        (1, 0) => String::new(),
        (cells, 0) => format!(" for {}", counted(cells, "view cell")),
        (cells, common) => {
            format!(" for {} and {}", counted(cells, "view cell"), counted(common, "common cell"))
        }
    }
}

fn pipeline(demand: &Demand<'_>, mean: &Costs, samplers: usize, predicted: &Predicted) -> String {
    let Load { images, tiles, views, images_are_sequential, is_already_sampled, .. } = demand.load;
    let in_turn = if images_are_sequential { "whole sets in turn, " } else { "" };
    let roles = match demand.nodes.len() {
        1 => "1 node in turn".to_owned(),
        nodes => format!("K = {samplers} of {nodes} nodes, {in_turn}the others reconstruct"),
    };
    let tiled = if tiles > 1 { format!(" in {tiles} tiles each") } else { String::new() };
    let near = near(&demand.load);
    let once = if is_already_sampled { ", once," } else { "" };
    format!(
        "Pipeline: {} a set: {images} images{near}{tiled} of {} sampled{once} by {roles} {views} views of {} + {} to encode, after {} to \
         load the set (K_fd = {}, {}; trying every K gives K = {}, {}).",
        ms(predicted.pipeline_s),
        ms(mean.sample_image_s),
        ms(mean.reconstruct_view_s),
        ms(mean.encode_view_s),
        ms(mean.load_set_s),
        predicted.k_fd,
        ms(predicted.k_fd_s),
        predicted.enumerated,
        ms(predicted.enumerated_s),
    )
}
