//! Which of the policies, and who samples: by predicted time, unless the session decides.

use std::num::NonZeroU32;

use cluster::{Policy, PolicyChoice};

use super::reason::reason;
use super::search::{Division, enumerate, first, improve, order, towards};
use super::{Load, NodeCosts, direct_s, k_fd, time_share_s};

/// Into so many tiles images may be cut.
const TILES: [usize; 5] = [1, 2, 4, 8, 16];

/// What predicts less than so many times another's time is no reason to change anything.
pub(super) const WORTH: f64 = 1.1;

/// Who decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wish {
    /// How views come about.
    pub policy: PolicyChoice,
    /// K, instead of the formula's.
    pub forced_samplers: Option<usize>,
    /// Tiles of an image, instead of as many as are predicted to be fastest.
    pub forced_tiles: Option<usize>,
}

/// What nodes do now; those without a role count as compositors.
#[derive(Debug, Clone, PartialEq)]
pub struct Present {
    /// How views come about.
    pub policy: Policy,
    /// Whether each node samples.
    pub samples: Vec<bool>,
    /// Tiles of an image.
    pub tiles: usize,
    /// How images reach compositors.
    pub relay_fanout: Option<NonZeroU32>,
}

/// What is asked, and of whom.
#[derive(Debug, Clone, Copy)]
pub struct Demand<'a> {
    /// The work.
    pub load: Load,
    /// The nodes, by name.
    pub nodes: &'a [NodeCosts],
    /// Who decides.
    pub wish: Wish,
    /// What is kept where nothing else is clearly better.
    pub present: Option<&'a Present>,
}

/// Predicted seconds of a sample set.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Predicted {
    /// With samplers and compositors, as divided.
    pub pipeline_s: f64,
    /// From the scene.
    pub direct_s: f64,
    /// With every node doing both.
    pub time_share_s: f64,
    /// K by the balance formula, on the mean of the nodes' costs.
    pub k_fd: usize,
    /// With that K.
    pub k_fd_s: f64,
    /// K of the best division that trying finds.
    pub enumerated: usize,
    /// With that division.
    pub enumerated_s: f64,
}

impl Predicted {
    /// By one of them.
    #[must_use]
    pub fn of(&self, policy: Policy) -> f64 {
        match policy {
            Policy::Pipeline => self.pipeline_s,
            Policy::Direct => self.direct_s,
            Policy::TimeShare => self.time_share_s,
        }
    }
}

/// What was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// How views come about.
    pub policy: Policy,
    /// The work, with images cut as it is best.
    pub load: Load,
    /// Who samples in the pipeline, whether or not it was chosen.
    pub division: Division,
    /// In plain words, with the figures.
    pub reason: String,
    /// Of every policy.
    pub predicted: Predicted,
}

impl Choice {
    /// Seconds a sample set.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.predicted.of(self.policy)
    }
}

/// Why nothing could be chosen.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChoiceError {
    /// Nobody is there.
    #[error("no node has joined the cluster")]
    NoNodes,
    /// Images that are sampled one after the other, or by what others hold, are whole.
    #[error("forced_tile_count is {forced}, but images of this sampling method are not cut")]
    ForcedTiles {
        /// Asked for.
        forced: usize,
    },
    /// Sessions that state a rate ask for more than all nodes can do.
    #[error("frames_per_s: all sessions together would take {needed:.2} times what the nodes can do")]
    Overload {
        /// Of the nodes' time.
        needed: f64,
    },
    /// More cells than a plan may have.
    #[error("viewpoints: they are spread over {cells} view cells, at most 64")]
    Cells {
        /// How many.
        cells: usize,
    },
    /// Where sample cameras stand is not for the schedule to say.
    #[error("viewpoints: session {session} was opened with sample cameras")]
    NoCells {
        /// Which.
        session: u64,
    },
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
pub fn choose(demand: &Demand<'_>) -> Result<Choice, ChoiceError> {
    check(demand)?;
    let cut = |tiles: usize| Demand { load: demand.load.cut(tiles), ..*demand };
    let counts = tile_counts(demand);
    let tiles = match counts[..] {
        [only] => only,
        // Moves of single nodes decide nothing here, and cost most.
        _ => best_tiles(demand, counts.into_iter().map(|tiles| choose_cut(&cut(tiles), false)).collect()),
    };
    Ok(choose_cut(&cut(tiles), true))
}

/// As many as now, or else as few as can be, where that is not clearly slower than the best.
fn best_tiles(demand: &Demand<'_>, choices: Vec<Choice>) -> usize {
    let best_s = choices.iter().map(Choice::time_s).fold(f64::INFINITY, f64::min);
    let good = choices.iter().filter(|choice| choice.time_s() <= best_s * WORTH).map(|choice| choice.load.tiles);
    let now = demand.present.map(|present| present.tiles);
    good.clone().find(|&tiles| Some(tiles) == now).or_else(|| good.min()).unwrap_or(1)
}

