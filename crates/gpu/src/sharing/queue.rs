//! The device's queue: work waits for its turn, and long work is cut into slices while somebody watches.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use parking_lot::{Condvar, Mutex, MutexGuard};

use super::Turn;
use super::fair_order::FairOrder;
use super::rates::{Rates, Work};

/// The longest slice that is planned while a live stream is open.
pub const SLICE_S: f64 = 0.050;

/// The most that a slice's units differ from those of unknown work.
const MOST_RESIZING: u64 = 64;

thread_local! {
    /// Seconds for which this thread has waited for its turn.
    static WAITED_S: Cell<f64> = const { Cell::new(0.0) };
}

/// Seconds for which this thread has waited for its turns so far. What remains of a call's time is its own.
#[must_use]
pub fn waited_s() -> f64 {
    WAITED_S.get()
}

/// Counts time that this thread has waited since `start`.
pub(super) fn count_waited(start: Instant) {
    WAITED_S.set(WAITED_S.get() + start.elapsed().as_secs_f64());
}

/// The queue of one device. One piece of work holds the device at a time.
#[derive(Default)]
pub struct DeviceQueue {
    state: Mutex<State>,
    changed: Condvar,
    rates: Mutex<Rates>,
    live_streams: AtomicUsize,
    slices: AtomicU64,
    /// Units of a slice that tests force; 0 for none.
    forced_units: AtomicU64,
}

#[derive(Default)]
struct State {
    order: FairOrder,
    is_busy: bool,
    /// The ticket of the work that may go, until it does.
    going: Option<u64>,
    last_ticket: u64,
}

/// A live stream that is open: work is cut into slices until the last of them is dropped.
pub struct LiveStream(Arc<DeviceQueue>);

/// The device, held until dropped.
pub(crate) struct Slot<'q> {
    queue: &'q DeviceQueue,
    turn: Turn,
    since: Instant,
}

impl DeviceQueue {
    /// Counts a live stream as open until the guard is dropped.
    #[must_use]
    pub fn live_stream(self: &Arc<Self>) -> LiveStream {
        self.live_streams.fetch_add(1, Ordering::AcqRel);
        LiveStream(self.clone())
    }

    /// Whether long work is cut into slices.
    #[must_use]
    pub fn cuts(&self) -> bool {
        self.live_streams.load(Ordering::Acquire) > 0
    }

    /// The units of one slice of a family's work; all where work is not cut, `unknown` where a rate is not known. Known
    /// rates bring no more than `MOST_RESIZING` times as many or as few.
    #[must_use]
    pub fn slice_units(&self, family: u64, unknown: u64) -> u64 {
        if !self.cuts() {
            return u64::MAX;
        }
        let forced = self.forced_units.load(Ordering::Acquire);
        if forced > 0 {
            return forced;
        }
        let known = self.rates.lock().slowest_unit_s(family).map(|unit_s| (SLICE_S / unit_s) as u64);
        let bounds = [(unknown / MOST_RESIZING).max(1), unknown.saturating_mul(MOST_RESIZING).max(1)];
        known.unwrap_or(unknown).clamp(bounds[0], bounds[1])
    }

    /// The slices that have gone to the device so far.
    #[must_use]
    pub fn slices(&self) -> u64 {
        self.slices.load(Ordering::Acquire)
    }

    /// For tests: from now on every piece of work is a slice, and has so many units where it can be cut. A live stream is open
    /// until the guard is dropped.
    #[must_use]
    pub fn force_slices(self: &Arc<Self>, units: u64) -> LiveStream {
        self.forced_units.store(units.max(1), Ordering::Release);
        self.live_stream()
    }

    /// Waits until the device is free for this work.
    pub(crate) fn wait(&self, turn: Turn, predicted_s: f64) -> Slot<'_> {
        let state = self.state.lock();
        self.wait_in(state, turn, predicted_s)
    }

    fn wait_in(&self, mut state: MutexGuard<'_, State>, turn: Turn, predicted_s: f64) -> Slot<'_> {
        state.last_ticket += 1;
        let ticket = state.last_ticket;
        state.order.enter(ticket, turn, predicted_s);
        self.choose(&mut state);
        let start = Instant::now();
        while state.going != Some(ticket) {
            self.changed.wait(&mut state);
        }
        state.going = None;
        count_waited(start);
        self.slices.fetch_add(1, Ordering::AcqRel);
        Slot { queue: self, turn, since: Instant::now() }
    }

    /// Lets the next work go if the device is free.
    fn choose(&self, state: &mut State) {
        if !state.is_busy {
            state.going = state.order.next();
            state.is_busy = state.going.is_some();
            self.changed.notify_all();
        }
    }

    /// The first of these pieces that go together: all, unless work is cut. Pieces of unknown length go alone.
    pub(crate) fn merged<'w>(&self, pieces: impl ExactSizeIterator<Item = &'w [Work]>) -> usize {
        let count = pieces.len();
        if !self.cuts() {
            return count;
        }
        if self.forced_units.load(Ordering::Acquire) > 0 {
            return count.min(1);
        }
        let rates = self.rates.lock();
        let mut sum_s = 0.0;
        let mut fits = |work: &[Work]| {
            sum_s += rates.predicted_s(work).unwrap_or(f64::INFINITY);
            sum_s <= SLICE_S
        };
        pieces.map_while(|work| fits(work).then_some(())).count().max(1).min(count)
    }

    /// The seconds of work, of unknown kinds those of a slice.
    pub(crate) fn predicted_s<'w>(&self, pieces: impl Iterator<Item = &'w [Work]>) -> f64 {
        let rates = self.rates.lock();
        pieces.map(|work| rates.predicted_s(work).unwrap_or(SLICE_S)).sum()
    }

    /// Learns from a slice that took so long.
    pub(crate) fn learn(&self, work: &[Work], seconds: f64) {
        self.rates.lock().learn(work, seconds);
    }
}

