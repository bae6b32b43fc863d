//! The visitors of a scene: who is there, and who moves.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use tokio::sync::watch;

/// Visitors are active for this time after their last move.
const ACTIVE_FOR: Duration = Duration::from_secs(10);

/// The visitors of a scene.
#[derive(Debug, Default)]
pub(crate) struct Visits {
    moves: Mutex<HashMap<u64, Instant>>,
    presence: watch::Sender<Presence>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Presence {
    visitors: usize,
    /// The end of the last visit.
    left: Option<Instant>,
}

/// A visit, which ends when it is dropped.
#[derive(Debug)]
pub(crate) struct Visit(Arc<Visits>);

impl Drop for Visit {
    fn drop(&mut self) {
        self.0.presence.send_modify(|presence| {
            presence.visitors -= 1;
            presence.left = Some(Instant::now());
        });
    }
}

impl Visits {
    /// Somebody comes: a page, or a request of HTTP.
    pub(crate) fn begin(self: &Arc<Self>) -> Visit {
        self.presence.send_modify(|presence| presence.visitors += 1);
        Visit(self.clone())
    }

    /// Waits until somebody is there.
    pub(crate) async fn somebody(&self) {
        // The sender lives as long as this.
        let _ = self.presence.subscribe().wait_for(|presence| presence.visitors > 0).await;
    }

    /// Whether nobody has been there for this time.
    pub(crate) fn is_left(&self, now: Instant, time: Duration) -> bool {
        let Presence { visitors, left } = *self.presence.borrow();
        visitors == 0 && left.is_none_or(|left| now.saturating_duration_since(left) > time)
    }

    pub(crate) fn moved(&self, visitor: u64, now: Instant) {
        self.moves.lock().insert(visitor, now);
    }

    pub(crate) fn left(&self, visitor: u64) {
        self.moves.lock().remove(&visitor);
    }

    /// Whether a page is there, which moves and sees pictures.
    pub(crate) fn has_pages(&self) -> bool {
        !self.moves.lock().is_empty()
    }

    /// Visitors who have moved lately.
    pub(crate) fn active(&self, now: Instant) -> usize {
        self.moves.lock().values().filter(|moved| now.saturating_duration_since(**moved) < ACTIVE_FOR).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visitors_count_while_they_move() {
        let visits = Visits::default();
        let start = Instant::now();
        visits.moved(1, start);
        visits.moved(2, start + ACTIVE_FOR / 2);
        assert_eq!(visits.active(start + ACTIVE_FOR / 2), 2);
        assert_eq!(visits.active(start + ACTIVE_FOR), 1);
        visits.left(2);
        assert_eq!((visits.active(start + ACTIVE_FOR), visits.has_pages()), (0, true));
        visits.left(1);
        assert!(!visits.has_pages());
    }

    #[tokio::test]
    async fn a_scene_is_left_a_while_after_its_last_visitor() {
        let visits = Arc::new(Visits::default());
        let minute = Duration::from_secs(60);
        assert!(visits.is_left(Instant::now(), minute));
        let visit = visits.begin();
        visits.somebody().await;
        assert!(!visits.is_left(Instant::now() + 2 * minute, minute));
        drop(visit);
        assert!(!visits.is_left(Instant::now(), minute));
        assert!(visits.is_left(Instant::now() + 2 * minute, minute));
    }
}
