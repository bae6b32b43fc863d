//! Inputs of the schedule.

use cluster::limits::{MAX_VIEWS_PER_SET, MAX_WORKLOADS};
use cluster::{
    AuditReport, Costs, InvalidField, JoinCluster, MAX_AUDIT_TIME_RATIO, MeasuredCosts, Quality, SamplePlanes,
    SamplerReport, SharedLightCosts, Workload, finite_seconds, frame_rate, nonempty, ratio, reason, viewpoints,
};
use depth_image::{ExposureEv, PinholeCamera};
use planner::ProbeId;
use serde::{Deserialize, Serialize};

use super::{Budgeted, PolicyOverride};

/// An event of the cluster. Events of an epoch concern the plan of that epoch alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum Event {
    /// The coordinator's limits, at its start.
    Limits { max_workloads: usize, audit_time_ratio: f64 },
    /// A node joined, or joined again. `incarnation` rises with every joining and tells two processes of one name apart.
    Joined { incarnation: u64, join: JoinCluster },
    /// A membership ended.
    Left { incarnation: u64, node_name: String },
    /// A session is ready to be planned.
    Opened(Box<Opening>),
    /// A session asks for another number of views a set, or another rate; `None`: as fast as they come.
    DemandChanged { session: u64, views_per_set: usize, frames_per_s: Option<f64> },
    /// A session looks from these viewpoints, in place of those before.
    ViewpointsChanged { session: u64, viewpoints: Vec<PinholeCamera> },
    /// A compositor's live viewers are at these viewpoints, in place of those before.
    ViewersMoved { workload_number: u64, node_name: String, viewpoints: Vec<PinholeCamera> },
    /// A node timed its own work. `busy_s` is the time of all of it.
    Measured { node_name: String, plan_epoch: u64, costs: MeasuredCosts, busy_s: f64, views: u64, dropped_views: u64 },
    /// A member's audits of a workload's views.
    Audited { workload_number: u64, node_name: String, report: AuditReport },
    /// A node has taken the plan.
    Ready { plan_epoch: u64, node_name: String },
    /// A node refuses the plan: it asks for what this node cannot do.
    Rejected { plan_epoch: u64, node_name: String, reason: String },
    /// A node failed to take the plan.
    Unready { plan_epoch: u64, node_name: String, reason: String },
    /// All nodes have answered to the plan, or failed to.
    Applied { plan_epoch: u64 },
    /// A compositor cannot get images of a sampler.
    Reported(SamplerReport),
    /// The answer to a [`Probe`](super::Probe); `failure` is `None` where the node passed.
    Probed { plan_epoch: u64, node_name: String, incarnation: u64, kind: ProbeKind, failure: Option<String> },
    /// The answer to [`Command::ProbeViews`](super::Command::ProbeViews).
    ViewsProbed { workload_number: u64, probed: Box<planner::Probed>, planes: SamplePlanes },
    /// A node has not measured views; where it was lost, another is asked.
    ProbeFailed { workload_number: u64, id: ProbeId, is_lost: bool },
    /// A client left, or its session failed.
    Closed { session: u64 },
    /// Only time has passed.
    Tick,
}

/// The kind of a probe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProbeKind {
    /// An answer of its health service.
    Liveness,
    /// One image of the plan, whole and decodable.
    Image,
}

