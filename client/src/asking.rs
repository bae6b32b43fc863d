//! Asking compositors for the views of a batch: little at a time, and the next when that has come.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use wire::limits::MAX_VIEWS_PER_REQUEST;
use wire::{Asked, Deal, RenderViews, RequestedView};

use crate::session::ViewRequest;

/// Room for the messages to one compositor: two of the largest, if all had one view.
const MESSAGES: usize = 2 * MAX_VIEWS_PER_REQUEST;

/// What all compositors of a plan are asked for together.
#[derive(Debug)]
struct Batch {
    template: RenderViews,
    requests: Vec<ViewRequest>,
    deal: Mutex<Deal>,
}

impl Batch {
    fn new(template: RenderViews, requests: Vec<ViewRequest>, weights: &[u32]) -> Self {
        let runs = requests.chunk_by(|a, b| a.set_index == b.set_index).map(<[ViewRequest]>::len);
        let deal = Mutex::new(Deal::new(runs, weights));
        Self { template, requests, deal }
    }

    fn deal(&self) -> MutexGuard<'_, Deal> {
        self.deal.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One compositor's part in a batch.
#[derive(Debug)]
pub(crate) struct Asking {
    batch: Arc<Batch>,
    compositor: usize,
    asked: Asked,
    /// None when there is nothing left to ask for: the stream of messages then ends.
    send: Option<mpsc::Sender<RenderViews>>,
    start: Instant,
}

/// The parts of all compositors of these weights, with the messages to them; `None` for those that have no share. A view
/// takes about so many seconds; 0 where that is not known.
pub(crate) fn begin(
    template: &RenderViews,
    requests: Vec<ViewRequest>,
    weights: &[u32],
    view_s: f64,
) -> Vec<Option<(Asking, ReceiverStream<RenderViews>)>> {
    let batch = Arc::new(Batch::new(template.clone(), requests, weights));
    (0..weights.len()).map(|compositor| Asking::begin(&batch, compositor, view_s)).collect()
}

impl Asking {
    /// With the first messages, of the compositor's own share alone: others have not begun yet.
    fn begin(batch: &Arc<Batch>, compositor: usize, view_s: f64) -> Option<(Self, ReceiverStream<RenderViews>)> {
        let (send, sent) = mpsc::channel(MESSAGES);
        let (asked, start) = (Asked::new(view_s), Instant::now());
        let mut asking = Self { batch: batch.clone(), compositor, asked, send: Some(send), start };
        while let Some(most) = asking.asked.room() {
            let Some(views) = batch.deal().take_own(compositor, most) else { break };
            asking.ask(views);
        }
        (!asking.asked.is_empty()).then(|| (asking, ReceiverStream::new(sent)))
    }

    pub(crate) fn plan_epoch(&self) -> u64 {
        self.batch.template.plan_epoch
    }

    /// A view has come; where there is room for a message, it is sent.
    pub(crate) fn came(&mut self, now: Instant, waited_for_set: bool) {
        self.asked.came((now - self.start).as_secs_f64(), waited_for_set);
        while let Some(most) = self.asked.room() {
            let Some(views) = self.batch.deal().take(self.compositor, most) else {
                self.send = None;
                return;
            };
            self.ask(views);
        }
    }

    fn ask(&mut self, places: Range<usize>) {
        let requests = &self.batch.requests[places];
        let (Some(first), Some(send)) = (requests.first(), &self.send) else { return };
        let views = requests.iter().map(|view| RequestedView { frame: view.frame, camera: view.camera }).collect();
        self.asked.ask(requests.len());
        // There is room for all that are under way: an error means that the call has ended.
        let _ = send.try_send(RenderViews { set_index: first.set_index, views, ..self.batch.template.clone() });
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use depth_image::{PinholeCamera, ViewPlanes};
    use glam::{UVec2, Vec3};
    use wire::FrameCodec;

    use super::*;

    fn template() -> RenderViews {
        RenderViews {
            plan_epoch: 3,
            set_index: 0,
            method: String::new(),
            codec: FrameCodec::Lz4,
            planes: ViewPlanes::default(),
            views: Vec::new(),
            live: None,
        }
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

    /// Views come so many milliseconds apart, from so many milliseconds on; what is asked for meanwhile.
    fn come(
        (asking, sent): &mut (Asking, ReceiverStream<RenderViews>),
        views: u64,
        (from_ms, apart_ms): (u64, u64),
    ) -> Vec<(u32, u64, usize)> {
        let start = asking.start;
        let asked = (1..=views).flat_map(|view| {
            asking.came(start + Duration::from_millis(from_ms + view * apart_ms), false);
            waiting(sent)
        });
        asked.collect()
    }

    /// As fast as was thought.
    const VIEW_S: f64 = 0.0156;

    #[test]
    fn all_begin_with_their_own_and_help_who_is_slow() {
        let mut parts = begin(&template(), requests(1, 100), &[1, 1], VIEW_S);
        let (mut slow, mut fast) = (parts.remove(1).unwrap(), parts.remove(0).unwrap());
        assert_eq!(waiting(&mut fast.1), [(0, 0, 16), (0, 16, 16)]);
        assert_eq!(waiting(&mut slow.1), [(0, 50, 16), (0, 66, 16)]);
        let asked = come(&mut fast, 68, (0, 15));
        assert_eq!(asked[..2], [(0, 32, 16), (0, 48, 2)]);
        let views: usize = asked.iter().map(|(_, _, views)| views).sum();
        assert_eq!(views, 18 + 18, "its own, and all that the slow one has not been asked for");
        assert!(fast.0.send.is_none() && fast.0.asked.is_empty(), "its stream ends");
        assert_eq!(come(&mut slow, 32, (0, 100)), []);
        assert!(slow.0.send.is_none());
    }

    #[test]
    fn messages_are_of_one_set_and_as_many_as_suit_the_pace() {
        let mut part = begin(&template(), requests(3, 40), &[9], VIEW_S).remove(0).unwrap();
        let asked = [waiting(&mut part.1), come(&mut part, 120, (0, 100))].concat();
        assert_eq!(asked.iter().map(|(_, _, views)| views).sum::<usize>(), 120);
        assert!(asked.is_sorted_by_key(|(set, ..)| *set));
        assert!(asked.iter().skip(3).all(|(_, _, views)| *views <= 8), "{asked:?}");
    }

    #[test]
    fn of_small_sets_many_are_under_way() {
        let mut part = begin(&template(), requests(100, 1), &[1], VIEW_S).remove(0).unwrap();
        assert_eq!(waiting(&mut part.1).len(), 17, "of one view each: as many as fit into two messages");
    }

    #[test]
    fn who_has_no_share_is_not_called() {
        let called = begin(&template(), requests(1, 1), &[1, 1, 1], 0.0).iter().filter(|part| part.is_some()).count();
        assert_eq!(called, 1);
        assert!(begin(&template(), Vec::new(), &[1, 1], 0.0).iter().all(Option::is_none));
    }
}
