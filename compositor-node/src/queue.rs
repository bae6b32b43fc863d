//! The order of views: streams take turns, and a live stream's newest view replaces the one before.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;
use tokio::sync::Notify;

use crate::batch::{BatchKey, MAX_BATCH, Waiting};

/// Views that a stream may have in a batch while others wait, and all together while live streams are open. A single view
/// then waits for few others.
const SHARED_VIEWS: usize = 8;
/// Pixels of these views.
const SHARED_PIXELS: usize = 1 << 20;
/// Pixels of one call, times their samples: 64 views of full HD would hold half a gigabyte.
const MAX_BATCH_PIXELS: usize = 64 << 20;

/// The ways to the device. Each has one call to it at a time, so that no view of a live stream waits for a call of a batch,
/// and none for a long view of another stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Lane {
    /// Views of live streams.
    Live,
    /// Views of live streams that take long.
    LongLive,
    /// Views of batches.
    Batch,
    /// Views of batches that take long.
    LongBatch,
    /// Views that a request has drawn from the scene, whatever the plan: one at a time.
    Direct,
    /// Views of live streams that are drawn from the scene until their set is there.
    Preview,
}

impl Lane {
    pub(crate) const ALL: [Self; 6] =
        [Self::Live, Self::LongLive, Self::Batch, Self::LongBatch, Self::Direct, Self::Preview];
}

/// The views of all streams that wait for the device. Bounded: each view that waits holds a credit.
#[derive(Default)]
pub(crate) struct Arrivals {
    lanes: [WaitingLane; Lane::ALL.len()],
    /// Each open live stream holds a clone, whether it waits or not: the next pose may come at any time. Batches are small
    /// meanwhile.
    pub(crate) viewers: Arc<()>,
    /// Batches of the lanes that follow the plan.
    pub(crate) served: AtomicU64,
}

#[derive(Default)]
struct WaitingLane {
    queue: Mutex<FairQueue>,
    added: Notify,
}

impl Arrivals {
    pub(crate) fn push(&self, lane: Lane, stream: u64, views: Vec<Waiting>) {
        let lane = &self.lanes[lane as usize];
        lane.queue.lock().push(stream, views);
        lane.added.notify_one();
    }

    /// Takes back a stream's views, oldest first.
    pub(crate) fn withdraw(&self, stream: u64) -> VecDeque<Waiting> {
        self.lanes.iter().flat_map(|lane| lane.queue.lock().withdraw(stream)).collect()
    }

    /// Waits for the next batch of a lane.
    pub(crate) async fn next_batch(&self, number: Lane) -> Vec<Waiting> {
        let waiting = &self.lanes[number as usize];
        loop {
            let has_viewers = Arc::strong_count(&self.viewers) > 1;
            let most = if number == Lane::Direct { 1 } else { MAX_BATCH };
            let batch = waiting.queue.lock().take_batch(has_viewers, most);
            if !batch.is_empty() {
                if number != Lane::Direct {
                    self.served.fetch_add(1, Ordering::Relaxed);
                }
                return batch;
            }
            waiting.added.notified().await;
        }
    }
}

/// Views that wait for the device, by stream.
#[derive(Default)]
struct FairQueue {
    /// Without empty queues.
    streams: BTreeMap<u64, VecDeque<Waiting>>,
    /// The last stream that has had its turn.
    last: u64,
}

impl FairQueue {
    fn push(&mut self, stream: u64, views: Vec<Waiting>) {
        if !views.is_empty() {
            self.streams.entry(stream).or_default().extend(views);
        }
    }

    fn withdraw(&mut self, stream: u64) -> VecDeque<Waiting> {
        self.streams.remove(&stream).unwrap_or_default()
    }

