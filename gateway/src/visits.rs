//! The visitors of a scene: who is there, and who moves.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::watch;

/// Visitors are active for this time after their last move.
const ACTIVE_FOR: Duration = Duration::from_secs(10);

/// The visitors of a scene.
#[derive(Debug, Default)]
pub(crate) struct Visits(watch::Sender<Presence>);

#[derive(Debug, Default)]
struct Presence {
    /// The last move of each visit: pages move and see pictures, requests of HTTP do not.
    moves: HashMap<u64, Option<Instant>>,
    last_number: u64,
    /// The end of the last visit.
    left: Option<Instant>,
}

/// A visit, which ends when it is dropped.
#[derive(Debug)]
pub(crate) struct Visit {
    visits: Arc<Visits>,
    number: u64,
}

impl Drop for Visit {
    fn drop(&mut self) {
        self.visits.0.send_modify(|presence| {
            presence.moves.remove(&self.number);
            presence.left = Some(Instant::now());
        });
    }
}

impl Visit {
    /// The visitor moves.
    pub(crate) fn moved(&self, now: Instant) {
        self.visits.0.send_modify(|presence| {
            presence.moves.insert(self.number, Some(now));
        });
    }
}

impl Visits {
    /// Somebody comes: a page, or a request of HTTP.
    pub(crate) fn begin(self: &Arc<Self>) -> Visit {
        let mut number = 0;
        self.0.send_modify(|presence| {
            presence.last_number += 1;
            number = presence.last_number;
            presence.moves.insert(number, None);
        });
        Visit { visits: self.clone(), number }
    }

    /// Waits until somebody is there.
    pub(crate) async fn somebody(&self) {
        // The sender lives as long as this.
        let _ = self.0.subscribe().wait_for(|presence| !presence.moves.is_empty()).await;
    }

    /// Whether nobody has been there for this time.
    pub(crate) fn is_left(&self, now: Instant, time: Duration) -> bool {
        let presence = self.0.borrow();
        let is_long = presence.left.is_none_or(|left| now.saturating_duration_since(left) > time);
        is_long && presence.moves.is_empty()
    }

    /// Whether a page is there, which moves and sees pictures.
    pub(crate) fn has_pages(&self) -> bool {
        self.0.borrow().moves.values().any(Option::is_some)
    }

    /// Visitors who have moved lately.
    pub(crate) fn active(&self, now: Instant) -> usize {
        let presence = self.0.borrow();
        presence.moves.values().flatten().filter(|moved| now.saturating_duration_since(**moved) < ACTIVE_FOR).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visitors_count_while_they_move() {
        let visits = Arc::new(Visits::default());
        let [request, first, second] = [(); 3].map(|()| visits.begin());
        assert!(!visits.has_pages());
        let start = Instant::now();
        first.moved(start);
        second.moved(start + ACTIVE_FOR / 2);
        assert_eq!(visits.active(start + ACTIVE_FOR / 2), 2);
        assert_eq!(visits.active(start + ACTIVE_FOR), 1);
        drop((request, second));
        assert_eq!((visits.active(start + ACTIVE_FOR), visits.has_pages()), (0, true));
        drop(first);
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
