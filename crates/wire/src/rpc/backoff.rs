//! Delays between attempts.

use std::time::Duration;

/// Delays between attempts that grow by a factor, up to a longest one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Backoff {
    first: Duration,
    factor: u32,
    longest: Duration,
    next: Duration,
}

impl Backoff {
    /// Begins with `first`; every delay is `factor` times the one before, and at most `longest`.
    #[must_use]
    pub const fn new(first: Duration, factor: u32, longest: Duration) -> Self {
        Self { first, factor, longest, next: first }
    }

    /// For a coordinator that cannot be reached: from 0.1 s to 1 s.
    #[must_use]
    pub const fn reconnect() -> Self {
        Self::new(Duration::from_millis(100), 2, Duration::from_secs(1))
    }

    /// The delay before the next attempt.
    #[must_use]
    pub fn next_delay(&mut self) -> Duration {
        let delay = self.next;
        self.next = (delay * self.factor).min(self.longest);
        delay
    }

    /// Begins again with the first delay: an attempt has succeeded.
    pub fn reset(&mut self) {
        self.next = self.first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_double_up_to_the_longest_and_begin_again_after_a_success() {
        let mut backoff = Backoff::reconnect();
        let delays_ms: Vec<u128> = (0..6).map(|_| backoff.next_delay().as_millis()).collect();
        assert_eq!(delays_ms, [100, 200, 400, 800, 1000, 1000]);
        backoff.reset();
        assert_eq!(backoff.next_delay().as_millis(), 100);
    }
}
