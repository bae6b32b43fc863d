//! The order of views: streams take turns, and a live stream's newest view replaces the one before.

use std::collections::{BTreeMap, VecDeque};

use crate::batch::{BatchKey, MAX_BATCH};

/// Views that a stream may have in a batch while others wait, and all together while live streams are open. A single view
/// then waits for few others.
const SHARED_VIEWS: usize = 8;
/// Pixels of these views.
const SHARED_PIXELS: usize = 1 << 20;

/// Views that can be put into batches.
pub(crate) trait Keyed {
    /// The key that all views of a batch share.
    fn key(&self) -> &BatchKey;
}

/// Views that wait for the device, by stream.
pub(crate) struct FairQueue<T> {
    /// Without empty queues.
    streams: BTreeMap<u64, VecDeque<T>>,
    /// The last stream that has had its turn.
    last: u64,
    /// Live streams that are open, whether they wait or not: the next pose may come at any time.
    viewers: usize,
}

impl<T> Default for FairQueue<T> {
    fn default() -> Self {
        Self { streams: BTreeMap::new(), last: 0, viewers: 0 }
    }
}

impl<T: Keyed> FairQueue<T> {
    pub(crate) fn push(&mut self, stream: u64, views: impl IntoIterator<Item = T>) {
        let mut views = views.into_iter().peekable();
        if views.peek().is_some() {
            self.streams.entry(stream).or_default().extend(views);
        }
    }

    pub(crate) fn add_viewer(&mut self) {
        self.viewers += 1;
    }

    pub(crate) fn remove_viewer(&mut self) {
        self.viewers = self.viewers.saturating_sub(1);
    }

    /// Takes back a stream's views, oldest first.
    pub(crate) fn withdraw(&mut self, stream: u64) -> VecDeque<T> {
        self.streams.remove(&stream).unwrap_or_default()
    }

    /// The next stream's first view and those that can be made with it, one of each stream in turn, round by round. Streams that had no part in it have the next turn.
    pub(crate) fn take_batch(&mut self) -> Vec<T> {
        let order = self.order();
        let Some(wanted) = order.first().and_then(|first| self.first_key(*first)) else {
            return Vec::new();
        };
        let (most, rounds) = (self.max_views(&wanted), self.rounds(order.len(), &wanted));
        let first = self.take_round(&order, &wanted, most);
        let served = order.iter().zip(&first).take_while(|(stream, (of, _))| *stream == of).last();
        self.last = served.map_or(self.last, |(stream, _)| *stream);
        let mut batch: Vec<T> = first.into_iter().map(|(_, view)| view).collect();
        for _ in 1..rounds {
            let next = self.take_round(&order, &wanted, most - batch.len());
            if next.is_empty() {
                break;
            }
            batch.extend(next.into_iter().map(|(_, view)| view));
        }
        batch
    }

    fn first_key(&self, stream: u64) -> Option<BatchKey> {
        self.streams.get(&stream)?.front().map(|view| view.key().clone())
    }

    /// The most views of a batch. While live streams are open, a pose may arrive at any time.
    fn max_views(&self, wanted: &BatchKey) -> usize {
        if self.viewers == 0 { wanted.max_views() } else { shared(wanted) }
    }

    /// The most views of each stream in a batch.
    fn rounds(&self, waiting: usize, wanted: &BatchKey) -> usize {
        if waiting == 1 { MAX_BATCH } else { shared(wanted) }
    }

    /// All streams, from the one after the last that had its turn.
    fn order(&self) -> Vec<u64> {
        let (before, after): (Vec<u64>, Vec<u64>) = self.streams.keys().partition(|stream| **stream <= self.last);
        [after, before].concat()
    }

    /// One view of each stream, with its stream.
    fn take_round(&mut self, order: &[u64], wanted: &BatchKey, room: usize) -> Vec<(u64, T)> {
        order.iter().filter_map(|&stream| Some((stream, self.take(stream, wanted)?))).take(room).collect()
    }

    fn take(&mut self, stream: u64, wanted: &BatchKey) -> Option<T> {
        let views = self.streams.get_mut(&stream)?;
        let at = views.iter().position(|view| view.key() == wanted)?;
        let view = views.remove(at);
        if views.is_empty() {
            self.streams.remove(&stream);
        }
        view
    }
}

fn shared(wanted: &BatchKey) -> usize {
    (SHARED_PIXELS / (wanted.size_px.element_product() as usize).max(1)).clamp(1, SHARED_VIEWS)
}

#[cfg(test)]
mod tests {
    use codec::SampleSetId;
    use depth_image::ViewPlanes;
    use glam::UVec2;

    use super::*;

    #[derive(Debug, Clone, PartialEq)]
    struct View {
        key: BatchKey,
        stream: u64,
        number: u32,
    }