/// None are cut where a tile takes as long as the image.
fn tile_counts(demand: &Demand<'_>) -> Vec<usize> {
    match demand.wish.forced_tiles {
        Some(forced) => vec![forced],
        None if demand.load.still || !is_cut(demand) => vec![1],
        // More than two for every node would only cost more.
        None => {
            let useful = |tiles: &usize| *tiles == 1 || demand.load.images * tiles < 4 * demand.nodes.len();
            TILES.into_iter().filter(useful).collect()
        }
    }
}

fn is_cut(demand: &Demand<'_>) -> bool {
    let mean = NodeCosts::mean(demand.nodes).costs;
    !demand.load.in_order && mean.tiles.is_some()
}

/// With images cut as the load says.
fn choose_cut(demand: &Demand<'_>, moves: bool) -> Choice {
    let Demand { load, nodes, .. } = demand;
    let sampled = demand.present.map_or(&[][..], |present| &present.samples);
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
    if let Some(forced) = demand.wish.forced_tiles.filter(|&forced| forced > 1 && !is_cut(demand)) {
        return Err(ChoiceError::ForcedTiles { forced });
    }
    let most = demand.load.cut(tile_counts(demand).into_iter().max().unwrap_or(1)).most_samplers(nodes);
    match demand.wish.forced_samplers {
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

/// As much of a choice as `changes` changes of role allow; from policy to policy all nodes change.
pub(super) fn step_from(demand: &Demand<'_>, mut choice: Choice, has_role: &[bool], changes: usize) -> Choice {
    let Some(present) = demand.present.filter(|present| present.policy == Policy::Pipeline) else { return choice };
    if choice.policy == Policy::Pipeline {
        let demand = &Demand { load: choice.load, ..*demand };
        let Demand { load, nodes, .. } = demand;
        choice.division = towards(load, nodes, &present.samples, &choice.division, has_role, changes);
        choice.predicted.pipeline_s = choice.division.time_s;
        choice.reason = reason(demand, choice.policy, choice.division.sampler_count(), &choice.predicted);
    }
    choice
}

/// The formula's K, as far as whole images allow.
fn k_fd_of(load: &Load, nodes: &[NodeCosts]) -> usize {
    let mean = NodeCosts::mean(nodes);
    let k = k_fd(load.parts(), load.part_s(&mean), load.views, mean.view_s(), nodes.len());
    k.clamp(1, load.most_samplers(nodes.len()))
}

/// The formula's K for equal nodes, unless whole images make it clearly the worse; else what trying finds. What is now
/// stays where neither is clearly better.
fn divide(demand: &Demand<'_>, order: &[usize], k_fd: &Division, enumerated: &Division) -> Division {
    let Demand { load, nodes, wish, present } = demand;
    let best = match wish.forced_samplers {
        Some(forced) if NodeCosts::are_equal(nodes) => first(load, nodes, order, forced),
        Some(forced) => improve(load, nodes, first(load, nodes, order, forced), false),
        None if NodeCosts::are_equal(nodes) && k_fd.time_s <= enumerated.time_s * WORTH => k_fd.clone(),
        None => enumerated.clone(),
    };
    let pipeline = present.filter(|present| present.policy == Policy::Pipeline);
    let now = pipeline.map(|present| Division::new(load, nodes, present.samples.clone()));
    let possible = |now: &Division| match wish.forced_samplers {
        Some(forced) => now.sampler_count() == forced,
        None => (1..=load.most_samplers(nodes.len())).contains(&now.sampler_count()),
    };
    now.filter(|now| possible(now) && now.time_s <= best.time_s * WORTH).unwrap_or(best)
}

fn policy(demand: &Demand<'_>, predicted: &Predicted) -> Policy {
    let shared = demand.wish.forced_samplers.is_none().then_some(Policy::TimeShare);
    let all = [Policy::Pipeline, Policy::Direct].into_iter().chain(shared);
    match demand.wish.policy {
        PolicyChoice::Pipeline => Policy::Pipeline,
        PolicyChoice::Direct => Policy::Direct,
        PolicyChoice::TimeShare => Policy::TimeShare,
        PolicyChoice::Auto => {
            let time_s = |policy: &Policy| predicted.of(*policy);
            let best = all.min_by(|a, b| time_s(a).total_cmp(&time_s(b))).unwrap_or(Policy::Direct);
            let now = demand.present.map(|present| present.policy);
            now.filter(|now| time_s(now) <= time_s(&best) * WORTH).unwrap_or(best)
        }
    }
}

#[cfg(test)]
#[path = "choose_tests.rs"]
mod tests;