impl Drop for LiveStream {
    fn drop(&mut self) {
        if self.0.live_streams.fetch_sub(1, Ordering::AcqRel) == 1 {
            self.0.forced_units.store(0, Ordering::Release);
        }
    }
}

impl<'q> Slot<'q> {
    /// Ends this slice and waits for the next of the same work, which is in the queue before another is chosen.
    pub fn next(self, predicted_s: f64) -> Self {
        let queue = self.queue;
        let turn = self.turn;
        let mut state = queue.state.lock();
        state.release(self.since.elapsed().as_secs_f64());
        std::mem::forget(self);
        queue.wait_in(state, turn, predicted_s)
    }
}

impl State {
    fn release(&mut self, seconds: f64) {
        self.order.used(seconds);
        self.is_busy = false;
    }
}

impl Drop for Slot<'_> {
    fn drop(&mut self) {
        let mut state = self.queue.state.lock();
        state.release(self.since.elapsed().as_secs_f64());
        self.queue.choose(&mut state);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::thread;

    use super::*;
    use crate::sharing::{WorkClass, rates::WorkKind};

    fn turn(class: WorkClass, flow: u64) -> Turn {
        Turn { class, flow }
    }

    #[test]
    fn live_work_goes_between_the_slices_of_a_batch() {
        let queue = Arc::new(DeviceQueue::default());
        let (sender, gone) = mpsc::channel();
        let mut batch = queue.wait(turn(WorkClass::Batch, 1), SLICE_S);
        let live = thread::spawn({
            let queue = queue.clone();
            move || {
                let _slot = queue.wait(turn(WorkClass::Live, 2), SLICE_S);
                sender.send(()).expect("a receiver");
            }
        });
        while queue.state.lock().last_ticket < 2 {
            thread::yield_now();
        }
        assert!(gone.try_recv().is_err(), "the batch holds the device");
        batch = batch.next(SLICE_S);
        assert!(gone.try_recv().is_ok(), "after one slice");
        drop(batch);
        live.join().expect("no panic");
        assert_eq!(queue.slices(), 3);
    }

    #[test]
    fn work_with_more_to_do_keeps_the_device_from_lower_classes() {
        let queue = Arc::new(DeviceQueue::default());
        let (sender, gone) = mpsc::channel();
        let mut live = queue.wait(turn(WorkClass::Live, 1), 0.0);
        let batch = thread::spawn({
            let queue = queue.clone();
            move || {
                let _slot = queue.wait(turn(WorkClass::Batch, 2), SLICE_S);
                sender.send(()).expect("a receiver");
            }
        });
        while queue.state.lock().last_ticket < 2 {
            thread::yield_now();
        }
        for _ in 0..3 {
            live = live.next(0.0);
            assert!(gone.try_recv().is_err());
        }
        drop(live);
        assert!(gone.recv().is_ok());
        batch.join().expect("no panic");
    }

    #[test]
    fn pieces_are_merged_up_to_a_slice_while_a_live_stream_is_open() {
        let queue = Arc::new(DeviceQueue::default());
        let known = WorkKind::new(1, &0);
        let unknown = WorkKind::new(1, &1);
        queue.learn(&[(known, 1000)], SLICE_S);
        let pieces = [[(known, 400)], [(known, 400)], [(known, 400)], [(unknown, 1)]];
        let merged = |from: usize| queue.merged(pieces[from..].iter().map(<[_; 1]>::as_slice));
        assert_eq!((merged(0), queue.slice_units(1, 50)), (4, u64::MAX), "nobody watches");
        let live = queue.live_stream();
        assert_eq!([merged(0), merged(2), merged(3)], [2, 1, 1]);
        assert_eq!((queue.slice_units(1, 50), queue.slice_units(2, 50)), (1000, 50));
        assert_eq!([1, 64 * 10_000].map(|unknown| queue.slice_units(1, unknown)), [64, 10_000], "within bounds");
        let forced = queue.force_slices(16);
        assert_eq!((merged(0), queue.slice_units(1, 50)), (1, 16));
        drop((live, forced));
        assert_eq!(merged(0), 4);
    }
}