/// A session whose costs are known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Opening {
    /// Its number.
    pub session: u64,
    /// The session's workload.
    pub workload: Workload,
    /// How its views are reconstructed.
    pub method: String,
    /// V.
    pub views_per_set: usize,
    /// Pictures a second, of `views_per_set` views each; `None`: as fast as they come.
    pub frames_per_s: Option<f64>,
    /// Decisions that the session takes from the schedule.
    pub policy_override: PolicyOverride,
    /// Qualities to fall back to under overload, in this order.
    pub fallbacks: Vec<Quality>,
    /// Measured costs, of the session's own views: every node's until it reports its own.
    pub costs: Costs,
    /// The exposure of the workload's default view: its first session's counts.
    #[serde(default)]
    pub auto_exposure: ExposureEv,
    /// The workload's sample cameras are the cells of these viewpoints, as if the session were alone. Empty: it brings
    /// sample cameras of its own.
    pub viewpoints: Vec<PinholeCamera>,
    /// Its budget; `None`: it is shown what it asks for.
    pub budgeted: Option<Budgeted>,
    /// The time of a view at its last fallback over that of one as it asks for, as measured; 1 where nobody knows it.
    #[serde(default = "unknown_ratio")]
    pub last_view_time_ratio: f64,
    /// Where the time of its views goes, as measured; `None` where they take no light from samples.
    #[serde(default)]
    pub shared_light: Option<SharedLightCosts>,
    /// What the reasons of its workload's plans say beside their figures.
    #[serde(default)]
    pub note: String,
}

impl Event {
    /// # Errors
    /// For values that no peer may send, as a damaged log may have them.
    pub(super) fn validate(&self) -> Result<(), InvalidField> {
        match self {
            Self::Limits { max_workloads, .. } if !(1..=MAX_WORKLOADS).contains(max_workloads) => {
                Err(InvalidField::out_of_range("max_workloads", max_workloads, "from 1 to 64"))
            }
            Self::Limits { audit_time_ratio, .. } if !(0.0..=MAX_AUDIT_TIME_RATIO).contains(audit_time_ratio) => {
                Err(InvalidField::out_of_range("audit_time_ratio", audit_time_ratio, "from 0 to 0.5"))
            }
            Self::Joined { join, .. } => join.validate(),
            Self::Opened(opening) => opening.validate(),
            Self::DemandChanged { views_per_set, frames_per_s, .. } => check_demand(*views_per_set, *frames_per_s),
            Self::ViewpointsChanged { viewpoints: changed, .. } => viewpoints(changed),
            Self::ViewersMoved { node_name, viewpoints: changed, .. } => {
                nonempty(node_name, "node_name")?;
                viewpoints(changed)
            }
            Self::Measured { node_name, costs, busy_s, .. } => {
                nonempty(node_name, "node_name")?;
                costs.validate()?;
                finite_seconds(*busy_s, "busy_s")
            }
            Self::Audited { node_name, report, .. } => {
                nonempty(node_name, "node_name")?;
                report.validate()
            }
            Self::Left { node_name, .. }
            | Self::Ready { node_name, .. }
            | Self::Rejected { node_name, .. }
            | Self::Unready { node_name, .. }
            | Self::Probed { node_name, .. } => nonempty(node_name, "node_name"),
            Self::Reported(report) => report.validate(),
            Self::ViewsProbed { probed, .. } => {
                probed.validate().map_err(|error| InvalidField::out_of_range(error.field, error.value, error.allowed))
            }
            Self::Limits { .. }
            | Self::ProbeFailed { .. }
            | Self::Applied { .. }
            | Self::Closed { .. }
            | Self::Tick => Ok(()),
        }
    }
}

fn unknown_ratio() -> f64 {
    1.0
}

impl Opening {
    fn validate(&self) -> Result<(), InvalidField> {
        self.workload.validate()?;
        nonempty(&self.method, "method")?;
        check_demand(self.views_per_set, self.frames_per_s)?;
        self.policy_override.validate()?;
        self.fallbacks.iter().try_for_each(Quality::validate)?;
        self.costs.validate()?;
        self.budgeted.as_ref().map_or(Ok(()), Budgeted::validate)?;
        ratio(self.last_view_time_ratio, "last_view_time_ratio")?;
        self.shared_light.as_ref().map_or(Ok(()), SharedLightCosts::validate)?;
        reason(&self.note, "note")?;
        viewpoints(&self.viewpoints)
    }
}

fn check_demand(views_per_set: usize, frames_per_s: Option<f64>) -> Result<(), InvalidField> {
    if views_per_set > MAX_VIEWS_PER_SET as usize {
        return Err(InvalidField::out_of_range("views_per_set", views_per_set, "from 0 to 65536"));
    }
    frame_rate(frames_per_s)
}
