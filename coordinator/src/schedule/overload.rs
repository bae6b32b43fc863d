//! Overload control: when sessions fall back to a lower quality, and when they return. One fallback at a time, in the
//! order in which the session gave them.

use std::time::Duration;

/// Frames begin to wait above this utilisation.
pub(super) const FULL: f64 = 0.95;
/// A step up is taken where its predicted utilisation is below this.
const ROOMY: f64 = 0.75;
/// Samples in a row that must agree before a step down, and before a step up.
const CONFIRMATIONS_DOWN: u32 = 3;
const CONFIRMATIONS_UP: u32 = 20;
/// Timings of a new plan come in for this long before they are judged.
const SETTLE: Duration = Duration::from_secs(5);
/// Time until a trial of the step above while this step has room, since another program may have caused its cost. It
/// doubles each time that a trial fails within it.
const FIRST_TRIAL: Duration = Duration::from_secs(30);
const LAST_TRIAL: Duration = Duration::from_secs(480);

/// The present step down the fallbacks, and what was seen at each.
#[derive(Debug, Clone, Default)]
pub(super) struct Overload {
    /// 0: the quality that was asked for.
    pub(super) step: usize,
    full_in_a_row: u32,
    roomy_in_a_row: u32,
    changed_at: Duration,
    /// Utilisation by one view a second, when each step was left.
    view_utilisation_when_left: Vec<f64>,
    /// The same when this step had settled.
    settled_view_utilisation: Option<f64>,
    /// Since when this step has been roomy.
    roomy_since: Option<Duration>,
    /// The last trial of the step above, and the trials in a row that failed.
    tried_at: Option<Duration>,
    failed_trials: u32,
}

/// One sample of the nodes' utilisation.
#[derive(Debug, Clone, Copy)]
pub(super) struct UtilizationSample<'a> {
    /// Share of the nodes' time, at this step.
    pub(super) utilisation: f64,
    /// Views that sessions ask for, undegraded.
    pub(super) views_per_s: f64,
    /// Pictures a second over those asked for, by fallback.
    pub(super) frame_rate_ratios: &'a [f64],
}

impl UtilizationSample<'_> {
    fn rate(&self, step: usize) -> f64 {
        let ratio = step.checked_sub(1).and_then(|i| self.frame_rate_ratios.get(i));
        self.views_per_s * ratio.copied().unwrap_or(1.0)
    }
}

impl Overload {
    /// Adds a sample; whether the step has changed.
    pub(super) fn add(&mut self, now: Duration, sample: UtilizationSample<'_>) -> bool {
        let has_settled = now.saturating_sub(self.changed_at) >= SETTLE;
        if !has_settled || sample.views_per_s <= 0.0 {
            return false;
        }
        let view_utilisation = sample.utilisation / sample.rate(self.step);
        let settled_view = *self.settled_view_utilisation.get_or_insert(view_utilisation);
        self.count(sample, view_utilisation / settled_view);
        if self.full_in_a_row >= CONFIRMATIONS_DOWN && self.step < sample.frame_rate_ratios.len() {
            self.view_utilisation_when_left.push(view_utilisation);
            // A step that is left soon after it was tried is a trial that failed.
            let failed = self.tried_at.is_some_and(|tried_at| now.saturating_sub(tried_at) < self.trial_after());
            self.failed_trials = if failed { self.failed_trials + 1 } else { 0 };
            self.change(now, self.step + 1);
            return true;
        }
        self.roomy_since = (sample.utilisation < ROOMY).then(|| self.roomy_since.unwrap_or(now));
        let is_trial_due =
            self.step > 0 && self.roomy_since.is_some_and(|since| now.saturating_sub(since) >= self.trial_after());
        if self.roomy_in_a_row >= CONFIRMATIONS_UP || is_trial_due {
            self.tried_at = Some(now);
            self.view_utilisation_when_left.pop();
            self.change(now, self.step - 1);
            return true;
        }
        false
    }

    /// Begins at a step, with the utilisation by one view a second that is predicted for each step above.
    pub(super) fn begin_at(&mut self, now: Duration, step: usize, view_utilisation_when_left: Vec<f64>) {
        self.view_utilisation_when_left = view_utilisation_when_left;
        self.change(now, step);
    }

    /// Sessions have come or gone, and accept no more than `fallbacks` any more.
    pub(super) fn limit(&mut self, now: Duration, fallbacks: usize) {
        if self.step > fallbacks {
            self.view_utilisation_when_left.truncate(fallbacks);
            self.change(now, fallbacks);
        }
    }

    /// The utilisation by one view a second when a step above the present one was left.
    pub(super) fn view_utilisation_when_left(&self, step: usize) -> Option<f64> {
        self.view_utilisation_when_left.get(step).copied()
    }

