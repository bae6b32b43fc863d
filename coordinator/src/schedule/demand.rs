//! The input and the result of the choice of a plan.

use std::fmt;
use std::num::NonZeroU32;

use cluster::{InvalidField, Policy, PolicyChoice, tile_count};
use serde::{Deserialize, Serialize};

use super::{Division, Load, NodeCosts};

/// Decisions that a session takes from the schedule, for its own workload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PolicyOverride {
    /// The policy.
    pub policy: PolicyChoice,
    /// K, instead of the formula's.
    pub forced_samplers: Option<usize>,
    /// Tiles of an image, instead of as many as are predicted to be fastest.
    pub forced_tiles: Option<usize>,
}

impl PolicyOverride {
    /// # Errors
    /// For a number of tiles that no image may have.
    pub(super) fn validate(&self) -> Result<(), InvalidField> {
        let tiles = self.forced_tiles.map(|tiles| u32::try_from(tiles).unwrap_or(u32::MAX));
        tiles.map_or(Ok(()), tile_count)
    }

    /// With no more samplers than a load allows: a K that was possible when it was asked for may be too many when nodes are
    /// lost.
    pub(super) fn possible(self, load: &Load, nodes: usize) -> Self {
        let most = load.tiled(self.forced_tiles.unwrap_or(1)).most_samplers(nodes);
        Self { forced_samplers: self.forced_samplers.map(|forced| forced.min(most)), ..self }
    }
}

impl fmt::Display for PolicyOverride {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "policy {}", self.policy)?;
        self.forced_samplers.map_or(Ok(()), |k| write!(f, ", K = {k}"))?;
        self.forced_tiles.map_or(Ok(()), |tiles| write!(f, ", {tiles} tiles"))
    }
}

/// Roles of the nodes in the plan in force; those without a role count as compositors.
#[derive(Debug, Clone, PartialEq)]
pub struct CurrentRoles {
    /// The policy.
    pub policy: Policy,
    /// Whether each node samples.
    pub samples: Vec<bool>,
    /// Tiles of an image.
    pub tiles: usize,
    /// How images reach compositors.
    pub relay_fanout: Option<NonZeroU32>,
}

/// The demand, and the nodes that serve it.
#[derive(Debug, Clone, Copy)]
pub struct Demand<'a> {
    /// The work.
    pub load: Load,
    /// The nodes, by name.
    pub nodes: &'a [NodeCosts],
    /// Decisions of the session.
    pub policy_override: PolicyOverride,
    /// Roles that are kept where nothing else is clearly better.
    pub current: Option<&'a CurrentRoles>,
}

/// Predicted seconds of a sample set.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Predicted {
    /// Samplers and compositors, as divided.
    pub pipeline_s: f64,
    /// Views drawn from the scene.
    pub direct_s: f64,
    /// Every node samples and composites.
    pub time_share_s: f64,
    /// K by the balance formula, on the mean of the nodes' costs.
    pub k_fd: usize,
    /// Seconds with that K.
    pub k_fd_s: f64,
    /// K of the best division that the search finds.
    pub enumerated: usize,
    /// Seconds with that division.
    pub enumerated_s: f64,
}

impl Predicted {
    /// Seconds of a sample set by one policy.
    #[must_use]
    pub fn of(&self, policy: Policy) -> f64 {
        match policy {
            Policy::Pipeline => self.pipeline_s,
            Policy::Direct => self.direct_s,
            Policy::TimeShare => self.time_share_s,
        }
    }
}

/// A policy and a division of the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The policy.
    pub policy: Policy,
    /// The work, with images in as many tiles as is best.
    pub load: Load,
    /// Samplers of the pipeline, whether or not it was chosen.
    pub division: Division,
    /// The reason in plain words, with the figures.
    pub reason: String,
    /// Predicted times of every policy.
    pub predicted: Predicted,
}

impl Choice {
    /// Seconds of a sample set.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.predicted.of(self.policy)
    }
}

/// Why no plan can be made for a session.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum ChoiceError {
    /// The cluster is empty.
    #[error("no node has joined the cluster")]
    NoNodes,
    /// Every node refuses the plan.
    #[error("{reason}")]
    Rejected { reason: String },
    /// Images that depend on other images are whole.
    #[error("forced_tile_count is {forced}, but images of this sampling method are not tileable")]
    ForcedTiles { forced: usize },
    /// Sessions that state a rate ask for more than all nodes can do.
    #[error("frames_per_s: all sessions together would take {needed:.2} times what the nodes can do")]
    Overload { needed: f64 },
    /// As many workloads as there may be.
    #[error("workloads: {most} are open, the limit of --max-workloads")]
    Workloads { most: usize },
    /// A session forces what other sessions of its workload do not.
    #[error("policy, forced_sampler_count, forced_tile_count: the workload has other sessions, with {in_force}")]
    Override { in_force: PolicyOverride },
    /// More cells than a plan may have.
    #[error("viewpoints: they are spread over {cells} view cells, at most 64")]
    Cells { cells: usize },
    /// The session brought sample cameras, which the schedule does not move.
    #[error("viewpoints: session {session} was opened with sample cameras")]
    NoCells { session: u64 },
    /// More samplers than images (or sets, where images are sequential), or none left for views.
    #[error("forced_sampler_count is {forced}, at most {most} of {nodes} nodes can sample {images} whole images a set")]
    ForcedSamplers { forced: usize, most: usize, nodes: usize, images: usize },
}
