//! Outputs of the planner.

use crate::event::ProbeId;
use crate::invalid::InvalidField;
use crate::kept::Kept;
use crate::outcome::Outcome;
use crate::view::ProbeView;

/// A command to the caller. At most one measurement is asked for at a time.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum Command {
    /// Measure the errors of a row on these views, and its costs in the light of the session.
    Probe {
        id: ProbeId,
        /// The row's place in the ladder.
        row: usize,
        views: Vec<ProbeView>,
        purpose: Purpose,
    },
    /// Time these rows alone, in turn, on `view_count` views each, `repeats` times; answer with the medians.
    Time { id: ProbeId, rows: Vec<usize>, view_count: usize, repeats: usize },
    /// Keep what was measured. It comes before [`Command::Conclude`].
    Keep(Box<Kept>),
    /// The plan is made.
    Conclude(Box<Outcome>),
    /// An event is refused and changes nothing: a measurement is foreign, or a value is impossible.
    Refuse(InvalidField),
}

/// The use of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// It compares rows. Geometry decides: errors may be measured without light. Costs always include the session's light.
    Screening,
    /// It is the base of a promise: errors are measured in the light of the session.
    Certification,
}
