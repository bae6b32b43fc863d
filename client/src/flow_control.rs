//! The number of views that a client requests from one compositor at a time.

use std::ops::Range;

use cluster::limits::MAX_VIEWS_PER_REQUEST;

use crate::work_stealing::FEW_VIEWS;

/// Shorter messages show the network's delay; longer ones let a slow compositor delay the end of a batch.
const MESSAGE_S: Range<f64> = 0.1..0.4;
/// A message has at least [`FEW_VIEWS`], unless these take longer.
const FEW_VIEWS_S: f64 = 1.0;
/// Most views of a message before any have been received.
const MOST_FIRST_VIEWS: usize = 64;

/// Keeps two messages' worth of views requested from one compositor: one is made while the other waits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowControl {
    /// Views of the next message.
    message_views: usize,
    /// Views that are requested and have not been received.
    in_flight: usize,
    /// Begin of the current period of measuring.
    period_start_s: Option<f64>,
    /// Views received in the period.
    period_views: usize,
    /// Whether a view of the period waited for its sample set.
    has_waited_for_set: bool,
}

impl FlowControl {
    /// For a compositor that needs about `view_s` for a view; `None` where that is not known.
    #[must_use]
    pub fn new(view_s: Option<f64>) -> Self {
        let view_s = view_s.unwrap_or_default();
        let views = (MESSAGE_S.start + MESSAGE_S.end) / 2.0 / view_s;
        // A cast saturates: views that take no time give the largest message.
        let message_views = (views as usize).max(least_views(view_s)).min(MOST_FIRST_VIEWS);
        Self { message_views, in_flight: 0, period_start_s: None, period_views: 0, has_waited_for_set: false }
    }

    /// The size of the next message in views; `None` while enough views are in flight.
    #[must_use]
    pub fn room(&self) -> Option<usize> {
        (self.in_flight <= self.message_views).then_some(self.message_views)
    }

    /// Counts a message of `views` as sent.
    pub fn sent(&mut self, views: usize) {
        self.in_flight += views;
    }

    /// Whether no view is in flight.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.in_flight == 0
    }

    /// Counts a view as received. A view that waited for its sample set does not show the compositor's speed.
    pub fn received(&mut self, now_s: f64, waited_for_set: bool) {
        self.in_flight = self.in_flight.saturating_sub(1);
        self.period_views += 1;
        self.has_waited_for_set |= waited_for_set;
        let start_s = self.period_start_s.unwrap_or(f64::NEG_INFINITY);
        // Views of a batch of the device arrive together: a period lasts from the first of one to the first of another.
        if now_s - start_s >= MESSAGE_S.start {
            if start_s.is_finite() && !self.has_waited_for_set {
                self.adapt((now_s - start_s) / self.period_views.max(1) as f64);
            }
            (self.period_start_s, self.period_views, self.has_waited_for_set) = (Some(now_s), 0, false);
        }
    }

    fn adapt(&mut self, view_s: f64) {
        self.message_views = match view_s * self.message_views as f64 {
            message_s if message_s < MESSAGE_S.start => (2 * self.message_views).min(MAX_VIEWS_PER_REQUEST),
            message_s if message_s > MESSAGE_S.end => (self.message_views / 2).max(least_views(view_s)),
            _ => self.message_views,
        };
    }
}

/// The least views of a message, at `view_s` each.
fn least_views(view_s: f64) -> usize {
    ((FEW_VIEWS_S / view_s) as usize).clamp(1, FEW_VIEWS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_lasts_a_few_tenths_of_a_second_at_any_speed() {
        for (view_s, views) in [(1e-5, MAX_VIEWS_PER_REQUEST), (0.001, 128), (0.01, 16), (0.2, 5), (3.0, 1)] {
            for guess_s in [None, Some(1e-6), Some(view_s), Some(100.0)] {
                let (mut flow, mut now_s) = (FlowControl::new(guess_s), 0.0);
                let mut batches = 0;
                while batches < 40 || now_s < 10.0 {
                    batches += 1;
                    let message = flow.room().unwrap();
                    flow.sent(message);
                    now_s += message as f64 * view_s;
                    // A batch of the device.
                    (0..message).for_each(|_| flow.received(now_s, false));
                }
                let message_s = flow.message_views as f64 * view_s;
                assert!(
                    flow.message_views.abs_diff(views) <= 1 || MESSAGE_S.contains(&message_s),
                    "{view_s} {guess_s:?}: {flow:?}"
                );
            }
        }
    }

    #[test]
    fn two_messages_of_views_are_in_flight() {
        let mut flow = FlowControl::new(Some(0.02));
        assert_eq!((flow.room(), flow.is_empty()), (Some(12), true));
        (0..12).for_each(|_| flow.sent(1));
        assert_eq!(flow.room(), Some(12), "views count, not messages");
        flow.sent(12);
        assert_eq!(flow.room(), None);
        (1..=12).for_each(|view| flow.received(0.02 * f64::from(view), false));
        assert_eq!((flow.room(), flow.message_views), (Some(12), 12));
        (1..=12).for_each(|view| flow.received(60.0 + 0.02 * f64::from(view), true));
        assert_eq!((flow.message_views, flow.is_empty()), (12, true), "it was the samples that were late");
        flow.received(60.3, false);
        assert_eq!((flow.room(), flow.is_empty()), (Some(flow.message_views), true), "nobody asked for it");
    }
}
