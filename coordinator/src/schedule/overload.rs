//! When sessions make do with less, and when they get more again: one fallback at a time, in the order they were given.

use std::time::Duration;

/// Above this share of the nodes' time frames begin to wait.
const FULL: f64 = 0.95;
/// What was left is taken up again where it would leave so much room.
const ROOMY: f64 = 0.75;
/// Looks in a row that must agree before less is done, and before more is.
const LOOKS_DOWN: u32 = 3;
const LOOKS_UP: u32 = 20;
/// Timings of a new plan come in for so long before they are judged.
const SETTLE: Duration = Duration::from_secs(5);
/// What a step cost when it was left may have been somebody else's doing: where there is room at this step, the one above is
/// tried after so long, and after twice as long each time that it has to be left again within as long.
const FIRST_TRIAL: Duration = Duration::from_secs(30);
const LAST_TRIAL: Duration = Duration::from_secs(480);

/// How far down the fallbacks it has come.
#[derive(Debug, Clone, Default)]
pub(super) struct Overload {
    /// 0: all that was asked for.
    pub(super) step: usize,
    full_in_a_row: u32,
    roomy_in_a_row: u32,
    changed_at: Duration,
    /// The nodes' time for one view a second, when each step was left.
    left_at: Vec<f64>,
    /// The same when this step had settled.
    settled_at: Option<f64>,
    /// Since when there has been room at this step.
    room_since: Option<Duration>,
    /// When the step above was tried last, and how often in a row it had to be left again.
    tried_at: Option<Duration>,
    failed_trials: u32,
}

/// What a look sees.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look<'a> {
    /// Share of the nodes' time, at this step.
    pub(super) utilisation: f64,
    /// That sessions ask for, undegraded.
    pub(super) views_per_s: f64,
    /// Pictures a second of those asked for, by fallback.
    pub(super) frame_rate_ratios: &'a [f64],
}

impl Look<'_> {
    fn rate(&self, step: usize) -> f64 {
        let ratio = step.checked_sub(1).and_then(|i| self.frame_rate_ratios.get(i));
        self.views_per_s * ratio.copied().unwrap_or(1.0)
    }
}

impl Overload {
    /// Whether the step has changed. To be asked at every look.
    pub(super) fn judge(&mut self, now: Duration, look: Look<'_>) -> bool {
        let settled = now.saturating_sub(self.changed_at) >= SETTLE;
        if !settled || look.views_per_s <= 0.0 {
            return false;
        }
        let a_view = look.utilisation / look.rate(self.step);
        let began = *self.settled_at.get_or_insert(a_view);
        self.count(look, a_view / began);
        if self.full_in_a_row >= LOOKS_DOWN && self.step < look.frame_rate_ratios.len() {
            self.left_at.push(a_view);
            self.judge_trial(now);
            self.change(now, self.step + 1);
            return true;
        }
        self.room_since = (look.utilisation < ROOMY).then(|| self.room_since.unwrap_or(now));
        if self.roomy_in_a_row >= LOOKS_UP || self.is_time_to_try(now) {
            self.tried_at = Some(now);
            self.left_at.pop();
            self.change(now, self.step - 1);
            return true;
        }
        false
    }

    fn count(&mut self, look: Look<'_>, slower: f64) {
        let full = look.utilisation > FULL;
        self.full_in_a_row = if full { self.full_in_a_row + 1 } else { 0 };
        // One step up costs what it did when it was left, times how nodes have changed since.
        let above = self.left_at.last().map(|a_view| a_view * slower * look.rate(self.step - 1));
        let roomy = above.is_some_and(|utilisation| utilisation < ROOMY);
        self.roomy_in_a_row = if roomy { self.roomy_in_a_row + 1 } else { 0 };
    }

    fn trial_after(&self) -> Duration {
        FIRST_TRIAL.saturating_mul(1 << self.failed_trials.min(8)).min(LAST_TRIAL)
    }

    fn is_time_to_try(&self, now: Duration) -> bool {
        self.step > 0 && self.room_since.is_some_and(|since| now.saturating_sub(since) >= self.trial_after())
    }

