//! How long, and of whom, frames are asked again after a fault.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long nothing may come: a host that is lost without a word is missed after 15 s.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);
/// How long another plan is waited for before this one's compositors are asked again.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
const LAST_PAUSE: Duration = Duration::from_secs(1);
/// How long a compositor that failed is passed over where there are others.
const SUSPECTED: Duration = Duration::from_secs(10);

/// Of one request for frames.
#[derive(Debug)]
pub(crate) struct Trouble {
    /// Frames that had not come at the last fault.
    due: usize,
    /// When asking for them failed first, since any came.
    since: Option<Instant>,
    pause: Duration,
}

impl Trouble {
    pub(crate) fn new(due: usize) -> Self {
        Self { due, since: None, pause: FIRST_PAUSE }
    }

    /// What to wait before the next attempt; `None` where nothing has come for too long.
    pub(crate) fn pause(&mut self, due: usize) -> Option<Duration> {
        self.pause_at(Instant::now(), due)
    }

    fn pause_at(&mut self, now: Instant, due: usize) -> Option<Duration> {
        if due < self.due {
            *self = Self::new(due);
        }
        let (since, pause) = (*self.since.get_or_insert(now), self.pause);
        self.pause = (2 * pause).min(LAST_PAUSE);
        (now.saturating_duration_since(since) < PATIENCE).then_some(pause)
    }
}

/// When a compositor last failed. Clones are of the same compositor.
#[derive(Debug, Clone, Default)]
pub(crate) struct Suspicion(Arc<Mutex<Option<Instant>>>);

impl Suspicion {
    pub(crate) fn raise(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
    }

    pub(crate) fn holds(&self) -> bool {
        let failed = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        failed.is_some_and(|failed| failed.elapsed() < SUSPECTED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_ends_where_nothing_comes() {
        let mut trouble = Trouble::new(9);
        let start = Instant::now();
        let at = |s: u64| start + Duration::from_secs(s);
        assert_eq!(trouble.pause_at(at(1), 9), Some(FIRST_PAUSE));
        assert_eq!(trouble.pause_at(at(2), 9), Some(2 * FIRST_PAUSE));
        assert_eq!(trouble.pause_at(at(18), 8), Some(FIRST_PAUSE), "one came");
        assert_eq!(trouble.pause_at(at(37), 8), Some(2 * FIRST_PAUSE));
        assert_eq!(trouble.pause_at(at(39), 8), None);
        let pauses: Vec<_> = (0..9).map(|_| trouble.pause_at(start, 8)).collect();
        assert_eq!(pauses[8], Some(LAST_PAUSE));
    }

    #[test]
    fn a_compositor_that_fails_is_suspected_for_a_while() {
        let suspicion = Suspicion::default();
        assert!(!suspicion.holds());
        suspicion.clone().raise();
        assert!(suspicion.holds());
        let long_ago = Instant::now().checked_sub(SUSPECTED);
        *suspicion.0.lock().unwrap() = long_ago;
        assert!(!suspicion.holds());
    }
}
