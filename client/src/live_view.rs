//! Live views: poses in, frames out.

use std::time::Instant;

use depth_image::PinholeCamera;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;

use crate::active_plan::SessionState;
use crate::error::ClientError;
use crate::live_stream::{LiveStream, decode_all};
use crate::poses::{CREDITS, Newest, Pose};
use crate::view_request::{LiveFrame, ViewRequest};

/// Frames of a camera that moves. A newer pose replaces one that is not being made yet. Two frames at most are on their way
/// or not taken by [`LiveView::next`]. A live view outlives compositors and plans, and ends with its session.
#[derive(Debug)]
pub struct LiveView {
    newest: watch::Sender<Newest>,
    frames: mpsc::Receiver<Result<LiveFrame, ClientError>>,
    state: watch::Receiver<SessionState>,
    last: u64,
    /// Dropped with the view: its stream then ends.
    _tasks: JoinSet<()>,
}

impl LiveView {
    pub(crate) fn start(state: watch::Receiver<SessionState>) -> Self {
        let (newest, to_send) = watch::channel(Newest::default());
        let (encoded, to_decode) = mpsc::channel(CREDITS);
        let (decoded, frames) = mpsc::channel(CREDITS);
        let mut tasks = JoinSet::new();
        tasks.spawn(LiveStream::run(state.clone(), to_send, encoded));
        tasks.spawn(decode_all(to_decode, decoded));
        Self { newest, frames, state, last: 0, _tasks: tasks }
    }

    /// Shows this set of the timeline from this pose from now on; gives the frame's number, from 1. Replaces the pose before,
    /// if that is not being made yet.
    ///
    /// # Errors
    /// For a set beyond the timeline, and a bad camera.
    pub fn set_pose(&mut self, camera: PinholeCamera, set_index: u32) -> Result<u64, ClientError> {
        let request = ViewRequest { frame: self.last + 1, set_index, camera };
        request.check(&self.state.borrow().active.plan.assignment)?;
        self.last = request.frame;
        let pose = Pose { request, posed: Instant::now() };
        self.newest.send_modify(|newest| newest.pose = Some(pose));
        Ok(request.frame)
    }

    /// The next frame. Its number is above that of the one before; those between were replaced by newer poses. Cancellation
    /// loses no frame. A frame from a neighbouring view cell is followed by another of the same pose.
    ///
    /// # Errors
    /// For an invalid request, no room anywhere, a session that has ended, and a plan without a compositor that answers.
    /// Nothing follows an error.
    pub async fn next(&mut self) -> Result<LiveFrame, ClientError> {
        let over = || ClientError::Ended { reason: "the view has ended".to_owned() };
        let frame = self.frames.recv().await.ok_or_else(over)??;
        let number = frame.frame.request.frame;
        self.newest.send_modify(|newest| newest.taken = number);
        // A viewer that rests would see a neighbouring cell's picture for ever.
        if frame.frame.header.is_neighbour_cell && number == self.last {
            let ViewRequest { camera, set_index, .. } = frame.frame.request;
            self.set_pose(camera, set_index)?;
        }
        Ok(frame)
    }
}
