//! Pipeline or direct, and K: with the figures, in plain words.

use wire::{Costs, Policy, PolicyChoice};

use super::k_fd;

/// What a session asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Demand {
    /// S: images of a sample set. They are whole: no more nodes can sample.
    pub images: usize,
    /// Sample sets that differ, of the whole session.
    pub sets: usize,
    /// V: views of a sample set.
    pub views: usize,
    /// P.
    pub nodes: usize,
    /// Who decides.
    pub policy: PolicyChoice,
    /// K, instead of the formula's.
    pub forced_samplers: Option<usize>,
}

/// What was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// How views come about.
    pub policy: Policy,
    /// K; 0 in the direct policy.
    pub samplers: usize,
    /// In plain words, with the figures.
    pub reason: String,
    /// With samplers and compositors, seconds a set.
    pub predicted_pipeline_s: f64,
    /// From the scene, seconds a set.
    pub predicted_direct_s: f64,
}

/// Why nothing could be chosen.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ChoiceError {
    /// Nobody is there.
    #[error("no node has joined the cluster")]
    NoNodes,
    /// More samplers than images (or sets, where images are sampled in order), or none left for views.
    #[error("forced_sampler_count is {forced}, at most {most} of {nodes} nodes can sample {images} whole images a set")]
    ForcedSamplers {
        /// Asked for.
        forced: usize,
        /// Possible.
        most: usize,
        /// P.
        nodes: usize,
        /// S.
        images: usize,
    },
}

/// Chooses by predicted time, unless the session decides.
///
/// # Errors
/// Without nodes, or with a K that cannot be.
pub fn choose(costs: &Costs, demand: &Demand) -> Result<Choice, ChoiceError> {
    if demand.nodes == 0 {
        return Err(ChoiceError::NoNodes);
    }
    let samplers = sampler_count(costs, demand)?;
    let predicted_pipeline_s = predicted_pipeline_s(costs, demand, samplers);
    let predicted_direct_s = predicted_direct_s(costs, demand);
    let policy = match demand.policy {
        PolicyChoice::Auto if predicted_direct_s < predicted_pipeline_s => Policy::Direct,
        PolicyChoice::Direct => Policy::Direct,
        PolicyChoice::Auto | PolicyChoice::Pipeline => Policy::Pipeline,
    };
    let reason = reason(costs, demand, policy, samplers);
    let samplers = if policy == Policy::Direct { 0 } else { samplers };
    Ok(Choice { policy, samplers, reason, predicted_pipeline_s, predicted_direct_s })
}

/// Samplers that still leave a node for views; one node does both. Images that are sampled in order keep a set on
/// one node, so that no more nodes can sample than there are sets.
fn most_samplers(costs: &Costs, demand: &Demand) -> usize {
    let parts = if costs.in_order { demand.sets } else { demand.images };
    parts.min(demand.nodes.saturating_sub(1).max(1)).max(1)
}

fn sampler_count(costs: &Costs, demand: &Demand) -> Result<usize, ChoiceError> {
    let most = most_samplers(costs, demand);
    match demand.forced_samplers {
        Some(forced) if !(1..=most).contains(&forced) => {
            Err(ChoiceError::ForcedSamplers { forced, most, nodes: demand.nodes, images: demand.images })
        }
        Some(forced) => Ok(forced),
        None => Ok(k_fd(demand.images, costs.sample_image_s, demand.views, view_s(costs), demand.nodes).clamp(1, most)),
    }
}

/// c + e.
fn view_s(costs: &Costs) -> f64 {
    costs.reconstruct_view_s + costs.encode_view_s
}

/// Seconds a set with K samplers: whole images, whole views, and the set's decode and upload on every
/// compositor. One node does all in turn.
#[must_use]
pub fn predicted_pipeline_s(costs: &Costs, demand: &Demand, samplers: usize) -> f64 {
    let compositors = demand.nodes.saturating_sub(samplers).max(1);
    let sample_s = images_in_turn(costs, demand, samplers.max(1)) * costs.sample_image_s;
    let view_s = costs.load_set_s + demand.views.div_ceil(compositors) as f64 * view_s(costs);
    if demand.nodes == 1 { sample_s + view_s } else { sample_s.max(view_s) }
}

/// Images that one sampler makes one after the other, a set: of each set its share, or whole sets in turn.
fn images_in_turn(costs: &Costs, demand: &Demand, samplers: usize) -> f64 {
    match costs.in_order {
        true => demand.images as f64 * demand.sets.max(1).div_ceil(samplers) as f64 / demand.sets.max(1) as f64,
        false => demand.images.div_ceil(samplers) as f64,
    }
}

/// Seconds a set's views when every node draws its share from the scene.
#[must_use]
pub fn predicted_direct_s(costs: &Costs, demand: &Demand) -> f64 {
    demand.views.div_ceil(demand.nodes.max(1)) as f64 * (costs.direct_view_s + costs.encode_view_s)
}

/// The K with the least predicted time when images and views are whole.
fn enumerated_samplers(costs: &Costs, demand: &Demand) -> usize {
    let time = |k: &usize| predicted_pipeline_s(costs, demand, *k);
    (1..=most_samplers(costs, demand)).min_by(|a, b| time(a).total_cmp(&time(b))).unwrap_or(1)
}

