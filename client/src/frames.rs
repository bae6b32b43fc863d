//! The frames of one request, as the caller takes them.

use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;

use crate::active_plan::SessionState;
use crate::delivery::{Template, deliver};
use crate::error::ClientError;
use crate::expected::Expected;
use crate::frame_sink::{FrameSink, Received};
use crate::view_request::{Frame, ViewRequest};

/// Decoded frames that the caller has not taken yet.
const FRAMES_AHEAD: usize = 32;

/// The frames of one request, in the order they are ready.
#[derive(Debug)]
pub struct Frames {
    received: mpsc::Receiver<Received>,
    expected: Arc<Mutex<Expected>>,
    has_failed: bool,
    /// Dropped with the frames: the calls then end too.
    _delivery: JoinSet<()>,
}

impl Frames {
    pub(crate) fn start(
        state: watch::Receiver<SessionState>,
        template: Template,
        requests: Vec<ViewRequest>,
        expected: Expected,
    ) -> Self {
        let (send, received) = mpsc::channel(FRAMES_AHEAD);
        let expected = Arc::new(Mutex::new(expected));
        let sink = FrameSink::new(send, expected.clone());
        let mut delivery = JoinSet::new();
        delivery.spawn(deliver(state, template, requests, sink));
        Self { received, expected, has_failed: false, _delivery: delivery }
    }

    /// The next frame; `None` when all have been received.
    ///
    /// # Errors
    /// The first failure of any compositor, a frame that was not requested, or, at the end, the frames that are missing.
    /// Nothing follows an error.
    pub async fn next(&mut self) -> Option<Result<Frame, ClientError>> {
        if self.has_failed {
            return None;
        }
        let next = match self.received.recv().await {
            Some(received) => received.map(Some),
            None => self.expected.lock().finish().map(|()| None),
        };
        self.has_failed = next.is_err();
        next.transpose()
    }

    /// All frames.
    ///
    /// # Errors
    /// As [`Frames::next`].
    pub async fn all(mut self) -> Result<Vec<Frame>, ClientError> {
        let mut frames = Vec::new();
        while let Some(frame) = self.next().await {
            frames.push(frame?);
        }
        Ok(frames)
    }
}
