//! Noisy timings, smoothed.

use std::collections::VecDeque;

/// Timings of which the median is taken.
const MEDIAN_OF: usize = 5;
/// Weight of a new median in the moving average.
const ALPHA: f64 = 0.2;

/// The median of the last timings, then a moving average of the medians.
#[derive(Debug, Clone, Default)]
pub(super) struct Smoothed {
    last: VecDeque<f64>,
    value: Option<f64>,
}

impl Smoothed {
    pub(super) fn starting_at(value: f64) -> Self {
        Self { value: Some(value), ..Self::default() }
    }

    /// Non-finite and negative timings are ignored.
    pub(super) fn add(&mut self, timing: Option<f64>) {
        let Some(timing) = timing.filter(|timing| is_valid(*timing)) else { return };
        self.last.truncate(MEDIAN_OF - 1);
        self.last.push_front(timing);
        let median = median(self.last.iter().copied()).unwrap_or(timing);
        self.value = Some(self.value.map_or(median, |value| value + ALPHA * (median - value)));
    }

    /// Forgets all timings: the next one is the value.
    pub(super) fn restart(&mut self) {
        (self.last, self.value) = (VecDeque::new(), None);
    }

    /// All timings were of work that takes `times` times as long now.
    pub(super) fn scale(&mut self, times: f64) {
        self.last.iter_mut().chain(&mut self.value).for_each(|timing| *timing *= times);
    }

    /// Another expected value, while there is no timing.
    pub(super) fn expect(&mut self, value: f64) {
        if self.last.is_empty() {
            self.value = self.value.map(|_| value);
        }
    }

    pub(super) fn value(&self) -> Option<f64> {
        self.value
    }

    pub(super) fn has_timings(&self) -> bool {
        !self.last.is_empty()
    }
}

pub(super) fn is_valid(timing: f64) -> bool {
    timing.is_finite() && timing >= 0.0
}

/// The median; the lower one of an even number of timings, since the first may include the building of shaders.
pub(super) fn median(timings: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = timings.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) / 2).copied()
}

pub(super) fn geometric_mean(ratios: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = ratios.fold((0.0, 0.0), |(sum, count), ratio| (sum + ratio.ln(), count + 1.0));
    (count > 0.0).then(|| (sum / count).exp())
}
