//! A still in parts: a pose ends it, and even a slow link is soon free for pictures in motion.

use std::collections::VecDeque;
use std::time::Instant;

use bytes::Bytes;

/// The bytes of a part.
const PART_BYTES: usize = 16 << 10;
/// The least and the greatest number of parts on their way.
const WINDOW: [usize; 2] = [2, 64];
/// The most at the beginning of a still: the link may have become slower since the last one.
const FIRST_WINDOW: usize = 4;
/// A part that takes longer than the round trip by this time waits for others.
const QUEUED_S: f64 = 0.1;

/// The parts of a page's stills.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    /// The bytes that were not sent.
    rest: Bytes,
    /// The times of parts that the page has not received.
    sent: VecDeque<Instant>,
    /// The most parts on their way.
    window: usize,
}

impl Parts {
    /// The first part of a still's message, with its header.
    pub(crate) fn begin(&mut self, mut message: Bytes, now: Instant) -> Bytes {
        let first = message.split_to(message.len().min(PART_BYTES));
        self.rest = message;
        self.window = self.window.clamp(WINDOW[0], FIRST_WINDOW);
        if !self.rest.is_empty() {
            self.sent.push_back(now);
        }
        first
    }

    /// The next part, where the link has room for one.
    pub(crate) fn next(&mut self, now: Instant) -> Option<Bytes> {
        if self.rest.is_empty() || self.sent.len() >= self.window {
            return None;
        }
        let part = self.rest.split_to(self.rest.len().min(PART_BYTES));
        // The page answers every part but the last.
        if !self.rest.is_empty() {
            self.sent.push_back(now);
        }
        Some(part)
    }

    /// The page has received a part; false where none was due.
    pub(crate) fn received(&mut self, now: Instant, rtt_s: f64) -> bool {
        let Some(sent) = self.sent.pop_front() else { return false };
        let is_late = now.duration_since(sent).as_secs_f64() > rtt_s + QUEUED_S;
        let [least, most] = WINDOW;
        self.window = if is_late { self.window - 1 } else { self.window + 1 }.clamp(least, most);
        true
    }

    /// What was not sent is of no use any more.
    pub(crate) fn end(&mut self) {
        self.rest.clear();
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// Sends a still of this size over a link. Returns the seconds until the page has it, and the greatest number of bytes
    /// that waited for the link.
    fn sent_over(bytes: usize, bytes_per_s: f64, rtt_s: f64) -> (f64, usize) {
        let mut parts = Parts::default();
        let start = Instant::now();
        let at = |s: f64| start + Duration::from_secs_f64(s);
        let first = parts.begin(Bytes::from(vec![0; bytes]), start);
        let mut arrivals = VecDeque::new();
        let mut most = 0;
        let mut left = bytes - first.len();
        let mut free_s = first.len() as f64 / bytes_per_s;
        let mut now_s = 0.0;
        arrivals.push_back(free_s);
        while let Some(arrival) = arrivals.pop_front() {
            now_s = arrival + rtt_s;
            if left == 0 && arrivals.is_empty() {
                break;
            }
            assert!(parts.received(at(now_s), rtt_s));
            while let Some(part) = parts.next(at(now_s)) {
                left -= part.len();
                free_s = f64::max(free_s, now_s) + part.len() as f64 / bytes_per_s;
                arrivals.push_back(free_s);
            }
            most = most.max(((free_s - now_s) * bytes_per_s) as usize);
        }
        assert_eq!(left, 0);
        (now_s, most)
    }

    #[test]
    fn a_slow_link_holds_two_parts_and_a_fast_one_is_used() {
        let slow = 125e3;
        let (seconds, waiting) = sent_over(1 << 20, slow, 0.08);
        assert!(seconds < 1.15 * f64::from(1 << 20) / slow, "{seconds} s");
        assert!(waiting <= 2 * PART_BYTES, "{waiting} bytes wait");
        let (seconds, _) = sent_over(4 << 20, 125e5, 0.08);
        assert!(seconds < 1.5, "{seconds} s for 4 MiB over 100 Mbit/s");
        assert!(sent_over(4 << 20, 1e9, 0.001).0 < 0.2);
    }

    #[test]
    fn parts_are_the_whole_and_a_pose_ends_them() {
        let mut parts = Parts::default();
        let now = Instant::now();
        let message: Bytes = (0..100_000_u32).map(|i| i as u8).collect();
        let mut all = parts.begin(message.clone(), now).to_vec();
        while !parts.rest.is_empty() {
            while let Some(part) = parts.next(now) {
                all.extend(part);
            }
            let _ = parts.received(now, 0.0);
        }
        assert!(all == message);
        while parts.received(now, 0.0) {}
        assert_eq!(parts.begin(message.slice(..50), now).len(), 50);
        assert!(!parts.received(now, 0.0), "a still of one part is not answered");
        parts.begin(message, now);
        assert!(std::iter::from_fn(|| parts.next(now)).count() < FIRST_WINDOW);
        parts.end();
        assert!(parts.next(now).is_none() && parts.received(now, 0.0));
    }
}