    /// The next stream's first view and those that can be made with it, one of each stream in turn, round by round, `most` at
    /// most. Streams that had no part in it have the next turn.
    fn take_batch(&mut self, has_viewers: bool, most: usize) -> Vec<Waiting> {
        let order = self.order();
        let first = order.first().and_then(|first| self.streams.get(first)?.front());
        let Some(wanted) = first.map(|view| view.key.clone()) else {
            return Vec::new();
        };
        // While live streams are open, a pose may arrive at any time.
        let samples = wanted.size_px.element_product() as usize * wanted.planes.antialias.samples() as usize;
        let most_of_call = (MAX_BATCH_PIXELS / samples.max(1)).clamp(1, MAX_BATCH);
        let most = most.min(if has_viewers { shared(&wanted) } else { most_of_call });
        // The most views of each stream.
        let rounds = if order.len() == 1 { MAX_BATCH } else { shared(&wanted) };
        let first = self.take_round(&order, &wanted, most);
        let served = order.iter().zip(&first).take_while(|(stream, (of, _))| *stream == of).last();
        self.last = served.map_or(self.last, |(stream, _)| *stream);
        let mut batch: Vec<Waiting> = first.into_iter().map(|(_, view)| view).collect();
        for _ in 1..rounds {
            let next = self.take_round(&order, &wanted, most - batch.len());
            if next.is_empty() {
                break;
            }
            batch.extend(next.into_iter().map(|(_, view)| view));
        }
        batch
    }

    /// All streams, from the one after the last that had its turn.
    fn order(&self) -> Vec<u64> {
        let (before, after): (Vec<u64>, Vec<u64>) = self.streams.keys().partition(|stream| **stream <= self.last);
        [after, before].concat()
    }

    /// One view of each stream, with its stream.
    fn take_round(&mut self, order: &[u64], wanted: &BatchKey, room: usize) -> Vec<(u64, Waiting)> {
        order.iter().filter_map(|&stream| Some((stream, self.take(stream, wanted)?))).take(room).collect()
    }

    fn take(&mut self, stream: u64, wanted: &BatchKey) -> Option<Waiting> {
        let views = self.streams.get_mut(&stream)?;
        let at = views.iter().position(|view| view.key == *wanted)?;
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
    use std::time::Instant;

    use cluster::RequestedView;
    use codec::{FrameCodec, SampleSetId};
    use depth_image::{ExposureEv, PinholeCamera, ToneCurve, ViewPlanes};
    use glam::{UVec2, Vec3};
    use node::{NodeMetrics, Quotas};
    use tokio::sync::Semaphore;

    use super::*;
    use crate::batch::{Loaded, Place, Source};
    use crate::outbox::{Outbox, Reply};
    use crate::quota::{Credit, NodeQuota};
    use crate::test_support::assignment;

    fn view(stream: u64, number: u32, index: u64, side_px: u32) -> Waiting {
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(side_px));
        let key = BatchKey {
            workload_number: 1,
            sample_set_id: SampleSetId { plan_epoch: 1, index },
            content: None,
            method: String::new(),
            planes: ViewPlanes::default(),
            size_px: camera.size_px,
            is_preview: false,
        };
        let permit = Arc::new(Semaphore::new(1)).try_acquire_owned().unwrap();
        let node = NodeQuota::new(Quotas::default()).try_view(1).unwrap();
        let now = Instant::now();
        let place = Place { id: key.sample_set_id, cell: 0, is_neighbour: false, content: None };
        let source = Source::Scene { plan: Arc::new(assignment()), scene_time_s: 0.0 };
        Waiting {
            key,
            set: Loaded { source, place, wait_s: 0.0 },
            view: RequestedView { frame: number.into(), camera },
            codec: FrameCodec::Lz4,
            arrived: now,
            queued: now,
            reply: Reply::new(Outbox::new(stream, NodeMetrics::default())),
            credit: Credit { stream: permit, _node: node },
        }
    }

    fn views(stream: u64, count: u32, side_px: u32) -> Vec<Waiting> {
        (0..count).map(|i| view(stream, i, 0, side_px)).collect()
    }

    #[test]
    fn a_batch_has_views_of_one_set_in_their_order() {
        let mut queue = FairQueue::default();
        queue.push(1, (0..200).map(|i| view(1, i, u64::from(i / 3 % 2), 64)).collect());
        let mut seen = Vec::new();
        loop {
            let batch = queue.take_batch(false, MAX_BATCH);
            assert!(batch.len() <= MAX_BATCH && batch.iter().all(|view| view.key == batch[0].key));
            assert!(batch.is_sorted_by_key(|view| view.view.frame));
            if batch.is_empty() {
                break;
            }
            seen.extend(batch.into_iter().map(|view| view.view.frame));
        }
        seen.sort_unstable();
        assert_eq!(seen, (0..200).collect::<Vec<_>>());
    }

