//! Requests for the views of a batch, to every compositor: a little at a time, and more as views are received.

use std::sync::Arc;
use std::time::Instant;

use cluster::limits::MAX_VIEWS_PER_REQUEST;
use cluster::{RenderViews, RequestedView};
use parking_lot::Mutex;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use crate::flow_control::FlowControl;
use crate::unrequested::Unrequested;
use crate::view_request::ViewRequest;

/// Room for the messages to one compositor: two of the largest, if all had one view.
const MESSAGES: usize = 2 * MAX_VIEWS_PER_REQUEST;

/// The batch that all compositors of a plan make together.
#[derive(Debug)]
struct Batch {
    template: RenderViews,
    views: Mutex<Unrequested>,
}

/// Requests one compositor's views of a batch.
#[derive(Debug)]
pub(crate) struct RequestPump {
    batch: Arc<Batch>,
    compositor: usize,
    flow: FlowControl,
    /// `None` when no views are left to request: the stream of messages then ends.
    messages: Option<mpsc::Sender<RenderViews>>,
    start: Instant,
}

/// A pump that has been started, and its messages.
pub(crate) type Started = (RequestPump, ReceiverStream<RenderViews>);

/// The pumps of `compositors`; `None` for a compositor without a share of the first views. A view takes about `view_s`; `None`
/// where that is not known.
pub(crate) fn start_pumps(
    template: RenderViews,
    views: Unrequested,
    compositors: usize,
    view_s: Option<f64>,
) -> Vec<Option<Started>> {
    let batch = Arc::new(Batch { template, views: Mutex::new(views) });
    (0..compositors).map(|compositor| RequestPump::start(&batch, compositor, view_s)).collect()
}

impl RequestPump {
    /// The first messages are of the compositor's own share alone: other compositors have not begun yet.
    fn start(batch: &Arc<Batch>, compositor: usize, view_s: Option<f64>) -> Option<Started> {
        let (messages, sent) = mpsc::channel(MESSAGES);
        let (flow, start) = (FlowControl::new(view_s), Instant::now());
        let mut pump = Self { batch: batch.clone(), compositor, flow, messages: Some(messages), start };
        while let Some(most) = pump.flow.room() {
            let Some(views) = batch.views.lock().take_local(compositor, most) else { break };
            pump.request(views);
        }
        (!pump.flow.is_empty()).then(|| (pump, ReceiverStream::new(sent)))
    }

    pub(crate) fn plan_epoch(&self) -> u64 {
        self.batch.template.plan_epoch
    }

    /// Counts a view as received, and requests more where there is room.
    pub(crate) fn received(&mut self, now: Instant, waited_for_set: bool) {
        self.flow.received((now - self.start).as_secs_f64(), waited_for_set);
        while let Some(most) = self.flow.room() {
            let Some(views) = self.batch.views.lock().take(self.compositor, most) else {
                self.messages = None;
                return;
            };
            self.request(views);
        }
    }

