//! Hysteresis: a better plan replaces one that works late, seldom, and only where the switch is repaid; and nodes move
//! between workloads late and seldom.

use std::time::Duration;

/// Evaluations in a row that must all find the other plan better, or the division of the nodes uneven.
const CONFIRMATIONS: u32 = 3;
/// The least time between two evaluations.
const EVALUATION_INTERVAL: Duration = Duration::from_millis(500);
/// The least duration of a plan, unless a node is lost, and the least time between two moves of nodes.
const DWELL: Duration = Duration::from_secs(5);
/// Nodes that are not ready delay another plan for this long at most.
const READY_WITHIN: Duration = Duration::from_secs(10);

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

/// How long a plan has been in force, and how often another was better.
#[derive(Debug, Clone)]
pub(super) struct PlanHysteresis {
    since: Duration,
    evaluated_at: Duration,
    better_in_a_row: u32,
}

/// The gain of another plan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    /// Predicted time of the present plan over that of the other.
    pub(super) ratio: f64,
    /// The ratio above which the other plan is better.
    pub(super) worth: f64,
    /// Time in which sets are sampled and loaded again.
    pub(super) switch_s: f64,
}

impl PlanHysteresis {
    pub(super) fn starting_at(now: Duration) -> Self {
        Self { since: now, evaluated_at: now, better_in_a_row: 0 }
    }

    /// Whether another evaluation may be made.
    pub(super) fn is_due(&self, now: Duration) -> bool {
        now.saturating_sub(self.evaluated_at) >= EVALUATION_INTERVAL
    }

    /// Adds an evaluation; whether the plan is to be replaced now.
    pub(super) fn confirms(&mut self, now: Duration, gain: Gain, all_are_ready: bool) -> bool {
        self.evaluated_at = now;
        self.better_in_a_row = if gain.ratio > gain.worth { self.better_in_a_row + 1 } else { 0 };
        let lasted = now.saturating_sub(self.since);
        let has_settled = all_are_ready || lasted >= READY_WITHIN;
        has_settled && self.better_in_a_row >= CONFIRMATIONS && lasted >= DWELL && repays(gain, lasted)
    }
}

/// Demand lasts about as long again as it has lasted: the time that the better plan saves until then must repay the switch.
fn repays(gain: Gain, lasted: Duration) -> bool {
    (1.0 - gain.ratio.recip()) * lasted.as_secs_f64() >= gain.switch_s
}

#[cfg(test)]
mod tests {
    use super::*;

    const BETTER: Gain = Gain { ratio: 1.5, worth: 1.1, switch_s: 0.1 };

    /// The evaluation that replaces the plan; there are two a second.
    fn replaced(gains: impl Fn(u64) -> Gain, all_are_ready: bool) -> Option<u64> {
        let mut hysteresis = PlanHysteresis::starting_at(Duration::ZERO);
        (1..100).find(|&i| {
            let now = Duration::from_millis(500 * i);
            assert!(hysteresis.is_due(now) && !hysteresis.is_due(now - Duration::from_millis(1)));
            hysteresis.confirms(now, gains(i), all_are_ready)
        })
    }

    #[test]
    fn a_plan_dwells_and_three_evaluations_in_a_row_must_agree() {
        assert_eq!(replaced(|_| BETTER, true), Some(10));
        assert_eq!(replaced(|i| Gain { ratio: if i % 3 == 0 { 1.05 } else { 1.5 }, ..BETTER }, true), None);
        assert_eq!(replaced(|i| Gain { ratio: if i < 20 { 1.0 } else { 1.5 }, ..BETTER }, true), Some(22));
    }

    #[test]
    fn an_expensive_switch_waits_until_it_is_repaid() {
        assert_eq!(replaced(|_| Gain { switch_s: 5.0, ..BETTER }, true), Some(30), "a third of 15 s");
        assert_eq!(replaced(|_| Gain { ratio: 1.0, switch_s: 0.0, ..BETTER }, true), None);
    }

    #[test]
    fn nodes_that_are_not_ready_delay_a_plan_for_ten_seconds() {
        assert_eq!(replaced(|_| BETTER, false), Some(20));
    }

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
