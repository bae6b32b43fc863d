//! Members: joining, measuring, being ready for plans, and reports on their own work and on each other.

use depth_image::{ExposureEv, PinholeCamera, ViewPlanes};
use planner::{ProbeId, Probed, RowCosts, ViewErrors};
use serde::{Deserialize, Serialize};

use crate::audit::{AuditReport, check_view_errors};
use crate::check::{InvalidField, at_most, finite_seconds, nonempty, reason, text, viewpoints, within};
use crate::check_seconds;
use crate::costs::{Costs, MeasuredCosts};
use crate::limits::{MAX_BATCH, MAX_JOINING_EPOCH};
use crate::scene::SceneRef;
use crate::views::check_view_size;
use crate::workload::{SamplePlanes, Workload};

/// A node that wants to be a member.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JoinCluster {
    /// The node, its address and its device.
    pub node: NodeStatus,
    /// The highest plan it has seen.
    pub plan_epoch: u64,
}

impl JoinCluster {
    /// # Errors
    /// For names and addresses that are missing or too long, and for an epoch that leaves no room for later plans.
    pub fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.node.node_name, "node_name")?;
        nonempty(&self.node.address, "node_address")?;
        text(&self.node.device_name, "device_name")?;
        within(self.plan_epoch, 0..=MAX_JOINING_EPOCH, "plan_epoch", "at most 2^48")
    }
}

/// A member.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NodeStatus {
    /// Unique in the cluster; of two with one name the later counts.
    pub node_name: String,
    /// Where other processes reach it, as `http://host:port`.
    pub address: String,
    /// As every reported time names it.
    pub device_name: String,
    /// Whether the device is a CPU.
    pub is_software: bool,
}

/// The coordinator's answer to a member that joins.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Welcome {
    /// Scenes on offer, to be loaded ahead.
    pub scenes: Vec<SceneRef>,
}

/// Asks a node what operations cost it.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasureCosts {
    /// The workload to measure, at set 0 of its timeline, with the planes that the method needs.
    pub workload: Workload,
    /// How views are reconstructed.
    pub method: String,
    /// How frames are encoded.
    pub codec: String,
    /// Views that are reconstructed and drawn, in turn: of one size, at least one. A view's cost depends on its place.
    pub typical_views: Vec<PinholeCamera>,
    /// Most views of one call: fewer are drawn directly where they take long.
    pub batch_count: u32,
    /// Planes of the views.
    pub planes: ViewPlanes,
    /// Nobody waits for it: all other work goes first.
    pub in_background: bool,
    /// The typical views are compared for a budget, and only samples and these views are timed.
    pub budget: Option<BudgetMeasurement>,
}

/// A measurement of a way to make views, of which each typical view is made from its own view cell.
#[derive(Debug, Clone, PartialEq)]
pub struct BudgetMeasurement {
    /// The light of the directly drawn views with which the typical views are compared.
    pub truth_lighting: String,
}

impl MeasureCosts {
    /// The first `count` of its views, repeated in turn.
    #[must_use]
    pub fn views(&self, count: u32) -> Vec<PinholeCamera> {
        self.typical_views.iter().copied().cycle().take(count as usize).collect()
    }

    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        within(self.batch_count, 1..=MAX_BATCH, "batch_count", "from 1 to 64")?;
        self.workload.validate()?;
        nonempty(&self.method, "reconstruction_method")?;
        nonempty(&self.codec, "frame_codec")?;
        if self.workload.sample_cameras.is_empty() {
            return Err(InvalidField::Missing { field: "sample_cameras" });
        }
        at_most(self.typical_views.len(), MAX_BATCH as usize, "typical_views")?;
        let first = self.typical_views.first().ok_or(InvalidField::Missing { field: "typical_views" })?;
        check_view_size(first.size_px, "typical_views.size_px")?;
        for view in &self.typical_views {
            view.validate().map_err(|source| InvalidField::Camera { field: "typical_views", source })?;
        }
        self.budget.as_ref().map_or(Ok(()), |budget| nonempty(&budget.truth_lighting, "truth_lighting"))?;
        match self.typical_views.iter().find(|view| view.size_px != first.size_px) {
            Some(other) => Err(InvalidField::out_of_range("typical_views", other.size_px, "all of one size")),
            None => Ok(()),
        }
    }
}