    fn request(&mut self, requests: Vec<ViewRequest>) {
        let (Some(first), Some(messages)) = (requests.first(), &self.messages) else { return };
        let views = requests.iter().map(|view| RequestedView { frame: view.frame, camera: view.camera }).collect();
        self.flow.sent(requests.len());
        // There is room for all messages in flight: an error means that the call has ended.
        let _ = messages.try_send(RenderViews { set_index: first.set_index, views, ..self.batch.template.clone() });
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use codec::FrameCodec;
    use depth_image::{PinholeCamera, ViewPlanes};
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::window::{LEAST_AHEAD_VIEWS, Window};

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

    /// Started pumps for some views of each set, for compositors of these weights.
    fn start(sets: u32, views: u64, weights: &[u32], view_s: Option<f64>) -> Vec<Option<Started>> {
        let window = Window::open(requests(sets, views).into_iter(), sets, ViewPlanes::default()).unwrap();
        let views = Unrequested::new(Arc::new(Mutex::new(window)), weights, Box::new(|_| ()));
        start_pumps(template(), views, weights.len(), view_s)
    }

    fn requests(sets: u32, views: u64) -> Vec<ViewRequest> {
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8));
        let of_set = |set_index| (0..views).map(move |view| (set_index, u64::from(set_index) * views + view));
        (0..sets).flat_map(of_set).map(|(set_index, frame)| ViewRequest { frame, set_index, camera }).collect()
    }

    /// Messages that wait to be sent: their set and first frame, and how many views.
    fn waiting(sent: &mut ReceiverStream<RenderViews>) -> Vec<(u32, u64, usize)> {
        let message = |views: RenderViews| (views.set_index, views.views[0].frame, views.views.len());
        std::iter::from_fn(|| sent.as_mut().try_recv().ok()).map(message).collect()
    }

    /// Receives views `apart_ms` apart; gives the requests that are sent meanwhile.
    fn receive((pump, sent): &mut Started, views: u64, apart_ms: u64) -> Vec<(u32, u64, usize)> {
        let start = pump.start;
        let requested = (1..=views).flat_map(|view| {
            pump.received(start + Duration::from_millis(view * apart_ms), false);
            waiting(sent)
        });
        requested.collect()
    }

    /// The expected time of a view.
    const VIEW_S: Option<f64> = Some(0.0156);

    #[test]
    fn a_fast_compositor_finishes_its_share_and_steals_from_a_slow_one() {
        let mut parts = start(1, 100, &[1, 1], VIEW_S);
        let (mut slow, mut fast) = (parts.remove(1).unwrap(), parts.remove(0).unwrap());
        assert_eq!(waiting(&mut fast.1), [(0, 0, 16), (0, 16, 16)]);
        assert_eq!(waiting(&mut slow.1), [(0, 50, 16), (0, 66, 16)]);
        let asked = receive(&mut fast, 68, 15);
        assert_eq!(asked[..2], [(0, 32, 16), (0, 48, 2)]);
        let views: usize = asked.iter().map(|(_, _, views)| views).sum();
        assert_eq!(views, 18 + 18, "its own, and all that the slow one has not been asked for");
        assert!(fast.0.messages.is_none() && fast.0.flow.is_empty(), "its stream ends");
        assert_eq!(receive(&mut slow, 32, 100), []);
        assert!(slow.0.messages.is_none());
    }

    #[test]
    fn a_message_is_of_one_set_and_shrinks_for_a_slow_compositor() {
        let mut part = start(3, 40, &[9], VIEW_S).remove(0).unwrap();
        let asked = [waiting(&mut part.1), receive(&mut part, 120, 100)].concat();
        assert_eq!(asked.iter().map(|(_, _, views)| views).sum::<usize>(), 120);
        assert!(asked.is_sorted_by_key(|(set, ..)| *set));
        assert!(asked.iter().skip(3).all(|(_, _, views)| *views <= 8), "{asked:?}");
    }

    #[test]
    fn small_sets_are_requested_in_many_messages() {
        let mut part = start(100, 1, &[1], VIEW_S).remove(0).unwrap();
        assert_eq!(waiting(&mut part.1).len(), 17, "of one view each: as many as fit into two messages");
    }

    #[test]
    fn a_compositor_without_a_share_is_not_called() {
        let called = start(1, 1, &[1, 1, 1], None).iter().filter(|part| part.is_some()).count();
        assert_eq!(called, 1);
        assert!(start(0, 0, &[1, 1], None).iter().all(Option::is_none));
    }

    #[test]
    fn many_views_are_drawn_as_they_are_received() {
        let mut part = start(100, 1000, &[1], VIEW_S).remove(0).unwrap();
        let mut asked = waiting(&mut part.1);
        for views in 1..=100_000 {
            let unrequested = part.0.batch.views.lock().shares_and_views();
            assert!(unrequested.iter().all(|&views| views < 2 * LEAST_AHEAD_VIEWS), "{unrequested:?}");
            asked.extend(receive(&mut part, 1, views));
        }
        assert_eq!(asked.iter().map(|(_, _, views)| views).sum::<usize>(), 100_000);
        assert!(asked.is_sorted_by_key(|(_, frame, _)| *frame));
        assert!(part.0.messages.is_none());
    }
}
