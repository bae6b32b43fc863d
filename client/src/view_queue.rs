//! The views that wait for a compositor, and how many of them each compositor is asked for at a time.
//!
//! All compositors draw from one queue, so that a slow compositor makes fewer views and delays nobody. A message to a
//! compositor is a few tenths of a second of work, and two messages are under way: one is made while the other waits. A
//! compositor's deliveries show its speed sooner than anything else (Lages §6, dynamic load balancing).

use std::cmp::Reverse;
use std::collections::VecDeque;

use crate::pace::Pace;

/// Views of one set and one view cell that no compositor has been asked for.
#[derive(Debug)]
struct Group<V> {
    set_index: u32,
    cell: u32,
    /// The views that the set had when it was added.
    set_views: usize,
    views: VecDeque<V>,
}

#[derive(Debug)]
struct Compositor {
    weight: usize,
    pace: Pace,
    /// Views that are requested and have not been received.
    in_flight: usize,
    /// The view cell of the last message, if there was one.
    cell: Option<u32>,
}

/// Views of one set, for one compositor.
#[derive(Debug, PartialEq, Eq)]
pub struct Message<V> {
    /// The sample set.
    pub set_index: u32,
    /// At least one.
    pub views: Vec<V>,
}

/// The views of a batch that have not been requested, in the order of their sets and within a set by view cell.
#[derive(Debug)]
pub struct ViewQueue<V> {
    groups: VecDeque<Group<V>>,
    /// Views of all groups.
    waiting: usize,
    compositors: Vec<Compositor>,
    total_weight: usize,
}

impl<V: Copy> ViewQueue<V> {
    /// A queue for compositors of these weights, the heaviest first. A view is expected to take `view_s`.
    #[must_use]
    pub fn new(weights: &[u32], view_s: f64) -> Self {
        let compositors = weights.iter().map(|&weight| {
            let weight = weight.max(1) as usize;
            Compositor { weight, pace: Pace::new(view_s), in_flight: 0, cell: None }
        });
        let compositors: Vec<Compositor> = compositors.collect();
        let total_weight = compositors.iter().map(|compositor| compositor.weight).sum();
        Self { groups: VecDeque::new(), waiting: 0, compositors, total_weight }
    }

    /// Adds views of one set, each with its view cell.
    pub fn push(&mut self, set_index: u32, mut views: Vec<(u32, V)>) {
        views.sort_by_key(|(cell, _)| *cell);
        self.waiting += views.len();
        for group in views.chunk_by(|(a, _), (b, _)| a == b) {
            let of_group = group.iter().map(|(_, view)| *view).collect();
            self.groups.push_back(Group { set_index, cell: group[0].0, set_views: views.len(), views: of_group });
        }
    }

    /// Views that have not been requested.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.waiting
    }

    /// Views that a compositor has been asked for and has not delivered.
    #[must_use]
    pub fn in_flight(&self, compositor: usize) -> usize {
        self.compositors.get(compositor).map_or(0, |compositor| compositor.in_flight)
    }

    /// The next message to a compositor; `None` while it has enough work, and where nothing is left for it.
    pub fn next_message(&mut self, compositor: usize) -> Option<Message<V>> {
        let room = self.room(compositor)?;
        let cell = self.compositors[compositor].cell;
        let at = self.next_group(cell)?;
        let most = self.share(self.groups[at].set_views, compositor).min(room);
        let group = &mut self.groups[at];
        let count = most.min(group.views.len());
        let message = Message { set_index: group.set_index, views: group.views.drain(..count).collect() };
        let asked = &mut self.compositors[compositor];
        asked.cell = Some(group.cell);
        asked.in_flight += count;
        self.waiting -= count;
        if group.views.is_empty() {
            self.groups.remove(at);
        }
        Some(message)
    }

    /// Counts a view as received. A view that waited for its sample set does not show its compositor's speed.
    pub fn received(&mut self, compositor: usize, now_s: f64, waited_for_set: bool) {
        let Some(compositor) = self.compositors.get_mut(compositor) else { return };
        compositor.in_flight = compositor.in_flight.saturating_sub(1);
        compositor.pace.received(now_s, waited_for_set);
    }

    /// Most views of the next message to a compositor: as many as last for a while, and no more than its share of the batch,
    /// so that all compositors end together.
    fn room(&self, compositor: usize) -> Option<usize> {
        let Compositor { weight, pace, in_flight, .. } = self.compositors.get(compositor)?;
        if *in_flight > pace.message_views {
            return None;
        }
        let due = self.waiting + self.compositors.iter().map(|compositor| compositor.in_flight).sum::<usize>();
        // A compositor that would make less than half a view meanwhile would be the last to end.
        let is_too_slow = compositor > 0 && 2 * due * weight < self.total_weight;
        let left = self.share(due, compositor).saturating_sub(*in_flight);
        Some(left.min(pace.message_views)).filter(|&room| room > 0 && !is_too_slow)
    }

    /// A compositor's part of some views by its weight, rounded up.
    fn share(&self, views: usize, compositor: usize) -> usize {
        (views * self.compositors[compositor].weight).div_ceil(self.total_weight)
    }

    /// The place of the group that a compositor takes views from, among those of the first set: it stays in the cell whose
    /// images it has, and then helps with the largest group.
    fn next_group(&self, cell: Option<u32>) -> Option<usize> {
        let set_index = self.groups.front()?.set_index;
        let of_set = self.groups.iter().take_while(|group| group.set_index == set_index).enumerate();
        of_set.min_by_key(|(_, group)| Reverse((Some(group.cell) == cell, group.views.len()))).map(|(at, _)| at)
    }
}

#[cfg(test)]
#[path = "view_queue_tests.rs"]
mod tests;
