//! What happens to the schedule, and what it says is to be done.

use std::fmt;

use cluster::{Costs, JoinCluster, MeasuredCosts, PolicyChoice, Quality, SessionPlan, Workload};
use depth_image::PinholeCamera;

use super::ChoiceError;

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A node came, or came again.
    Joined {
        /// Rises with every joining, so that two processes of one name are told apart.
        incarnation: u64,
        /// Who.
        join: JoinCluster,
    },
    /// A membership ended.
    Left {
        /// Which joining.
        incarnation: u64,
        /// Who.
        node_name: String,
    },
    /// A session is ready to be planned.
    Opened(Box<Opening>),
    /// A session wants another number of views.
    Demanded {
        /// Which.
        session: u64,
        /// V.
        views_per_set: usize,
        /// Pictures a second; 0: as fast as they come.
        frames_per_s: f64,
    },
    /// A session looks from elsewhere.
    Looked {
        /// Which.
        session: u64,
        /// From where, in place of what it said before.
        viewpoints: Vec<PinholeCamera>,
    },
    /// A node timed its own work.
    Measured {
        /// Who.
        node_name: String,
        /// Under which plan.
        plan_epoch: u64,
        /// What it did.
        costs: MeasuredCosts,
        /// Seconds of all of it.
        busy_s: f64,
        /// Views made.
        views: u64,
        /// Views not made, or not sent.
        dropped_views: u64,
    },
    /// A node has taken a plan.
    Ready {
        /// Which plan.
        plan_epoch: u64,
        /// Who.
        node_name: String,
    },
    /// A node cannot take a plan.
    Unready {
        /// Which plan.
        plan_epoch: u64,
        /// Who.
        node_name: String,
        /// Why.
        reason: String,
    },
    /// A client went, or its session failed.
    Closed {
        /// Which.
        session: u64,
    },
    /// Only time has passed.
    Tick,
}

/// A session whose costs are known.
#[derive(Debug, Clone, PartialEq)]
pub struct Opening {
    /// Its number.
    pub session: u64,
    /// What is sampled.
    pub workload: Workload,
    /// V.
    pub views_per_set: usize,
    /// Pictures a second, of so many views each; 0: as fast as they come.
    pub frames_per_s: f64,
    /// Who decides.
    pub policy: PolicyChoice,
    /// K, instead of the formula's.
    pub forced_samplers: Option<usize>,
    /// Tiles of an image, instead of as many as are predicted to be fastest.
    pub forced_tiles: Option<usize>,
    /// What it makes do with under overload, in this order.
    pub fallbacks: Vec<Quality>,
    /// As measured: every node's until it reports its own.
    pub costs: Costs,
    /// From where it looks; the workload's sample cameras are then its own cells', as if it were alone. Empty: it has
    /// sample cameras of its own.
    pub viewpoints: Vec<PinholeCamera>,
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Tell every node of the plan, then these sessions.
    Apply {
        /// For whom.
        sessions: Vec<u64>,
        /// The plan.
        plan: Box<SessionPlan>,
        /// Addresses of the plan's nodes.
        addresses: Vec<String>,
    },
    /// No plan can be made.
    Refuse {
        /// Whose.
        session: u64,
        /// Why.
        error: ChoiceError,
    },
    /// A session's plan no longer holds, and it gets no other.
    End {
        /// Whose.
        session: u64,
        /// Why.
        reason: String,
    },
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Apply { sessions, plan, .. } => write_plan(f, sessions, plan),
            Self::Refuse { session, error } => write!(f, "refuse session {session}: {error}"),
            Self::End { session, reason } => write!(f, "end session {session}: {reason}"),
        }
    }
}

fn write_plan(f: &mut fmt::Formatter<'_>, sessions: &[u64], plan: &SessionPlan) -> fmt::Result {
    let assignment = &plan.assignment;
    let images = |images: &[u32]| images.iter().map(u32::to_string).collect::<Vec<_>>().join(",");
    let samplers = assignment.samplers.iter().map(|s| format!("{}[{}]", s.node_name, images(&s.image_indices)));
    let compositors = assignment.compositors.iter().map(|share| share.node_name.clone());
    write!(
        f,
        "apply plan {} to sessions {sessions:?}: {}, samplers {}, compositors {}, predicted {:.6} s a set: {}",
        assignment.plan_epoch,
        assignment.policy,
        samplers.collect::<Vec<_>>().join(" "),
        compositors.collect::<Vec<_>>().join(" "),
        plan.predicted_s(),
        plan.reason,
    )
}
