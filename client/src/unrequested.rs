//! The views of a request that no compositor of the plan has been asked for: a few thousand, drawn as they are used up.

use std::collections::VecDeque;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use parking_lot::Mutex;

use crate::view_request::ViewRequest;
use crate::window::{LEAST_AHEAD_VIEWS, Window};
use crate::work_stealing::WorkStealing;

/// Brings views of one set into the order in which compositors make them.
type Arrange = Box<dyn Fn(&mut [ViewRequest]) + Send>;

/// Views that wait to be requested, as shares of the compositors.
pub(crate) struct Unrequested {
    window: Arc<Mutex<Window>>,
    shares: WorkStealing,
    /// The views that have places from `first` on.
    views: VecDeque<ViewRequest>,
    first: usize,
    arrange: Arrange,
}

impl fmt::Debug for Unrequested {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Unrequested").field("left", &self.shares.left()).finish_non_exhaustive()
    }
}

impl Unrequested {
    /// All views that are due, and those that follow, for compositors of these weights.
    pub(crate) fn new(window: Arc<Mutex<Window>>, weights: &[u32], arrange: Arrange) -> Self {
        let due = window.lock().due();
        let shares = WorkStealing::new([], weights);
        let mut unrequested = Self { window, shares, views: VecDeque::new(), first: 0, arrange };
        due.chunk_by(|a, b| a.set_index == b.set_index).for_each(|run| unrequested.push(run.to_vec()));
        unrequested.refill();
        unrequested
    }

    /// The next views of a compositor's own share, as [`WorkStealing::take_local`].
    pub(crate) fn take_local(&mut self, compositor: usize, most: usize) -> Option<Vec<ViewRequest>> {
        self.shares.take_local(compositor, most).map(|places| self.at(places))
    }

    /// The next views for a compositor, as [`WorkStealing::take`]; `None` after the last view of the request.
    pub(crate) fn take(&mut self, compositor: usize, most: usize) -> Option<Vec<ViewRequest>> {
        self.refill();
        self.shares.take(compositor, most).map(|places| self.at(places))
    }

    fn at(&mut self, places: Range<usize>) -> Vec<ViewRequest> {
        let views = self.views.range(places.start - self.first..places.end - self.first).copied().collect();
        let used_up = self.shares.first_left().saturating_sub(self.first);
        self.views.drain(..used_up);
        self.first += used_up;
        views
    }

    fn refill(&mut self) {
        while self.shares.left() < LEAST_AHEAD_VIEWS {
            let run = self.window.lock().draw();
            if run.is_empty() {
                return;
            }
            self.push(run);
        }
    }

    fn push(&mut self, mut run: Vec<ViewRequest>) {
        (self.arrange)(&mut run);
        self.shares.push(run.len());
        self.views.extend(run);
    }

    /// Views of all shares, and views that are held.
    #[cfg(test)]
    pub(crate) fn shares_and_views(&self) -> [usize; 2] {
        [self.shares.left(), self.views.len()]
    }
}
