//! Inputs of the planner.

use serde::{Deserialize, Serialize};

use crate::costs::RowCosts;
use crate::invalid::{InvalidField, seconds, within};
use crate::kept::Kept;
use crate::ladder::MAX_ROWS;
use crate::view::ProbeView;
use crate::view_errors::ViewErrors;

/// The most views of one probe.
pub const MAX_PROBE_VIEWS: usize = 64;
/// The most bytes of a reason.
const MAX_REASON_BYTES: usize = 1024;

/// The beginning of a reason, as long as an event may have it.
#[must_use]
pub fn shortened_reason(reason: &str) -> String {
    reason[..reason.floor_char_boundary(MAX_REASON_BYTES)].to_owned()
}

/// A measurement that a command asked for. Answers repeat it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProbeId {
    /// The plan's number, from its request.
    pub plan: u64,
    /// The number of the measurement within the plan.
    pub number: u64,
}

/// An event of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// Measurements of earlier plans, maybe none. It is the first event, and starts the plan.
    Remembered(Kept),
    /// The answer to [`Probe`](crate::Command::Probe).
    Probed(Probed),
    /// The answer to [`Time`](crate::Command::Time).
    Timed(Timed),
    /// A measurement failed, and is not tried again: its row is not chosen.
    Failed {
        /// The measurement.
        id: ProbeId,
        /// The reason, in plain words.
        reason: String,
        /// The node's time, in s.
        busy_s: f64,
    },
    /// Measuring may take so much of the nodes' time in all, in s. It may rise with time, and ends the plan at 0.
    Allowed {
        /// The allowance in s.
        allowance_s: f64,
    },
}

/// The measured views of one row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Probed {
    pub id: ProbeId,
    /// The row's place in the ladder.
    pub row: usize,
    /// The errors of every view that was asked for, in that order.
    pub views: Vec<(ProbeView, ViewErrors)>,
    /// The row's costs, always in the light of the session.
    pub costs: RowCosts,
    /// The node's time for all of it, truth and comparison included, in s.
    pub busy_s: f64,
}

/// Rows that were timed in turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Timed {
    pub id: ProbeId,
    /// Each row's place in the ladder and its median costs, in the order of the command.
    pub rows: Vec<(usize, RowCosts)>,
    /// The nodes' time for all of it, in s.
    pub busy_s: f64,
}

impl Event {
    /// # Errors
    /// For a value that no event may have, by its field.
    pub fn validate(&self) -> Result<(), InvalidField> {
        match self {
            Self::Remembered(kept) => kept.validate(),
            Self::Probed(probed) => probed.validate(),
            Self::Timed(timed) => timed.validate(),
            Self::Failed { reason, busy_s, .. } => {
                within(reason.len(), 0..=MAX_REASON_BYTES, "reason", "of at most 1024 bytes")?;
                seconds(*busy_s, "busy_s")
            }
            Self::Allowed { allowance_s } => seconds(*allowance_s, "allowance_s"),
        }
    }
}

impl Probed {
    fn validate(&self) -> Result<(), InvalidField> {
        within(self.row, 0..=MAX_ROWS - 1, "row", "below 220")?;
        within(self.views.len(), 1..=MAX_PROBE_VIEWS, "views", "from 1 to 64")?;
        self.views.iter().try_for_each(|(_, errors)| errors.validate())?;
        self.costs.validate()?;
        seconds(self.busy_s, "busy_s")
    }
}

impl Timed {
    fn validate(&self) -> Result<(), InvalidField> {
        within(self.rows.len(), 1..=MAX_ROWS, "rows", "from 1 to 220")?;
        self.rows.iter().try_for_each(|(_, costs)| costs.validate())?;
        seconds(self.busy_s, "busy_s")
    }
}
