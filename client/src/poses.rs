//! Poses on their way, and the frames that answer them.

use std::collections::VecDeque;
use std::time::Instant;

use crate::view_request::{PictureQuality, ViewRequest};

/// Frames that may be on their way, or received and not taken.
pub(crate) const CREDITS: usize = 2;
/// Poses that were sent and not answered; while there are this many, no more are sent.
const MAX_SENT: usize = 64;

/// A pose that was given.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pose {
    pub(crate) request: ViewRequest,
    /// `None`: the session's.
    pub(crate) quality: Option<PictureQuality>,
    pub(crate) posed: Instant,
}

/// A pose that was sent.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SentPose {
    pub(crate) pose: Pose,
    pub(crate) sent: Instant,
}

/// The viewer's last word.
#[derive(Debug, Clone, Default)]
pub(crate) struct Newest {
    pub(crate) pose: Option<Pose>,
    /// The last frame that the viewer has taken.
    pub(crate) taken: u64,
}

/// The poses of one stream after the other. Where a stream ends without an answer to the newest pose, the next stream is
/// asked for it.
#[derive(Debug, Default)]
pub(crate) struct Poses {
    sent: VecDeque<SentPose>,
    /// The last frame that was received.
    answered: u64,
    /// Frames that are received and not taken, of earlier streams, too.
    untaken: VecDeque<u64>,
}

impl Poses {
    /// Another stream begins.
    pub(crate) fn begin_stream(&mut self) {
        self.sent.clear();
    }

    /// Whether a pose is to be sent.
    pub(crate) fn wants(&self, pose: &Pose) -> bool {
        let last = self.sent.back().map_or(self.answered, |sent| sent.pose.request.frame);
        pose.request.frame > last && self.sent.len() < MAX_SENT && self.untaken.len() < CREDITS
    }

    /// The viewer has taken all frames up to this one.
    pub(crate) fn taken(&mut self, frame: u64) {
        while self.untaken.front().is_some_and(|untaken| *untaken <= frame) {
            self.untaken.pop_front();
        }
    }

    pub(crate) fn sent(&mut self, pose: Pose) {
        self.sent.push_back(SentPose { pose, sent: Instant::now() });
    }

    /// The pose that a frame answers; poses before it were replaced by newer ones. `None` for a frame that was not
    /// requested, or follows a later one.
    pub(crate) fn answer(&mut self, frame: u64) -> Option<SentPose> {
        let at = self.sent.iter().position(|sent| sent.pose.request.frame == frame)?;
        self.answered = frame;
        self.untaken.push_back(frame);
        self.sent.drain(..=at).next_back()
    }
}

#[cfg(test)]
mod tests {
    use depth_image::PinholeCamera;

    use super::*;

    fn pose(frame: u64) -> Pose {
        let eye = [0.0, 0.0, 1.0].into();
        let up = [0.0, 1.0, 0.0].into();
        let camera = PinholeCamera::looking_at(eye, [0.0; 3].into(), up, 1.0, [8, 8].into());
        Pose { request: ViewRequest { frame, set_index: 0, camera }, quality: None, posed: Instant::now() }
    }

    #[test]
    fn a_frame_after_a_later_one_answers_nothing() {
        let mut poses = Poses::default();
        (1..=4).for_each(|frame| poses.sent(pose(frame)));
        assert_eq!(poses.answer(3).unwrap().pose.request.frame, 3);
        assert!(poses.answer(2).is_none() && poses.answer(3).is_none(), "a later one was received");
        assert!(poses.answer(9).is_none(), "it was never requested");
        assert_eq!(poses.answer(4).unwrap().pose.request.frame, 4);
    }

    #[test]
    fn the_next_stream_is_asked_for_the_unanswered_pose() {
        let mut poses = Poses::default();
        assert!(poses.wants(&pose(1)));
        (1..=3).for_each(|frame| poses.sent(pose(frame)));
        assert!(!poses.wants(&pose(3)), "sent already");
        poses.answer(2).unwrap();
        poses.begin_stream();
        assert!(poses.wants(&pose(3)) && !poses.wants(&pose(2)));
        assert!(poses.answer(3).is_none(), "not requested on this stream");
    }

    #[test]
    fn poses_stop_where_a_compositor_never_answers() {
        let mut poses = Poses::default();
        let asked = (1..1000).filter(|&frame| {
            let wants = poses.wants(&pose(frame));
            wants.then(|| poses.sent(pose(frame)));
            wants
        });
        assert_eq!(asked.count(), MAX_SENT);
        poses.answer(64).unwrap();
        assert!(poses.wants(&pose(1000)));
    }

    #[test]
    fn no_pose_is_sent_for_a_viewer_that_takes_no_frames() {
        let mut poses = Poses::default();
        (1..=2).for_each(|frame| poses.sent(pose(frame)));
        (1..=2).for_each(|frame| assert!(poses.answer(frame).is_some()));
        poses.begin_stream();
        assert!(!poses.wants(&pose(3)));
        poses.taken(1);
        assert!(poses.wants(&pose(3)));
    }
}