fn reason(costs: &Costs, demand: &Demand, policy: Policy, samplers: usize) -> String {
    let ms = |seconds: f64| format!("{:.3} ms", seconds * 1e3);
    let Demand { images, views, nodes, .. } = *demand;
    let who = match (demand.policy, demand.forced_samplers) {
        (PolicyChoice::Auto, None) => "predicted to be faster",
        (PolicyChoice::Auto, Some(_)) => "predicted to be faster, with K as asked for",
        (_, None) => "asked for",
        (_, Some(_)) => "asked for, and K too",
    };
    let best = enumerated_samplers(costs, demand);
    let roles = if nodes == 1 {
        "1 node in turn".to_owned()
    } else {
        let how = if costs.in_order { "whole sets in turn, " } else { "" };
        format!("K = {samplers} of {nodes} nodes, {how}the others reconstruct")
    };
    format!(
        "{policy}, {who}. Pipeline: {} a set: {images} images of {} sampled by {roles} {views} views of {} + {} to encode, after {} to load the set (trying every K gives K = {best}, {}). \
         Direct: {} a set: {views} views of {} + {} to encode on {nodes} nodes.",
        ms(predicted_pipeline_s(costs, demand, samplers)),
        ms(costs.sample_image_s),
        ms(costs.reconstruct_view_s),
        ms(costs.encode_view_s),
        ms(costs.load_set_s),
        ms(predicted_pipeline_s(costs, demand, best)),
        ms(predicted_direct_s(costs, demand)),
        ms(costs.direct_view_s),
        ms(costs.encode_view_s),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const COSTS: Costs = Costs {
        sample_image_s: 0.1,
        direct_view_s: 0.1,
        reconstruct_view_s: 0.009,
        load_set_s: 0.005,
        encode_view_s: 0.001,
        in_order: false,
    };

    fn demand(views: usize, nodes: usize) -> Demand {
        Demand { images: 4, sets: 1, views, nodes, policy: PolicyChoice::Auto, forced_samplers: None }
    }

    #[test]
    fn many_views_are_reconstructed_and_few_are_drawn() {
        let many = choose(&COSTS, &demand(1000, 5)).unwrap();
        assert_eq!((many.policy, many.samplers), (Policy::Pipeline, 1));
        assert!((many.predicted_pipeline_s - 2.505).abs() < 1e-9);
        assert!((many.predicted_direct_s - 20.2).abs() < 1e-9);
        let few = choose(&COSTS, &demand(3, 3)).unwrap();
        assert_eq!((few.policy, few.samplers), (Policy::Direct, 0));
        assert!(few.reason.starts_with("direct, predicted to be faster"), "{}", few.reason);
        assert!(few.reason.contains("100.000 ms"), "{}", few.reason);
    }

    #[test]
    fn the_session_may_decide() {
        let asked = |policy, forced_samplers| choose(&COSTS, &Demand { policy, forced_samplers, ..demand(5, 5) });
        assert_eq!(asked(PolicyChoice::Pipeline, None).unwrap().policy, Policy::Pipeline);
        assert_eq!(asked(PolicyChoice::Direct, None).unwrap().policy, Policy::Direct);
        assert_eq!(asked(PolicyChoice::Pipeline, Some(3)).unwrap().samplers, 3);
        for forced in [0, 5, 9] {
            assert!(matches!(
                asked(PolicyChoice::Pipeline, Some(forced)),
                Err(ChoiceError::ForcedSamplers { most: 4, .. })
            ));
        }
    }

    #[test]
    fn whole_images_bound_the_samplers_and_views_keep_a_node() {
        for nodes in 1..30 {
            for views in [1, 10, 1000] {
                let choice =
                    choose(&COSTS, &Demand { policy: PolicyChoice::Pipeline, ..demand(views, nodes) }).unwrap();
                assert!(choice.samplers >= 1 && choice.samplers <= 4);
                assert!(nodes == 1 || choice.samplers < nodes);
            }
        }
        assert_eq!(choose(&COSTS, &demand(1, 0)), Err(ChoiceError::NoNodes));
    }

    #[test]
    fn sets_whose_images_are_sampled_in_order_stay_whole() {
        let costs = Costs { in_order: true, ..COSTS };
        let still = Demand { policy: PolicyChoice::Pipeline, ..demand(20, 5) };
        assert_eq!(choose(&costs, &still).unwrap().samplers, 1, "one set, one node");
        assert!((predicted_pipeline_s(&costs, &still, 1) - 0.4).abs() < 1e-9);
        let moving = Demand { sets: 30, ..still };
        let choice = choose(&costs, &moving).unwrap();
        assert!(choice.samplers > 1 && choice.reason.contains("whole sets in turn"), "{choice:?}");
        // 30 sets by 4 nodes: 8 rounds of 0.4 s.
        let few_views = Demand { views: 2, ..moving };
        assert!((predicted_pipeline_s(&costs, &few_views, 4) - 8.0 * 0.4 / 30.0).abs() < 1e-9);
    }

    #[test]
    fn one_node_does_all_in_turn() {
        let choice = choose(&COSTS, &demand(100, 1)).unwrap();
        assert!((choice.predicted_pipeline_s - (0.4 + 0.005 + 1.0)).abs() < 1e-9);
        assert_eq!(choice.samplers, 1);
    }
}
