//! The visitors of a scene, and how many of them move.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

/// Visitors are active for this time after their last move.
const ACTIVE_FOR: Duration = Duration::from_secs(10);

/// The last moves of a scene's visitors.
#[derive(Debug, Default)]
pub(crate) struct Visits(Mutex<HashMap<u64, Instant>>);

impl Visits {
    pub(crate) fn moved(&self, visitor: u64, now: Instant) {
        self.0.lock().insert(visitor, now);
    }

    pub(crate) fn left(&self, visitor: u64) {
        self.0.lock().remove(&visitor);
    }

    /// Visitors who have moved lately.
    pub(crate) fn active(&self, now: Instant) -> usize {
        self.0.lock().values().filter(|moved| now.saturating_duration_since(**moved) < ACTIVE_FOR).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visitors_count_while_they_move() {
        let (visits, start) = (Visits::default(), Instant::now());
        visits.moved(1, start);
        visits.moved(2, start + ACTIVE_FOR / 2);
        assert_eq!(visits.active(start + ACTIVE_FOR / 2), 2);
        assert_eq!(visits.active(start + ACTIVE_FOR), 1);
        visits.left(2);
        assert_eq!(visits.active(start + ACTIVE_FOR), 0);
    }
}
