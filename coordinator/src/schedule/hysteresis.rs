//! When a better plan takes the place of one that works: not at once, not often, and only where it pays.

use std::collections::BTreeSet;
use std::time::Duration;

/// Looks in a row that must all find the better plan better.
const LOOKS: u32 = 3;
/// Between two looks that count.
const LOOK_APART: Duration = Duration::from_millis(500);
/// What a plan lasts at least, unless a node is lost.
const DWELL: Duration = Duration::from_secs(5);
/// Nodes that have not said that they are ready are waited for so long.
const READY_WITHIN: Duration = Duration::from_secs(10);

/// How long a plan has been in force, and what was seen meanwhile.
#[derive(Debug, Clone)]
pub(super) struct Patience {
    since: Duration,
    looked_at: Duration,
    better_in_a_row: u32,
    /// Who has taken the plan.
    pub(super) ready: BTreeSet<String>,
}

/// What another plan would bring.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    /// Predicted time now over predicted time then.
    pub(super) ratio: f64,
    /// Less is no reason.
    pub(super) worth: f64,
    /// What is sampled and loaded anew.
    pub(super) switch_s: f64,
}

impl Patience {
    pub(super) fn from(now: Duration) -> Self {
        Self { since: now, looked_at: now, better_in_a_row: 0, ready: BTreeSet::new() }
    }

    /// Whether it is time to look.
    pub(super) fn is_due(&self, now: Duration) -> bool {
        now.saturating_sub(self.looked_at) >= LOOK_APART
    }

    /// Notes what a look found; whether the plan is to be changed now.
    pub(super) fn is_over(&mut self, now: Duration, gain: Gain, nodes: usize) -> bool {
        self.looked_at = now;
        self.better_in_a_row = if gain.ratio > gain.worth { self.better_in_a_row + 1 } else { 0 };
        let lasted = now.saturating_sub(self.since);
        let settled = self.ready.len() >= nodes || lasted >= READY_WITHIN;
        settled && self.better_in_a_row >= LOOKS && lasted >= DWELL && repays(gain, lasted)
    }
}

/// Demand lasts about as long again as it has lasted: what the better plan saves in that time must repay the switch.
fn repays(gain: Gain, lasted: Duration) -> bool {
    (1.0 - gain.ratio.recip()) * lasted.as_secs_f64() >= gain.switch_s
}

#[cfg(test)]
mod tests {
    use super::*;

    const BETTER: Gain = Gain { ratio: 1.5, worth: 1.1, switch_s: 0.1 };

    fn looks(gains: impl Fn(u64) -> Gain) -> Option<u64> {
        let mut patience = Patience::from(Duration::ZERO);
        patience.ready.insert("a".to_owned());
        (1..100).find(|&i| {
            let now = Duration::from_millis(500 * i);
            assert!(patience.is_due(now) && !patience.is_due(now - Duration::from_millis(1)));
            patience.is_over(now, gains(i), 1)
        })
    }

    #[test]
    fn a_plan_dwells_and_three_looks_in_a_row_must_agree() {
        assert_eq!(looks(|_| BETTER), Some(10));
        assert_eq!(looks(|i| Gain { ratio: if i % 3 == 0 { 1.05 } else { 1.5 }, ..BETTER }), None);
        assert_eq!(looks(|i| Gain { ratio: if i < 20 { 1.0 } else { 1.5 }, ..BETTER }), Some(22));
    }

    #[test]
    fn a_dear_switch_is_made_when_as_much_time_has_passed_as_repays_it() {
        assert_eq!(looks(|_| Gain { switch_s: 5.0, ..BETTER }), Some(30), "a third of 15 s");
        assert_eq!(looks(|_| Gain { ratio: 1.0, switch_s: 0.0, ..BETTER }), None);
    }

    #[test]
    fn nodes_that_are_not_ready_are_waited_for_but_not_for_ever() {
        let mut patience = Patience::from(Duration::ZERO);
        let over = (1..100).find(|&i| patience.is_over(Duration::from_millis(500 * i), BETTER, 1));
        assert_eq!(over, Some(20));
    }
}
