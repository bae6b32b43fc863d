//! Outputs of the schedule, which the executor executes.

use std::fmt;
use std::time::Duration;

use cluster::{FetchImages, MeasureCosts, NodeStatus, Promise, SessionPlan};
use depth_image::SampleCamera;

use planner::ProbeId;

use super::{ChoiceError, ProbeKind};

/// A command to the executor.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum Command {
    /// Apply the plan on these nodes, which have a role in it or had one in the workload's plan before, then announce it to the sessions and answer with
    /// [`Event::Applied`](super::Event::Applied).
    Apply { sessions: Vec<u64>, plan: Box<SessionPlan>, nodes: Vec<NodeStatus> },
    /// Probe a node, and answer with [`Event::Probed`](super::Event::Probed).
    Probe(Box<Probe>),
    /// The node stays a member, and gets no role until it is readmitted: none at all, or none of one workload.
    Quarantine { node_name: String, workload_number: Option<u64>, reason: String },
    /// The node may get such roles again.
    Readmit { node_name: String, workload_number: Option<u64> },
    /// Have a node measure views, and answer with [`Event::ViewsProbed`](super::Event::ViewsProbed) or
    /// [`Event::ProbeFailed`](super::Event::ProbeFailed).
    ProbeViews(Box<ViewProbe>),
    /// Tell the sessions what is promised to them.
    Promise { sessions: Vec<u64>, promise: Box<Promise> },
    /// No plan can be made for the session.
    Refuse { session: u64, error: ChoiceError },
}

/// A measurement that one node is asked for.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct ViewProbe {
    pub workload_number: u64,
    pub id: ProbeId,
    pub node_name: String,
    pub address: String,
    pub request: MeasureCosts,
}

/// A question that the coordinator asks a node itself.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Probe {
    pub plan_epoch: u64,
    pub node_name: String,
    pub incarnation: u64,
    pub address: String,
    /// `None`: whether the node serves.
    pub image: Option<ProbedImage>,
    /// An answer that takes longer is a failure.
    pub deadline: Duration,
}

/// The image that a probe fetches.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbedImage {
    /// A request for one image.
    pub request: FetchImages,
    /// The image's camera.
    pub camera: SampleCamera,
}

impl Probe {
    /// The kind of this probe.
    #[must_use]
    pub fn kind(&self) -> ProbeKind {
        if self.image.is_some() { ProbeKind::Image } else { ProbeKind::Liveness }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Apply { sessions, plan, .. } => write_plan(f, sessions, plan),
            Self::Probe(probe) => write_probe(f, probe),
            Self::Quarantine { node_name, workload_number, reason } => {
                write!(f, "quarantine {node_name}{}: {reason}", of_workload(*workload_number))
            }
            Self::Readmit { node_name, workload_number } => {
                write!(f, "readmit {node_name}{}", of_workload(*workload_number))
            }
            Self::ProbeViews(probe) => write_view_probe(f, probe),
            Self::Promise { sessions, promise } => write!(f, "tell sessions {sessions:?}: {promise}"),
            Self::Refuse { session, error } => write!(f, "refuse session {session}: {error}"),
        }
    }
}

fn write_view_probe(f: &mut fmt::Formatter<'_>, probe: &ViewProbe) -> fmt::Result {
    let ViewProbe { workload_number, id, node_name, request, .. } = probe;
    let method = &request.method;
    write!(f, "{node_name} is to compare {method} for workload {workload_number}, measurement {}", id.number)
}

fn joined<T: ToString>(values: impl IntoIterator<Item = T>, separator: &str) -> String {
    values.into_iter().map(|value| value.to_string()).collect::<Vec<_>>().join(separator)
}

fn of_workload(number: Option<u64>) -> String {
    number.map_or_else(String::new, |number| format!(" from workload {number}"))
}

fn write_probe(f: &mut fmt::Formatter<'_>, probe: &Probe) -> fmt::Result {
    match &probe.image {
        None => write!(f, "probe whether {} serves", probe.node_name),
        Some(ProbedImage { request, .. }) => write!(
            f,
            "probe image {:?} of set {} and cell {} of {}",
            request.image_indices, request.set_index, request.cell, probe.node_name
        ),
    }
}

fn write_plan(f: &mut fmt::Formatter<'_>, sessions: &[u64], plan: &SessionPlan) -> fmt::Result {
    let assignment = &plan.assignment;
    let samplers =
        assignment.samplers.iter().map(|share| format!("{}[{}]", share.node_name, joined(&share.image_indices, ",")));
    write!(
        f,
        "apply plan {} of workload {} to sessions {sessions:?}: {}, samplers {}, compositors {}, predicted {:.6} s a set: {}",
        assignment.plan_epoch,
        assignment.workload_number,
        assignment.policy,
        joined(samplers, " "),
        joined(assignment.compositors.iter().map(|share| &share.node_name), " "),
        plan.predicted_s(),
        plan.reason,
    )
}
