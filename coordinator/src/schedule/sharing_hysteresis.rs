//! When nodes move between workloads: late, and seldom.

use std::time::Duration;

/// Evaluations in a row that must all find the division uneven.
const CONFIRMATIONS: u32 = 3;
/// The least time between two evaluations.
const EVALUATION_INTERVAL: Duration = Duration::from_millis(500);
/// The least time between two moves.
const DWELL: Duration = Duration::from_secs(5);

/// The last move of nodes between workloads, and how often the division was uneven since.
#[derive(Debug, Clone, Default)]
pub(super) struct SharingHysteresis {
    moved_at: Option<Duration>,
    evaluated_at: Duration,
    uneven_in_a_row: u32,
}

impl SharingHysteresis {
    pub(super) fn is_due(&self, now: Duration) -> bool {
        now.saturating_sub(self.evaluated_at) >= EVALUATION_INTERVAL
    }

    /// Whether nodes may be taken from a workload for another that has none.
    pub(super) fn has_settled(&self, now: Duration) -> bool {
        self.moved_at.is_none_or(|moved_at| now.saturating_sub(moved_at) >= DWELL)
    }

    /// Adds an evaluation; whether a node is to move now.
    pub(super) fn confirms(&mut self, now: Duration, is_uneven: bool) -> bool {
        self.evaluated_at = now;
        self.uneven_in_a_row = if is_uneven { self.uneven_in_a_row + 1 } else { 0 };
        self.uneven_in_a_row >= CONFIRMATIONS && self.has_settled(now)
    }

    /// Nodes have moved.
    pub(super) fn note_move(&mut self, now: Duration) {
        (self.moved_at, self.uneven_in_a_row) = (Some(now), 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_division_dwells_and_three_evaluations_in_a_row_must_find_it_uneven() {
        let mut hysteresis = SharingHysteresis::default();
        let at = |i: u32| EVALUATION_INTERVAL * i;
        assert!(hysteresis.has_settled(at(0)), "nothing has moved");
        let uneven = [true, true, false, true, true, true];
        let moves: Vec<bool> = (1..).zip(uneven).map(|(i, uneven)| hysteresis.confirms(at(i), uneven)).collect();
        assert_eq!(moves, [false, false, false, false, false, true]);
        hysteresis.note_move(at(6));
        let next = (7..100).find(|&i| hysteresis.is_due(at(i)) && hysteresis.confirms(at(i), true));
        assert_eq!(next, Some(16), "5 s later");
    }
}