    /// When a step is left: whether it was a trial that failed.
    fn judge_trial(&mut self, now: Duration) {
        let failed = self.tried_at.is_some_and(|tried_at| now.saturating_sub(tried_at) < self.trial_after());
        self.failed_trials = if failed { self.failed_trials + 1 } else { 0 };
    }

    fn change(&mut self, now: Duration, step: usize) {
        (self.step, self.changed_at, self.settled_at, self.room_since) = (step, now, None, None);
        (self.full_in_a_row, self.roomy_in_a_row) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATIOS: [f64; 3] = [1.0, 1.0, 0.5];
    /// The nodes' time for one view a second, at each step.
    const A_VIEW: [f64; 4] = [0.02, 0.015, 0.01, 0.01];

    /// Looks twice a second for so long; the steps that were gone to.
    fn looks(overload: &mut Overload, from_s: u64, for_s: u64, views_per_s: f64, nodes_slower: f64) -> Vec<usize> {
        let mut steps = Vec::new();
        for tick in from_s * 2..(from_s + for_s) * 2 {
            let (now, step) = (Duration::from_millis(tick * 500), overload.step);
            let ratio = if step == 0 { 1.0 } else { RATIOS[step - 1] };
            let utilisation = A_VIEW[step] * nodes_slower * views_per_s * ratio;
            if overload.judge(now, Look { utilisation, views_per_s, frame_rate_ratios: &RATIOS }) {
                steps.push(overload.step);
            }
        }
        steps
    }

    #[test]
    fn it_goes_down_in_order_as_far_as_it_must_and_comes_back() {
        let mut overload = Overload::default();
        assert_eq!(looks(&mut overload, 0, 100, 40.0, 1.0), [] as [usize; 0], "0.8 of the time");
        assert_eq!(looks(&mut overload, 100, 100, 80.0, 1.0), [1, 2], "1.6, then 1.2, then 0.8");
        assert_eq!(looks(&mut overload, 200, 25, 60.0, 1.0), [] as [usize; 0], "one step up would take 0.9");
        assert_eq!(looks(&mut overload, 225, 25, 40.0, 1.0), [1], "0.6 one step up, 0.8 two");
        assert_eq!(looks(&mut overload, 250, 25, 20.0, 1.0), [0]);
    }

    #[test]
    fn what_others_took_for_a_while_is_taken_up_again() {
        let mut overload = Overload::default();
        assert_eq!(looks(&mut overload, 0, 50, 40.0, 1.0), [] as [usize; 0]);
        assert_eq!(looks(&mut overload, 50, 9, 40.0, 2.2), [1, 2], "1.76, 1.32, and then it is over");
        assert_eq!(looks(&mut overload, 59, 100, 40.0, 1.0), [1, 0], "0.4, 0.6, 0.8: after half a minute each");
        assert_eq!(looks(&mut overload, 159, 1000, 40.0, 1.0), [] as [usize; 0]);
    }

    #[test]
    fn what_is_too_much_is_tried_ever_less_often() {
        let mut overload = Overload::default();
        assert_eq!(looks(&mut overload, 0, 20, 70.0, 1.0), [1, 2], "1.4, 1.05, 0.7");
        assert_eq!(looks(&mut overload, 20, 1000, 70.0, 1.0), [[1, 2]; 5].concat(), "30, 60, 120, 240, 480 s apart");
    }

    #[test]
    fn it_goes_no_further_than_there_are_fallbacks() {
        let mut overload = Overload::default();
        assert_eq!(looks(&mut overload, 0, 200, 500.0, 1.0), [1, 2, 3]);
    }

    #[test]
    fn nodes_that_slow_down_bring_it_down_and_do_not_hold_it_there() {
        let mut overload = Overload::default();
        assert_eq!(looks(&mut overload, 0, 50, 40.0, 1.0), [] as [usize; 0]);
        assert_eq!(looks(&mut overload, 50, 50, 40.0, 1.5), [1], "1.2, then 0.9");
        assert_eq!(looks(&mut overload, 100, 50, 40.0, 0.75), [0], "0.6 by now");
    }

    #[test]
    fn sessions_without_a_rate_are_never_too_many() {
        let mut overload = Overload::default();
        assert_eq!(looks(&mut overload, 0, 50, 0.0, 1.0), [] as [usize; 0]);
    }
}
