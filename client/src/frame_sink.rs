//! The way of decoded frames to the caller, each once.

use std::sync::Arc;
use std::thread::available_parallelism;

use codec::{FrameHeader, WholeFrame};
use depth_image::View;
use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};

use crate::error::ClientError;
use crate::expected::Expected;
use crate::view_request::{Frame, ViewRequest};

/// A frame for the caller, or the error that ends its request.
pub(crate) type Received = Result<Frame, ClientError>;

/// Takes the frames of one request. Clones share them.
#[derive(Clone)]
pub(crate) struct FrameSink {
    received: mpsc::Sender<Received>,
    expected: Arc<Mutex<Expected>>,
    decoders: Arc<Semaphore>,
}

impl FrameSink {
    pub(crate) fn new(received: mpsc::Sender<Received>, expected: Arc<Mutex<Expected>>) -> Self {
        let decoders = Arc::new(Semaphore::new(available_parallelism().map_or(1, usize::from)));
        Self { received, expected, decoders }
    }

    /// The fault of a frame under a plan of this epoch; `None` for a good frame.
    pub(crate) fn fault_of(&self, frame: &WholeFrame, plan_epoch: u64) -> Option<String> {
        let (number, set) = (frame.frame, frame.header.sample_set_id);
        if set.plan_epoch != plan_epoch {
            return Some(format!("sent a frame of set {set}"));
        }
        let fault = self.expected.lock().fault_of(number, &frame.header);
        fault.map(|fault| format!("sent frame {number}, which {fault}"))
    }

    /// The requests whose frames are still missing.
    pub(crate) fn missing(&self, requests: &[ViewRequest]) -> Vec<ViewRequest> {
        let expected = self.expected.lock();
        requests.iter().filter(|request| expected.is_due(request.frame)).copied().collect()
    }

    /// Room for one more frame that is decoded; `None` when the request has ended.
    pub(crate) async fn decoder(&self) -> Option<OwnedSemaphorePermit> {
        self.decoders.clone().acquire_owned().await.ok()
    }

    /// Passes a frame on once there is room; a frame that was received twice counts once. A slow caller thereby holds up
    /// the decoding.
    pub(crate) async fn pass_on(&self, frame: u64, header: FrameHeader, view: View) {
        // An error means that the caller has left. Room comes first: nothing can end the call between the next two lines.
        let Ok(room) = self.received.reserve().await else { return };
        let Some(request) = self.expected.lock().take(frame) else { return };
        room.send(Ok(Frame { request, view, header }));
    }

    /// Whether all room for frames is taken: the caller takes none.
    pub(crate) fn is_full(&self) -> bool {
        self.received.capacity() == 0
    }

    /// Waits until the caller takes frames again; false if it has left.
    pub(crate) async fn wait_for_room(&self) -> bool {
        self.received.reserve().await.is_ok()
    }

    /// Ends the request.
    pub(crate) async fn fail(&self, error: ClientError) {
        let _ = self.received.send(Err(error)).await;
    }
}
