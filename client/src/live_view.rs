//! Live views: poses in, frames out, decoded or as they came.

use std::time::Instant;

use depth_image::PinholeCamera;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;

use crate::active_plan::SessionState;
use crate::error::ClientError;
use crate::live_stream::{Encoded, LiveStream, decode_all};
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
    frames: mpsc::Receiver<Result<Encoded, ClientError>>,
    /// Dropped with the view: its stream then ends.
    _tasks: JoinSet<()>,
}

/// The poses of a view.
#[derive(Debug)]
struct Posing {
    newest: watch::Sender<Newest>,
    state: watch::Receiver<SessionState>,
    last: u64,
}

impl Posing {
    fn start(state: watch::Receiver<SessionState>, stream: impl FnOnce(watch::Receiver<Newest>)) -> Self {
        let (newest, to_send) = watch::channel(Newest::default());
        stream(to_send);
        Self { newest, state, last: 0 }
    }

    fn set(
        &mut self,
        camera: PinholeCamera,
        set_index: u32,
        quality: Option<PictureQuality>,
    ) -> Result<u64, ClientError> {
        let request = ViewRequest { frame: self.last + 1, set_index, camera };
        request.check(&self.state.borrow().active.plan.assignment)?;
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

fn over() -> ClientError {
    ClientError::Ended { reason: "the view has ended".to_owned() }
}

impl LiveView {
    pub(crate) fn start(state: watch::Receiver<SessionState>) -> Self {
        let (encoded, to_decode) = mpsc::channel(CREDITS);
        let (decoded, frames) = mpsc::channel(CREDITS);
        let mut tasks = JoinSet::new();
        tasks.spawn(decode_all(to_decode, decoded));
        let posing = Posing::start(state.clone(), |newest| {
            tasks.spawn(LiveStream::run(ClientId::new(), state, newest, encoded));
        });
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
        let frame = self.frames.recv().await.ok_or_else(over)??;
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
        let (encoded, frames) = mpsc::channel(CREDITS);
        let mut tasks = JoinSet::new();
        let posing = Posing::start(state.clone(), |newest| {
            tasks.spawn(LiveStream::run(client, state, newest, encoded));
        });
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
        Ok(self.frames.recv().await.ok_or_else(over)??.into_frame())
    }

    /// All frames up to this number have been shown, or are of no use. Others come only then.
    pub fn confirm(&self, frame: u64) {
        self.posing.taken(frame);
    }
}