    #[test]
    fn views_of_two_tones_are_not_in_one_batch() {
        let mut mapped = views(1, 6, 64);
        for waiting in mapped.iter_mut().skip(3) {
            waiting.key.planes.tone.curve = ToneCurve::KhronosNeutral;
        }
        mapped[5].key.planes.tone.exposure = ExposureEv::new(1.0).unwrap();
        let mut queue = FairQueue::default();
        queue.push(1, mapped);
        let sizes: Vec<usize> = (0..4).map(|_| queue.take_batch(false, MAX_BATCH).len()).collect();
        assert_eq!(sizes, [3, 2, 1, 0]);
    }

    #[test]
    fn large_views_make_small_batches() {
        let mut queue = FairQueue::default();
        queue.push(1, views(1, 8, 4096));
        assert_eq!(queue.take_batch(false, MAX_BATCH).len(), 4);
        let mut queue = FairQueue::default();
        queue.push(1, views(1, 2, 16_384));
        assert_eq!(queue.take_batch(false, MAX_BATCH).len(), 1);
    }

    #[test]
    fn a_stream_with_thousands_of_views_leaves_room_for_others() {
        let mut queue = FairQueue::default();
        queue.push(1, views(1, 5000, 64));
        (2..10).for_each(|stream| queue.push(stream, vec![view(stream, 0, 0, 64)]));
        let batch = queue.take_batch(false, MAX_BATCH);
        let of = |stream: u64| batch.iter().filter(|view| view.reply.outbox().stream == stream).count();
        assert_eq!(of(1), SHARED_VIEWS);
        assert!((2..10).all(|stream| of(stream) == 1), "views of one size go together");
        assert_eq!(queue.take_batch(false, MAX_BATCH).len(), MAX_BATCH, "alone, it has the device");
        assert_eq!(queue.take_batch(true, MAX_BATCH).len(), SHARED_VIEWS, "a pose may arrive at any time");
        assert_eq!(queue.take_batch(false, MAX_BATCH).len(), MAX_BATCH);
    }

    #[test]
    fn many_viewers_take_turns_in_small_batches() {
        let mut queue = FairQueue::default();
        let mut served = [0; 40];
        for _ in 0..10 {
            // Every viewer has a pose again as soon as its last was taken.
            (0..40).for_each(|stream| {
                let waiting = queue.withdraw(stream);
                queue.push(stream, vec![waiting.into_iter().next().unwrap_or_else(|| view(stream, 0, 0, 64))]);
            });
            let batch = queue.take_batch(true, MAX_BATCH);
            assert_eq!(batch.len(), SHARED_VIEWS);
            batch.iter().for_each(|view| served[view.reply.outbox().stream as usize] += 1);
        }
        assert_eq!(served, [2; 40]);
    }

    #[test]
    fn a_stream_with_large_views_gets_few_at_a_time() {
        let mut queue = FairQueue::default();
        queue.push(1, views(1, 9, 1024));
        queue.push(2, vec![view(2, 0, 0, 64)]);
        assert_eq!(queue.take_batch(false, MAX_BATCH).len(), 1);
    }

    #[test]
    fn streams_that_cannot_share_a_batch_take_turns() {
        let mut queue = FairQueue::default();
        queue.push(1, views(1, 100, 64));
        queue.push(2, views(2, 30, 32));
        queue.push(7, views(7, 30, 16));
        let leaders: Vec<u64> = (0..6).map(|_| queue.take_batch(false, MAX_BATCH)[0].reply.outbox().stream).collect();
        assert_eq!(leaders, [1, 2, 7, 1, 2, 7]);
    }

    #[test]
    fn a_stream_that_leaves_withdraws_its_views() {
        let mut queue = FairQueue::default();
        queue.push(3, views(3, 5, 64));
        queue.push(4, vec![view(4, 9, 0, 64)]);
        queue.push(5, Vec::new());
        assert_eq!(queue.withdraw(3).len(), 5);
        assert!(queue.withdraw(3).is_empty());
        let batch = queue.take_batch(false, MAX_BATCH);
        assert_eq!((batch.len(), batch[0].reply.outbox().stream), (1, 4));
        assert!(queue.take_batch(false, MAX_BATCH).is_empty() && queue.streams.is_empty());
    }
}
