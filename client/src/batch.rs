//! Requests for the views of a batch, to every compositor: a little at a time, and more as views are received.

use std::sync::Arc;
use std::time::Instant;

use cluster::limits::MAX_VIEWS_PER_REQUEST;
use cluster::{RenderViews, RequestedView};
use depth_image::PinholeCamera;
use parking_lot::Mutex;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use crate::view_queue::ViewQueue;
use crate::view_request::ViewRequest;
use crate::window::{LEAST_AHEAD_VIEWS, Window};

/// Room for the messages to one compositor: two of the largest, if all had one view.
const MESSAGES: usize = 2 * MAX_VIEWS_PER_REQUEST;

/// The batch that all compositors of a plan make together.
pub(crate) struct Batch {
    /// Every message, but for its set and views.
    template: RenderViews,
    window: Arc<Mutex<Window>>,
    /// The view cell of a view.
    cell_of: Box<dyn Fn(&PinholeCamera) -> u32 + Send>,
    queue: ViewQueue<ViewRequest>,
    /// The messages to each compositor; `None` where no more follow, which ends their stream.
    messages: Vec<Option<mpsc::Sender<RenderViews>>>,
    start: Instant,
}

/// A batch that has been started, and the messages to each compositor.
pub(crate) struct StartedBatch {
    pub(crate) batch: Arc<Mutex<Batch>>,
    /// `None` for a compositor that is left without views.
    pub(crate) messages: Vec<Option<ReceiverStream<RenderViews>>>,
}

impl Batch {
    /// Requests the first of all views that are due, and of those that follow, from compositors of these weights, the heaviest
    /// first.
    pub(crate) fn start(
        template: RenderViews,
        window: Arc<Mutex<Window>>,
        weights: &[u32],
        view_s: f64,
        cell_of: impl Fn(&PinholeCamera) -> u32 + Send + 'static,
    ) -> StartedBatch {
        let (senders, receivers): (Vec<_>, Vec<_>) = weights.iter().map(|_| mpsc::channel(MESSAGES)).unzip();
        let due = window.lock().due();
        let mut batch = Self {
            template,
            window,
            cell_of: Box::new(cell_of),
            queue: ViewQueue::new(weights, view_s),
            messages: senders.into_iter().map(Some).collect(),
            start: Instant::now(),
        };
        due.chunk_by(|a, b| a.set_index == b.set_index).for_each(|run| batch.push(run));
        // In turns, a message each: no compositor takes the views of another that is about to begin.
        while (0..weights.len()).filter(|&compositor| batch.send_next(compositor)).count() > 0 {}
        let messages = receivers
            .into_iter()
            .enumerate()
            .map(|(compositor, sent)| (batch.queue.in_flight(compositor) > 0).then(|| ReceiverStream::new(sent)));
        let messages = messages.collect();
        StartedBatch { batch: Arc::new(Mutex::new(batch)), messages }
    }

    /// Counts a view as received, and requests more where there is room.
    pub(crate) fn received(&mut self, compositor: usize, now: Instant, waited_for_set: bool) {
        self.queue.received(compositor, (now - self.start).as_secs_f64(), waited_for_set);
        while self.send_next(compositor) {}
    }

    /// Sends the next message, if there is room for one; ends the stream where none will follow.
    fn send_next(&mut self, compositor: usize) -> bool {
        let Some(messages) = self.messages[compositor].clone() else { return false };
        while self.queue.waiting() < LEAST_AHEAD_VIEWS {
            let run = self.window.lock().draw();
            if run.is_empty() {
                break;
            }
            self.push(&run);
        }
        let next = self.queue.next_message(compositor);
        if let Some(message) = &next {
            let views =
                message.views.iter().map(|view| RequestedView { frame: view.frame, camera: view.camera }).collect();
            // There is room for all messages in flight: an error means that the call has ended.
            let _ = messages.try_send(RenderViews { set_index: message.set_index, views, ..self.template.clone() });
        }
        if self.queue.waiting() == 0 || self.queue.in_flight(compositor) == 0 {
            self.messages[compositor] = None;
        }
        next.is_some()
    }

