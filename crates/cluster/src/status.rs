//! The cluster as the coordinator sees it, and the scene that it offers: enough for a client to place its views.

use depth_image::{Aabb, Camera, SourceSpace};

use crate::check::{InvalidField, at_most, finite_seconds, nonempty, text};
use crate::costs::Costs;
use crate::limits::{MAX_NODES, MAX_SAMPLE_CAMERAS, MAX_SCENES, MAX_WORKLOADS};
use crate::node::{NodeStatus, SharedLightCosts};
use crate::policy::Policy;
use crate::promise::Promise;
use crate::scene::SceneRef;
use crate::session::SessionPlan;

/// More policies than there will be.
const MAX_POLICIES: usize = 16;

/// The cluster as the coordinator sees it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ClusterStatus {
    /// The highest plan so far.
    pub plan_epoch: u64,
    /// Members by name.
    pub nodes: Vec<NodeStatus>,
    /// The scenes on offer; sessions that name none get the first.
    pub offers: Vec<OfferStatus>,
    /// Every open workload.
    pub workloads: Vec<WorkloadStatus>,
}

impl ClusterStatus {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        at_most(self.nodes.len(), MAX_NODES, "nodes")?;
        at_most(self.workloads.len(), MAX_WORKLOADS, "workloads")?;
        at_most(self.offers.len(), MAX_SCENES, "offers")?;
        self.offers.iter().try_for_each(OfferStatus::validate)?;
        self.workloads.iter().try_for_each(WorkloadStatus::validate)
    }

    /// Sessions of all workloads.
    #[must_use]
    pub fn session_count(&self) -> u64 {
        self.workloads.iter().map(|workload| u64::from(workload.session_count)).sum()
    }

    /// V: views that all sessions ask of each sample set.
    #[must_use]
    pub fn views_per_set(&self) -> u64 {
        self.workloads.iter().fold(0, |sum, workload| sum.saturating_add(workload.views_per_set))
    }

    /// K: nodes that sample, each counted once for every workload that it samples for.
    #[must_use]
    pub fn sampler_count(&self) -> usize {
        self.workloads.iter().filter_map(|workload| Some(workload.plan.as_ref()?.sampler_count())).sum()
    }
}

/// One workload: sessions that share samples, and what they get.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WorkloadStatus {
    /// Its number, which no other workload has had.
    pub number: u64,
    /// The plan in force; `None` while no node serves it.
    pub plan: Option<SessionPlan>,
    /// Sessions that share the plan, or wait for one.
    pub session_count: u32,
    /// Sessions with a rate.
    pub viewer_count: u32,
    /// V: views that its sessions ask of each sample set.
    pub views_per_set: u64,
    /// The condition of every node that serves it.
    pub conditions: Vec<NodeCondition>,
    /// One entry for each policy that has been in force for it.
    pub achieved: Vec<AchievedTime>,
    /// The share of its nodes' time that its sessions' frame rates take; `None` without such sessions.
    pub utilisation: Option<f64>,
    /// The promise to its sessions; `None` without a budget.
    pub promise: Option<Promise>,
    /// Where the time of a view goes by the usual method of its sessions, as measured when they were opened; `None` where views
    /// take no light from samples.
    pub shared_light: Option<SharedLightCosts>,
    /// The share of all nodes' time that one more viewer would take: one like the mean of its viewers, or one of 10 views a
    /// second.
    pub one_more_viewer: f64,
}

impl WorkloadStatus {
    fn validate(&self) -> Result<(), InvalidField> {
        at_most(self.conditions.len(), MAX_NODES, "conditions")?;
        at_most(self.achieved.len(), MAX_POLICIES, "achieved_times")?;
        self.plan.as_ref().map_or(Ok(()), SessionPlan::validate)?;
        self.promise.as_ref().map_or(Ok(()), Promise::validate)?;
        self.shared_light.as_ref().map_or(Ok(()), SharedLightCosts::validate)?;
        self.conditions.iter().try_for_each(NodeCondition::validate)?;
        self.achieved.iter().try_for_each(|achieved| finite_seconds(achieved.busy_s, "busy_s"))?;
        finite_seconds(self.utilisation, "utilisation_ratio")?;
        finite_seconds(self.one_more_viewer, "one_more_viewer_ratio")
    }
}

/// The time that a policy took, as nodes timed themselves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AchievedTime {
    /// The policy.
    pub policy: Policy,
    /// Seconds of the busiest node, for all views of a set.
    pub busy_s: f64,
}

/// The condition of a member.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeCondition {
    /// The member's unique name.
    pub node_name: String,
    /// Whether it is ready for the plan in force.
    pub is_ready: bool,
    /// As estimated now, from the node's own timings.
    pub costs: Costs,
    /// Views made since it joined.
    pub views: u64,
    /// Views not made, or not sent, since it joined.
    pub dropped_views: u64,
    /// The share of the last second that it worked, for all workloads; two operations at a time count twice.
    pub busy_ratio: f64,
}

impl NodeCondition {
    fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.node_name, "node_name")?;
        self.costs.validate()?;
        finite_seconds(self.busy_ratio, "busy_ratio")
    }
}

/// A scene on offer.
#[derive(Debug, Clone, PartialEq)]
pub struct OfferStatus {
    /// The name by which sessions ask for it, unique among the offers.
    pub name: String,
    /// The scene by content.
    pub scene: SceneRef,
    /// Sample cameras for sessions that bring none.
    pub sample_cameras: Vec<Camera>,
    /// The bounds of reconstruction.
    pub volume: Aabb,
    /// The space of the scene's file, in which views name their cameras.
    pub source_space: SourceSpace,
    /// Settings for sessions that choose none.
    pub settings: OfferSettings,
    /// Seconds after which a scene that moves is as at its start; `None` for one that never moves.
    pub period_s: Option<f64>,
}

/// Settings named as on the command line; `None` where the client may choose.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OfferSettings {
    /// How views are reconstructed.
    pub method: Option<String>,
    /// How images are sampled.
    pub sampling: Option<String>,
    /// How samples are lit.
    pub lighting: Option<String>,
}

impl OfferStatus {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        let SourceSpace { origin_in_source, metres_per_unit } = self.source_space;
        if !origin_in_source.is_finite() {
            return Err(InvalidField::out_of_range("origin_in_source", origin_in_source, "finite"));
        }
        if !self.source_space.is_valid() {
            return Err(InvalidField::out_of_range("metres_per_source_unit", metres_per_unit, "above 0"));
        }
        finite_seconds(self.period_s, "offer.period_s")?;
        nonempty(&self.name, "offers.name")?;
        self.scene.validate()?;
        at_most(self.sample_cameras.len(), MAX_SAMPLE_CAMERAS, "sample_cameras")?;
        let OfferSettings { method, sampling, lighting } = &self.settings;
        text(method.as_deref().unwrap_or_default(), "reconstruction_method")?;
        text(sampling.as_deref().unwrap_or_default(), "sampling_method")?;
        text(lighting.as_deref().unwrap_or_default(), "lighting")
    }
}
