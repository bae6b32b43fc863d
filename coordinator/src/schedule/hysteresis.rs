//! Hysteresis between plans: a better plan replaces one that works late, seldom, and only where the switch is repaid.

use std::time::Duration;

/// Evaluations in a row that must all find the other plan better.
const CONFIRMATIONS: u32 = 3;
/// The least time between two evaluations.
const EVALUATION_INTERVAL: Duration = Duration::from_millis(500);
/// The least duration of a plan, unless a node is lost.
const DWELL: Duration = Duration::from_secs(5);
/// Nodes that are not ready delay another plan for this long at most.
const READY_WITHIN: Duration = Duration::from_secs(10);

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
}
