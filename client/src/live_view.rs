//! Live views: poses in, frames out, decoded or as they came.

use std::time::Instant;

use depth_image::PinholeCamera;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;

use crate::active_plan::SessionState;
use crate::error::ClientError;
use crate::live_stream::{LiveStream, Received, decode_all};
use crate::placement::ClientId;
use crate::poses::{CREDITS, Newest, Pose};
use crate::view_request::{EncodedFrame, LiveFrame, PictureQuality, ViewRequest};

/// Frames of a camera that moves. A newer pose replaces one that is not being made yet. Two frames at most are on their way
/// or not taken by [`LiveView::next`]. A live view outlives compositors and plans, and ends with its session.
#[derive(Debug)]
pub struct LiveView {
    posing: Posing,
    frames: mpsc::Receiver<Result<LiveFrame, ClientError>>,
    /// Dropped with the view: its stream then ends.
    _tasks: JoinSet<()>,
}

/// Frames of a camera that moves, as they came: for a caller that passes them on. Each pose has a quality of its own. Two frames
/// at most are on their way or not confirmed by [`EncodedLiveView::confirm`]; otherwise it is as a [`LiveView`].
#[derive(Debug)]
pub struct EncodedLiveView {
    posing: Posing,
    frames: EncodedFrames,
    /// Dropped with the view: its stream then ends.
    _tasks: JoinSet<()>,
}

type EncodedFrames = mpsc::Receiver<Received>;

/// The poses of a view.
#[derive(Debug)]
struct Posing {
    newest: watch::Sender<Newest>,
    state: watch::Receiver<SessionState>,
    last: u64,
}

impl Posing {
    /// Starts the stream of a client's view as one of `tasks`; gives its frames, too.
    fn start(client: ClientId, state: watch::Receiver<SessionState>, tasks: &mut JoinSet<()>) -> (Self, EncodedFrames) {
        let (newest, to_send) = watch::channel(Newest::default());
        let (encoded, frames) = mpsc::channel(CREDITS);
        tasks.spawn(LiveStream::run(client, state.clone(), to_send, encoded));
        (Self { newest, state, last: 0 }, frames)
    }

    fn set(
        &mut self,
        camera: PinholeCamera,
        set_index: u32,
        quality: Option<PictureQuality>,
    ) -> Result<u64, ClientError> {
        let request = ViewRequest { frame: self.last + 1, set_index, camera };
        request.check(self.state.borrow().active.plan.assignment.workload.timeline.set_count)?;
        self.last = request.frame;
        let pose = Pose { request, quality, posed: Instant::now() };
        self.newest.send_modify(|newest| newest.pose = Some(pose));
        Ok(request.frame)
    }

    /// All frames up to this one have been taken.
    fn taken(&self, frame: u64) {
        self.newest.send_modify(|newest| newest.taken = newest.taken.max(frame));
    }
}

/// The next frame of a view, or the error that ends it.
async fn next<F>(frames: &mut mpsc::Receiver<Result<F, ClientError>>) -> Result<F, ClientError> {
    frames.recv().await.unwrap_or_else(|| Err(ClientError::ended("the view has ended")))
}

impl LiveView {
    pub(crate) fn start(state: watch::Receiver<SessionState>) -> Self {
        let mut tasks = JoinSet::new();
        let (posing, encoded) = Posing::start(ClientId::new(), state, &mut tasks);
        let (decoded, frames) = mpsc::channel(CREDITS);
        tasks.spawn(decode_all(encoded, decoded));
        Self { posing, frames, _tasks: tasks }
    }

    /// Shows this set of the timeline from this pose from now on; gives the frame's number, from 1. Replaces the pose before,
    /// if that is not being made yet.
    ///
    /// # Errors
    /// For a set beyond the timeline, and a bad camera.
    pub fn set_pose(&mut self, camera: PinholeCamera, set_index: u32) -> Result<u64, ClientError> {
        self.posing.set(camera, set_index, None)
    }

    /// The next frame. Its number is above that of the one before; those between were replaced by newer poses. Cancellation
    /// loses no frame. A frame from a neighbouring view cell is followed by another of the same pose.
    ///
    /// # Errors
    /// For an invalid request, no room anywhere, a session that has ended, and a plan without a compositor that answers.
    /// Nothing follows an error.
    pub async fn next(&mut self) -> Result<LiveFrame, ClientError> {
        let frame = next(&mut self.frames).await?;
        let ViewRequest { frame: number, set_index, camera } = frame.frame.request;
        self.posing.taken(number);
        // A viewer that rests would see a neighbouring cell's picture for ever.
        if frame.frame.header.is_neighbour_cell && number == self.posing.last {
            self.set_pose(camera, set_index)?;
        }
        Ok(frame)
    }
}

impl EncodedLiveView {
    pub(crate) fn start(client: ClientId, state: watch::Receiver<SessionState>) -> Self {
        let mut tasks = JoinSet::new();
        let (posing, frames) = Posing::start(client, state, &mut tasks);
        Self { posing, frames, _tasks: tasks }
    }

    /// As [`LiveView::set_pose`], in this quality.
    ///
    /// # Errors
    /// As [`LiveView::set_pose`].
    pub fn set_pose(
        &mut self,
        camera: PinholeCamera,
        set_index: u32,
        quality: PictureQuality,
    ) -> Result<u64, ClientError> {
        self.posing.set(camera, set_index, Some(quality))
    }

    /// The next frame, as [`LiveView::next`]. None follows a frame from a neighbouring view cell: the caller may set its pose
    /// again.
    ///
    /// # Errors
    /// As [`LiveView::next`].
    pub async fn next(&mut self) -> Result<EncodedFrame, ClientError> {
        Ok(next(&mut self.frames).await?.0)
    }

    /// All frames up to this number have been shown, or are of no use. Others come only then.
    pub fn confirm(&self, frame: u64) {
        self.posing.taken(frame);
    }
}