    fn push(&mut self, run: &[ViewRequest]) {
        let Some(first) = run.first() else { return };
        let views = run.iter().map(|view| ((self.cell_of)(&view.camera), *view)).collect();
        self.queue.push(first.set_index, views);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use codec::FrameCodec;
    use depth_image::ViewPlanes;
    use glam::{UVec2, Vec3};

    use super::*;

    fn template() -> RenderViews {
        RenderViews {
            workload_number: 1,
            plan_epoch: 3,
            set_index: 0,
            method: String::new(),
            codec: FrameCodec::Lz4,
            planes: ViewPlanes::default(),
            views: Vec::new(),
            live: None,
        }
    }

    /// A batch of some views of each set, for equal compositors.
    fn start(sets: u32, views: u64, compositors: usize) -> StartedBatch {
        let window = Window::open(requests(sets, views).into_iter(), sets, ViewPlanes::default()).unwrap();
        Batch::start(template(), Arc::new(Mutex::new(window)), &vec![1; compositors], 0.0156, |_| 0)
    }

    fn requests(sets: u32, views: u64) -> Vec<ViewRequest> {
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8));
        let of_set = |set_index| (0..views).map(move |view| (set_index, u64::from(set_index) * views + view));
        (0..sets).flat_map(of_set).map(|(set_index, frame)| ViewRequest { frame, set_index, camera }).collect()
    }

    /// A message: its set and first frame, and how many views.
    type Asked = (u32, u64, usize);

    /// Messages that wait to be sent to a compositor.
    fn waiting(started: &mut StartedBatch, compositor: usize) -> Vec<Asked> {
        let message = |views: RenderViews| (views.set_index, views.views[0].frame, views.views.len());
        let sent = started.messages[compositor].as_mut().unwrap();
        std::iter::from_fn(|| sent.as_mut().try_recv().ok()).map(message).collect()
    }

    /// Receives views `apart_ms` apart; gives the requests that are sent meanwhile.
    fn receive(started: &mut StartedBatch, compositor: usize, views: u64, apart_ms: u64) -> Vec<Asked> {
        let start = started.batch.lock().start;
        for view in 1..=views {
            let now = start + Duration::from_millis(view * apart_ms);
            started.batch.lock().received(compositor, now, false);
        }
        waiting(started, compositor)
    }

    fn has_ended(started: &StartedBatch, compositor: usize) -> bool {
        started.batch.lock().messages[compositor].is_none()
    }

    fn views_of(asked: &[Asked]) -> usize {
        asked.iter().map(|(_, _, views)| views).sum()
    }

    #[test]
    fn a_fast_compositor_takes_all_that_a_slow_one_has_not_been_asked_for() {
        let mut started = start(1, 100, 2);
        let [fast, slow] = [0, 1];
        assert_eq!(waiting(&mut started, fast), [(0, 0, 16), (0, 32, 16)]);
        assert_eq!(waiting(&mut started, slow), [(0, 16, 16), (0, 48, 16)]);
        let asked = receive(&mut started, fast, 68, 15);
        assert_eq!(asked[0], (0, 64, 16));
        assert_eq!(views_of(&asked), 36);
        assert!(has_ended(&started, fast));
        assert_eq!(receive(&mut started, slow, 32, 100), []);
        assert!(has_ended(&started, slow));
    }

    #[test]
    fn a_message_is_of_one_set_and_shrinks_for_a_slow_compositor() {
        let mut started = start(3, 40, 1);
        let asked = [waiting(&mut started, 0), receive(&mut started, 0, 120, 100)].concat();
        assert_eq!(views_of(&asked), 120);
        assert!(asked.is_sorted_by_key(|(set, ..)| *set));
        assert!(asked.iter().skip(3).all(|(_, _, views)| *views <= 8), "{asked:?}");
    }

    #[test]
    fn small_sets_are_requested_in_many_messages() {
        assert_eq!(waiting(&mut start(100, 1, 1), 0).len(), 17, "of one view each: as many as fit into two messages");
    }

    #[test]
    fn a_compositor_that_is_left_without_views_is_not_called() {
        assert_eq!(start(1, 1, 3).messages.iter().flatten().count(), 1);
        assert_eq!(start(0, 0, 2).messages.iter().flatten().count(), 0);
    }

    #[test]
    fn many_views_are_drawn_as_they_are_received() {
        let mut started = start(100, 1000, 1);
        let mut asked = waiting(&mut started, 0);
        for views in 1..=100_000 {
            assert!(started.batch.lock().queue.waiting() < 2 * LEAST_AHEAD_VIEWS);
            asked.extend(receive(&mut started, 0, 1, views));
        }
        assert_eq!(views_of(&asked), 100_000);
        assert!(asked.is_sorted_by_key(|(_, frame, _)| *frame));
        assert!(has_ended(&started, 0));
    }
}
