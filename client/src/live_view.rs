//! What a viewer sees that moves.

use std::time::Instant;

use codec::FrameCodec;
use depth_image::{PinholeCamera, ViewPlanes};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;

use crate::frames::Frame;
use crate::live::State;
use crate::live_stream::{LiveStream, Newest, Received, decode_all};
use crate::poses::{CREDITS, Pose};
use crate::session::check;
use crate::{ClientError, ViewRequest};

/// A frame, and when what happened to it here.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveFrame {
    /// The frame; its number rises.
    pub frame: Frame,
    /// Here. What happened elsewhere is in the frame's header.
    pub times: LiveTimes,
}

/// Times on this machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveTimes {
    /// The pose was given.
    pub looked: Instant,
    /// It was sent.
    pub sent: Instant,
    /// The frame was here.
    pub came: Instant,
    /// It was decoded.
    pub decoded: Instant,
}

/// Frames of a camera that moves: poses in, frames out. A newer pose takes the place of one that is not being made yet,
/// wherever that is; two frames at most are on their way or not taken by [`LiveView::next`]. It outlives compositors and
/// plans, and ends with its session.
#[derive(Debug)]
pub struct LiveView {
    says: watch::Sender<Newest>,
    frames: mpsc::Receiver<Received>,
    state: watch::Receiver<State>,
    last: u64,
    /// Dropped with the view: its stream then ends.
    _tasks: JoinSet<()>,
}

impl LiveView {
    pub(crate) fn start(state: watch::Receiver<State>, codec: FrameCodec, planes: ViewPlanes) -> Self {
        let (says, newest) = watch::channel(Newest::default());
        let (encoded, to_decode) = mpsc::channel(CREDITS);
        let (decoded, frames) = mpsc::channel(CREDITS);
        let stream = LiveStream::new(state.clone(), newest, (codec, planes), encoded);
        let mut tasks = JoinSet::new();
        tasks.spawn(stream.run());
        tasks.spawn(decode_all(to_decode, decoded));
        Self { says, frames, state, last: 0, _tasks: tasks }
    }

    /// Looks from here, at this set of the timeline, from now on; gives the frame's number, from 1. Takes the place of the
    /// pose before, if that is not being made yet.
    ///
    /// # Errors
    /// For a set beyond the timeline, a bad camera, and a session that has ended.
    pub fn look(&mut self, camera: PinholeCamera, set_index: u32) -> Result<u64, ClientError> {
        let request = ViewRequest { frame: self.last + 1, set_index, camera };
        let State { live, ended, .. } = self.state.borrow().clone();
        if let Some(reason) = ended {
            return Err(ClientError::Ended { reason });
        }
        check(&request, &live)?;
        self.last = request.frame;
        let pose = Pose { request, looked: Instant::now() };
        self.says.send_modify(|newest| newest.pose = Some(pose));
        Ok(request.frame)
    }

    /// The next frame. Its number is above that of the one before; those between were replaced by newer poses. Can be
    /// given up and called again without losing one.
    ///
    /// # Errors
    /// What no other compositor could do better: a request that cannot be, no room anywhere, a session that has ended,
    /// a plan without a compositor that answers. Nothing comes after an error.
    pub async fn next(&mut self) -> Result<LiveFrame, ClientError> {
        let over = || ClientError::Ended { reason: "the view has ended".to_owned() };
        let frame = self.frames.recv().await.ok_or_else(over)??;
        let number = frame.frame.request.frame;
        self.says.send_modify(|newest| newest.taken = number);
        Ok(frame)
    }
}