/// What a node has measured.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measured {
    /// Seconds of each operation.
    pub costs: Costs,
    /// The planes of sample images that the reconstruction method needs, with which the images were measured.
    pub planes: SamplePlanes,
    /// The exposure at which the view in the middle of the workload's first view cell is bright, and little of it white.
    pub auto_exposure: ExposureEv,
    /// The pixels up to which pictures find surfaces faster by rays; `None` where nobody measured it.
    pub traced_pixel_count: Option<u32>,
    /// The parts of a view whose light comes from samples; `None` by another method.
    pub shared_light: Option<SharedLightCosts>,
    /// The errors of the typical views, where they were compared, in their order.
    pub views: Vec<ViewErrors>,
    /// The node's time for a budget's measurement, in s.
    pub busy_s: f64,
}

impl Measured {
    /// The answer to a plan's measurement.
    #[must_use]
    pub fn probed(self, id: ProbeId) -> Probed {
        let costs = RowCosts {
            sample_image_s: self.costs.sample_image_s,
            load_set_s: self.costs.load_set_s,
            view_s: self.costs.reconstruct_view_s,
        };
        Probed { id, views: self.views, costs, busy_s: self.busy_s }
    }

    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        self.costs.validate()?;
        self.views.iter().try_for_each(check_view_errors)?;
        finite_seconds(self.busy_s, "busy_s")
    }
}

/// Where the time of a view goes whose light comes from samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SharedLightCosts {
    /// The share of the view's surface points whose light samples know, from 0 to 1.
    pub known_ratio: f64,
    /// Seconds of finding surfaces.
    pub surfaces_s: f64,
    /// Seconds of looking up their light, and of lighting the points that no sample is near.
    pub look_up_s: f64,
    /// Seconds of lighting the other points that no sample knows.
    pub unknown_s: f64,
}

impl SharedLightCosts {
    /// The costs of a view that takes `ratio` times as long, with as many known points.
    #[must_use]
    pub fn scaled(self, ratio: f64) -> Self {
        Self {
            known_ratio: self.known_ratio,
            surfaces_s: self.surfaces_s * ratio,
            look_up_s: self.look_up_s * ratio,
            unknown_s: self.unknown_s * ratio,
        }
    }

    /// # Errors
    /// For a share that is not from 0 to 1, and for times that are negative or not finite.
    pub fn validate(&self) -> Result<(), InvalidField> {
        check_seconds!(self; surfaces_s, look_up_s, unknown_s);
        within(self.known_ratio, 0.0..=1.0, "known_ratio", "from 0 to 1")
    }
}

/// A node is ready for a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ready {
    /// The plan's epoch.
    pub plan_epoch: u64,
    /// Time to load the scene; 0 where it was loaded already.
    pub scene_load_s: f64,
}

/// The work of a member since its last report.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkReport {
    /// The member's unique name.
    pub node_name: String,
    /// The plan under which the work was done.
    pub plan_epoch: u64,
    /// The workload of that plan.
    pub workload_number: u64,
    /// Mean times of the operations.
    pub costs: MeasuredCosts,
    /// Seconds of all operations together.
    pub busy_s: f64,
    /// Views made.
    pub views: u64,
    /// Views not made, or not sent.
    pub dropped_views: u64,
    /// Where the workload's live viewers on this member are; those that are near to each other may be merged.
    pub viewpoints: Vec<PinholeCamera>,
    /// `None` where no promise is audited.
    pub audit: Option<AuditReport>,
}

impl WorkReport {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.node_name, "node_name")?;
        self.costs.validate()?;
        finite_seconds(self.busy_s, "busy_s")?;
        self.audit.as_ref().map_or(Ok(()), AuditReport::validate)?;
        viewpoints(&self.viewpoints)
    }
}

/// A compositor cannot get images of a sampler, though it asked again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SamplerReport {
    /// The plan in which both have their roles.
    pub plan_epoch: u64,
    /// The compositor that reports.
    pub compositor: String,
    /// The sampler that is reported.
    pub sampler: String,
    /// Why it gets no images.
    pub reason: String,
}

impl SamplerReport {
    /// # Errors
    /// For names that are missing or too long, and for a long reason.
    pub fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.compositor, "compositor_name")?;
        nonempty(&self.sampler, "sampler_name")?;
        reason(&self.reason, "reason")
    }
}