    fn count(&mut self, sample: UtilizationSample<'_>, slower: f64) {
        let full = sample.utilisation > FULL;
        self.full_in_a_row = if full { self.full_in_a_row + 1 } else { 0 };
        // One step up costs as much as when it was left, times how nodes have changed since.
        let when_left = self.view_utilisation_when_left.last();
        let roomy = when_left.is_some_and(|when_left| when_left * slower * sample.rate(self.step - 1) < ROOMY);
        self.roomy_in_a_row = if roomy { self.roomy_in_a_row + 1 } else { 0 };
    }

    fn trial_after(&self) -> Duration {
        FIRST_TRIAL.saturating_mul(1 << self.failed_trials.min(8)).min(LAST_TRIAL)
    }

    fn change(&mut self, now: Duration, step: usize) {
        (self.step, self.changed_at, self.settled_view_utilisation, self.roomy_since) = (step, now, None, None);
        (self.full_in_a_row, self.roomy_in_a_row) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATIOS: [f64; 3] = [1.0, 1.0, 0.5];
    /// Utilisation by one view a second, at each step.
    const VIEW_UTILISATION: [f64; 4] = [0.02, 0.015, 0.01, 0.01];

    /// Samples utilisation twice a second for `for_s`; the steps that were taken.
    fn steps(overload: &mut Overload, from_s: u64, for_s: u64, views_per_s: f64, nodes_slower: f64) -> Vec<usize> {
        let mut taken = Vec::new();
        for tick in from_s * 2..(from_s + for_s) * 2 {
            let now = Duration::from_millis(tick * 500);
            let step = overload.step;
            let ratio = if step == 0 { 1.0 } else { RATIOS[step - 1] };
            let utilisation = VIEW_UTILISATION[step] * nodes_slower * views_per_s * ratio;
            if overload.add(now, UtilizationSample { utilisation, views_per_s, frame_rate_ratios: &RATIOS }) {
                taken.push(overload.step);
            }
        }
        taken
    }

    #[test]
    fn overload_steps_down_in_order_and_returns_when_demand_falls() {
        let mut overload = Overload::default();
        assert_eq!(steps(&mut overload, 0, 100, 40.0, 1.0), [] as [usize; 0], "0.8 of the time");
        assert_eq!(steps(&mut overload, 100, 100, 80.0, 1.0), [1, 2], "1.6, then 1.2, then 0.8");
        assert_eq!(steps(&mut overload, 200, 25, 60.0, 1.0), [] as [usize; 0], "one step up would take 0.9");
        assert_eq!(steps(&mut overload, 225, 25, 40.0, 1.0), [1], "0.6 one step up, 0.8 two");
        assert_eq!(steps(&mut overload, 250, 25, 20.0, 1.0), [0]);
    }

    #[test]
    fn a_load_by_another_program_is_followed_by_a_return() {
        let mut overload = Overload::default();
        assert_eq!(steps(&mut overload, 0, 50, 40.0, 1.0), [] as [usize; 0]);
        assert_eq!(steps(&mut overload, 50, 9, 40.0, 2.2), [1, 2], "1.76, 1.32, and then it is over");
        assert_eq!(steps(&mut overload, 59, 100, 40.0, 1.0), [1, 0], "0.4, 0.6, 0.8: after half a minute each");
        assert_eq!(steps(&mut overload, 159, 1000, 40.0, 1.0), [] as [usize; 0]);
    }

    #[test]
    fn a_step_that_stays_overloaded_is_tried_ever_less_often() {
        let mut overload = Overload::default();
        assert_eq!(steps(&mut overload, 0, 20, 70.0, 1.0), [1, 2], "1.4, 1.05, 0.7");
        assert_eq!(steps(&mut overload, 20, 1000, 70.0, 1.0), [[1, 2]; 5].concat(), "30, 60, 120, 240, 480 s apart");
    }

    #[test]
    fn overload_stops_at_the_last_fallback() {
        let mut overload = Overload::default();
        assert_eq!(steps(&mut overload, 0, 200, 500.0, 1.0), [1, 2, 3]);
    }

    #[test]
    fn nodes_that_slow_down_and_recover_are_followed_both_ways() {
        let mut overload = Overload::default();
        assert_eq!(steps(&mut overload, 0, 50, 40.0, 1.0), [] as [usize; 0]);
        assert_eq!(steps(&mut overload, 50, 50, 40.0, 1.5), [1], "1.2, then 0.9");
        assert_eq!(steps(&mut overload, 100, 50, 40.0, 0.75), [0], "0.6 by now");
    }

    #[test]
    fn sessions_without_a_rate_cause_no_overload() {
        let mut overload = Overload::default();
        assert_eq!(steps(&mut overload, 0, 50, 0.0, 1.0), [] as [usize; 0]);
    }
}
