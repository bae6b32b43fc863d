//! The number of views that a client requests from one compositor at a time.

use std::ops::Range;

use cluster::limits::MAX_VIEWS_PER_REQUEST;

/// The time of a message. Shorter ones show the network's delay; longer ones let a slow compositor delay the end of a batch.
const MESSAGE_S: Range<f64> = 0.1..0.4;
/// A message has at least so many views, unless they take longer than a second: a call to the device costs more than a view.
const FEW_VIEWS: f64 = 8.0;
const FEW_VIEWS_S: f64 = 1.0;
/// Most views of a message before any have been received.
const MOST_FIRST_VIEWS: usize = 64;

/// The pace of one compositor, by what it has delivered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pace {
    /// Most views of the next message.
    pub(crate) message_views: usize,
    /// Begin of the current period of measuring.
    period_start_s: Option<f64>,
    /// Views received in the period.
    period_views: usize,
    /// Whether a view of the period waited for its sample set.
    has_waited_for_set: bool,
}

impl Pace {
    /// The pace of a compositor that is expected to need `view_s` for a view.
    pub(crate) fn new(view_s: f64) -> Self {
        let views = (MESSAGE_S.start + MESSAGE_S.end) / 2.0 / view_s;
        // A cast saturates: views that take no time give the largest message.
        let message_views = (views as usize).max(least_views(view_s)).min(MOST_FIRST_VIEWS);
        Self { message_views, period_start_s: None, period_views: 0, has_waited_for_set: false }
    }

    /// Counts a view as received. A view that waited for its sample set does not show the compositor's speed.
    pub(crate) fn received(&mut self, now_s: f64, waited_for_set: bool) {
        self.period_views += 1;
        self.has_waited_for_set |= waited_for_set;
        let period_s = self.period_start_s.map(|start_s| now_s - start_s);
        // Views of a batch of the device arrive together: a period lasts from the first of one to the first of another.
        if period_s.is_some_and(|period_s| period_s < MESSAGE_S.start) {
            return;
        }
        if let Some(period_s) = period_s.filter(|_| !self.has_waited_for_set) {
            self.adapt(period_s / self.period_views as f64);
        }
        *self = Self { period_start_s: Some(now_s), period_views: 0, has_waited_for_set: false, ..*self };
    }

    fn adapt(&mut self, view_s: f64) {
        let message_s = view_s * self.message_views as f64;
        if message_s < MESSAGE_S.start {
            self.message_views = (2 * self.message_views).min(MAX_VIEWS_PER_REQUEST);
        } else if message_s > MESSAGE_S.end {
            self.message_views = (self.message_views / 2).max(least_views(view_s));
        }
    }
}

/// The least views of a message, at `view_s` each.
fn least_views(view_s: f64) -> usize {
    (FEW_VIEWS_S / view_s).clamp(1.0, FEW_VIEWS) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_lasts_a_few_tenths_of_a_second_at_any_speed() {
        for (view_s, views) in [(1e-5, MAX_VIEWS_PER_REQUEST), (0.001, 128), (0.01, 16), (0.2, 5), (3.0, 1)] {
            for guess_s in [0.0, 1e-6, view_s, 100.0] {
                let mut pace = Pace::new(guess_s);
                let mut now_s = 0.0;
                let mut batches = 0;
                while batches < 40 || now_s < 10.0 {
                    batches += 1;
                    let message = pace.message_views;
                    now_s += message as f64 * view_s;
                    // A batch of the device.
                    (0..message).for_each(|_| pace.received(now_s, false));
                }
                let message_views = pace.message_views;
                let is_in_time = MESSAGE_S.contains(&(message_views as f64 * view_s));
                assert!(message_views.abs_diff(views) <= 1 || is_in_time, "{view_s} {guess_s}: {message_views}");
            }
        }
    }

    #[test]
    fn a_view_that_waited_for_its_set_changes_nothing() {
        let mut pace = Pace::new(0.02);
        (1..=12).for_each(|view| pace.received(0.02 * f64::from(view), false));
        assert_eq!(pace.message_views, 12);
        (1..=12).for_each(|view| pace.received(60.0 + 0.02 * f64::from(view), true));
        assert_eq!(pace.message_views, 12, "the samples were late");
    }
}
