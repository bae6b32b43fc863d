//! Compositors that failed lately are passed over for a while.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

/// The time that a compositor is passed over after a failure, where there are others.
const OPEN_FOR: Duration = Duration::from_secs(10);

/// The circuit breaker of one compositor; clones share it.
#[derive(Debug, Clone, Default)]
pub(crate) struct CircuitBreaker(Arc<Mutex<Option<Instant>>>);

impl CircuitBreaker {
    /// The compositor has failed.
    pub(crate) fn trip(&self) {
        *self.0.lock() = Some(Instant::now());
    }

    /// Whether the compositor is to be passed over.
    pub(crate) fn is_open(&self) -> bool {
        self.0.lock().is_some_and(|failed| failed.elapsed() < OPEN_FOR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_breaker_opens_on_failure_and_closes_after_a_while() {
        let breaker = CircuitBreaker::default();
        assert!(!breaker.is_open());
        breaker.clone().trip();
        assert!(breaker.is_open());
        *breaker.0.lock() = Instant::now().checked_sub(OPEN_FOR);
        assert!(!breaker.is_open());
    }
}
