//! A policy and a division of the nodes, by predicted time, unless the session overrides them.

use cluster::{Policy, PolicyChoice};

use super::node_costs::view_s;
use super::prediction::{direct_s, time_share_s};
use super::reason::reason;
use super::search::{enumerate, first, improve, order, towards};
use super::{Choice, ChoiceError, Demand, Division, Load, NodeCosts, Predicted, k_fd};

/// Numbers of tiles that an image may have.
const TILES: [usize; 5] = [1, 2, 4, 8, 16];

/// A choice is better only where the other takes more than this many times as long.
pub(super) const WORTH: f64 = 1.1;

/// The choice of the least predicted time, unless the session overrides it.
///
/// # Errors
/// Without nodes, or for an override that is impossible.
pub fn choose(demand: &Demand<'_>) -> Result<Choice, ChoiceError> {
    check(demand)?;
    let counts = tile_counts(demand);
    let tiles = match counts[..] {
        [only] => only,
        // Moves of single nodes decide nothing here, and cost most.
        _ => best_tiles(demand, counts.into_iter().map(|tiles| choose_tiled(demand, tiles, false)).collect()),
    };
    Ok(choose_tiled(demand, tiles, true))
}

/// The present number of tiles, or else the least, where that is not clearly slower than the best.
fn best_tiles(demand: &Demand<'_>, choices: Vec<Choice>) -> usize {
    let best_s = choices.iter().map(Choice::time_s).fold(f64::INFINITY, f64::min);
    let good = choices.iter().filter(|choice| choice.time_s() <= best_s * WORTH).map(|choice| choice.load.tiles);
    let now = demand.current.map(|current| current.tiles);
    good.clone().find(|&tiles| Some(tiles) == now).or_else(|| good.min()).unwrap_or(1)
}

fn tile_counts(demand: &Demand<'_>) -> Vec<usize> {
    match demand.policy_override.forced_tiles {
        Some(forced) => vec![forced],
        None if demand.load.is_already_sampled || !is_tileable(demand) => vec![1],
        // More than two tiles for every node would only add overhead.
        None => {
            let most = 4 * demand.nodes.len();
            TILES.into_iter().filter(|tiles| *tiles == 1 || demand.load.images * tiles < most).collect()
        }
    }
}

fn is_tileable(demand: &Demand<'_>) -> bool {
    !demand.load.images_are_sequential && NodeCosts::mean(demand.nodes).tiles.is_some()
}

/// The choice for a number of tiles of each image.
fn choose_tiled(demand: &Demand<'_>, tiles: usize, moves: bool) -> Choice {
    let demand = &Demand { load: demand.load.tiled(tiles), ..*demand };
    let Demand { load, nodes, .. } = demand;
    let sampled = demand.current.map_or(&[][..], |current| &current.samples);
    let order = order(nodes, sampled);
    let k_fd = first(load, nodes, &order, k_fd_of(load, nodes));
    let enumerated = enumerate(load, nodes, &order, moves);
    let division = divide(demand, &order, &k_fd, &enumerated);
    conclude(demand, division, &k_fd, &enumerated)
}

/// Whether a demand can be met at all.
pub(super) fn check(demand: &Demand<'_>) -> Result<(), ChoiceError> {
    let nodes = demand.nodes.len();
    if nodes == 0 {
        return Err(ChoiceError::NoNodes);
    }
    if let Some(forced) = demand.policy_override.forced_tiles.filter(|&forced| forced > 1 && !is_tileable(demand)) {
        return Err(ChoiceError::ForcedTiles { forced });
    }
    let most = demand.load.tiled(tile_counts(demand).into_iter().max().unwrap_or(1)).most_samplers(nodes);
    match demand.policy_override.forced_samplers {
        Some(forced) if !(1..=most).contains(&forced) => {
            Err(ChoiceError::ForcedSamplers { forced, most, nodes, images: demand.load.images })
        }
        _ => Ok(()),
    }
}

