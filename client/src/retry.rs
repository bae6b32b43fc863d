//! When frames are requested again after a fault, and when no more.

use std::time::{Duration, Instant};

use wire::rpc::Backoff;

/// The time without any frame after which a request fails: a host that is lost without a word is missed after 15 s.
pub(crate) const GIVE_UP_AFTER: Duration = Duration::from_secs(20);
/// The time that a later plan is waited for before compositors of the same plan are asked again.
const FIRST_DELAY: Duration = Duration::from_millis(50);
const LONGEST_DELAY: Duration = Duration::from_secs(1);

/// The retries of one request for frames.
#[derive(Debug)]
pub(crate) struct Retries {
    /// Frames that were missing at the last fault.
    missing: usize,
    /// The first fault since a frame was received.
    failing_since: Option<Instant>,
    backoff: Backoff,
}

impl Retries {
    pub(crate) fn new(missing: usize) -> Self {
        Self { missing, failing_since: None, backoff: Backoff::new(FIRST_DELAY, 2, LONGEST_DELAY) }
    }

    /// The delay before the next attempt; `None` where no frame has been received for too long.
    pub(crate) fn next_delay(&mut self, now: Instant, missing: usize) -> Option<Duration> {
        if missing < self.missing {
            *self = Self::new(missing);
        }
        let (since, delay) = (*self.failing_since.get_or_insert(now), self.backoff.next_delay());
        (now.saturating_duration_since(since) < GIVE_UP_AFTER).then_some(delay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retries_end_where_no_frame_is_received() {
        let mut retries = Retries::new(9);
        let start = Instant::now();
        let at = |s: u64| start + Duration::from_secs(s);
        assert_eq!(retries.next_delay(at(1), 9), Some(FIRST_DELAY));
        assert_eq!(retries.next_delay(at(2), 9), Some(2 * FIRST_DELAY));
        assert_eq!(retries.next_delay(at(18), 8), Some(FIRST_DELAY), "one frame was received");
        assert_eq!(retries.next_delay(at(37), 8), Some(2 * FIRST_DELAY));
        assert_eq!(retries.next_delay(at(39), 8), None);
        let delays: Vec<_> = (0..9).map(|_| retries.next_delay(start, 8)).collect();
        assert_eq!(delays[8], Some(LONGEST_DELAY));
    }
}