    impl Keyed for View {
        fn key(&self) -> &BatchKey {
            &self.key
        }
    }

    fn view(stream: u64, number: u32, index: u64, side_px: u32) -> View {
        let key = BatchKey {
            sample_set_id: SampleSetId { plan_epoch: 1, index },
            cell: 0,
            method: String::new(),
            planes: ViewPlanes::default(),
            size_px: UVec2::splat(side_px),
        };
        View { key, stream, number }
    }

    #[test]
    fn a_batch_has_views_of_one_set_in_their_order() {
        let mut queue = FairQueue::default();
        queue.push(1, (0..200).map(|i| view(1, i, u64::from(i / 3 % 2), 64)));
        let mut seen = Vec::new();
        loop {
            let batch = queue.take_batch();
            assert!(batch.len() <= MAX_BATCH && batch.iter().all(|view| view.key == batch[0].key));
            assert!(batch.is_sorted_by_key(|view| view.number));
            if batch.is_empty() {
                break;
            }
            seen.extend(batch.into_iter().map(|view| view.number));
        }
        seen.sort_unstable();
        assert_eq!(seen, (0..200).collect::<Vec<_>>());
    }

    #[test]
    fn large_views_make_small_batches() {
        let mut queue = FairQueue::default();
        queue.push(1, (0..8).map(|i| view(1, i, 0, 4096)));
        assert_eq!(queue.take_batch().len(), 4);
        let mut queue = FairQueue::default();
        queue.push(1, (0..2).map(|i| view(1, i, 0, 16_384)));
        assert_eq!(queue.take_batch().len(), 1);
    }

    #[test]
    fn a_stream_with_thousands_of_views_leaves_room_for_others() {
        let mut queue = FairQueue::default();
        queue.push(1, (0..5000).map(|i| view(1, i, 0, 64)));
        (2..10).for_each(|stream| queue.push(stream, [view(stream, 0, 0, 64)]));
        let batch = queue.take_batch();
        let of = |stream: u64| batch.iter().filter(|view| view.stream == stream).count();
        assert_eq!(of(1), SHARED_VIEWS);
        assert!((2..10).all(|stream| of(stream) == 1), "views of one size go together");
        assert_eq!(queue.take_batch().len(), MAX_BATCH, "alone, it has the device");
        queue.add_viewer();
        assert_eq!(queue.take_batch().len(), SHARED_VIEWS, "a pose may arrive at any time");
        queue.remove_viewer();
        assert_eq!(queue.take_batch().len(), MAX_BATCH);
    }

    #[test]
    fn many_viewers_take_turns_in_small_batches() {
        let mut queue = FairQueue::default();
        let mut served = [0; 40];
        for _ in 0..40 {
            queue.add_viewer();
        }
        for _ in 0..10 {
            // Every viewer has a pose again as soon as its last was taken.
            (0..40).for_each(|stream| {
                let waiting = queue.withdraw(stream);
                queue.push(stream, [waiting.into_iter().next().unwrap_or_else(|| view(stream, 0, 0, 64))]);
            });
            let batch = queue.take_batch();
            assert_eq!(batch.len(), SHARED_VIEWS);
            batch.iter().for_each(|view| served[view.stream as usize] += 1);
        }
        assert_eq!(served, [2; 40]);
    }

    #[test]
    fn a_stream_with_large_views_gets_few_at_a_time() {
        let mut queue = FairQueue::default();
        queue.push(1, (0..9).map(|i| view(1, i, 0, 1024)));
        queue.push(2, [view(2, 0, 0, 64)]);
        assert_eq!(queue.take_batch().len(), 1);
    }

    #[test]
    fn streams_that_cannot_share_a_batch_take_turns() {
        let mut queue = FairQueue::default();
        queue.push(1, (0..100).map(|i| view(1, i, 0, 64)));
        queue.push(2, (0..30).map(|i| view(2, i, 0, 32)));
        queue.push(7, (0..30).map(|i| view(7, i, 0, 16)));
        let leaders: Vec<u64> = (0..6).map(|_| queue.take_batch()[0].stream).collect();
        assert_eq!(leaders, [1, 2, 7, 1, 2, 7]);
    }

    #[test]
    fn a_stream_that_leaves_withdraws_its_views() {
        let mut queue = FairQueue::default();
        queue.push(3, (0..5).map(|i| view(3, i, 0, 64)));
        queue.push(4, [view(4, 9, 0, 64)]);
        queue.push(5, []);
        assert_eq!(queue.withdraw(3).len(), 5);
        assert!(queue.withdraw(3).is_empty());
        let batch = queue.take_batch();
        assert_eq!((batch.len(), batch[0].stream), (1, 4));
        assert!(queue.take_batch().is_empty() && queue.streams.is_empty());
    }
}