fn conclude(demand: &Demand<'_>, division: Division, k_fd: &Division, enumerated: &Division) -> Choice {
    let predicted = Predicted {
        pipeline_s: division.time_s,
        direct_s: direct_s(&demand.load, demand.nodes),
        time_share_s: time_share_s(&demand.load, demand.nodes),
        k_fd: k_fd.sampler_count(),
        k_fd_s: k_fd.time_s,
        enumerated: enumerated.sampler_count(),
        enumerated_s: enumerated.time_s,
    };
    let policy = policy(demand, &predicted);
    let reason = reason(demand, policy, division.sampler_count(), &predicted);
    Choice { policy, load: demand.load, division, reason, predicted }
}

/// The part of a choice that `changes` changes of role allow; from policy to policy all nodes change.
pub(super) fn step_from(demand: &Demand<'_>, mut choice: Choice, has_role: &[bool], changes: usize) -> Choice {
    let Some(current) = demand.current.filter(|current| current.policy == Policy::Pipeline) else { return choice };
    if choice.policy == Policy::Pipeline {
        let demand = &Demand { load: choice.load, ..*demand };
        let Demand { load, nodes, .. } = demand;
        choice.division = towards(load, nodes, &current.samples, &choice.division, has_role, changes);
        choice.predicted.pipeline_s = choice.division.time_s;
        choice.reason = reason(demand, choice.policy, choice.division.sampler_count(), &choice.predicted);
    }
    choice
}

/// The formula's K, as far as whole images allow.
fn k_fd_of(load: &Load, nodes: &[NodeCosts]) -> usize {
    let mean = NodeCosts::mean(nodes);
    let k = k_fd(load.parts(), load.part_s(&mean), load.views, view_s(&mean), nodes.len());
    k.clamp(1, load.most_samplers(nodes.len()))
}

/// The formula's K for equal nodes, unless whole images make it clearly worse; else the division that the search finds.
/// The present division stays where neither is clearly better.
fn divide(demand: &Demand<'_>, order: &[usize], k_fd: &Division, enumerated: &Division) -> Division {
    let Demand { load, nodes, policy_override, current } = demand;
    let best = match policy_override.forced_samplers {
        Some(forced) if NodeCosts::are_equal(nodes) => first(load, nodes, order, forced),
        Some(forced) => improve(load, nodes, first(load, nodes, order, forced), false),
        None if NodeCosts::are_equal(nodes) && k_fd.time_s <= enumerated.time_s * WORTH => k_fd.clone(),
        None => enumerated.clone(),
    };
    let pipeline = current.filter(|current| current.policy == Policy::Pipeline);
    let now = pipeline.map(|current| Division::new(load, nodes, current.samples.clone()));
    let possible = now.filter(|now| match policy_override.forced_samplers {
        Some(forced) => now.sampler_count() == forced,
        None => (1..=load.most_samplers(nodes.len())).contains(&now.sampler_count()),
    });
    possible.filter(|now| now.time_s <= best.time_s * WORTH).unwrap_or(best)
}

fn policy(demand: &Demand<'_>, predicted: &Predicted) -> Policy {
    let shared = demand.policy_override.forced_samplers.is_none().then_some(Policy::TimeShare);
    let all = [Policy::Pipeline, Policy::Direct].into_iter().chain(shared);
    match demand.policy_override.policy {
        PolicyChoice::Pipeline => Policy::Pipeline,
        PolicyChoice::Direct => Policy::Direct,
        PolicyChoice::TimeShare => Policy::TimeShare,
        PolicyChoice::Auto => {
            let best = all.min_by(|a, b| predicted.of(*a).total_cmp(&predicted.of(*b))).unwrap_or(Policy::Direct);
            // Pictures that are drawn directly are exact: to begin with, samples must be clearly faster.
            let now = demand.current.map_or(Policy::Direct, |current| current.policy);
            if predicted.of(now) <= predicted.of(best) * WORTH { now } else { best }
        }
    }
}

#[cfg(test)]
#[path = "choose_tests.rs"]
mod tests;
