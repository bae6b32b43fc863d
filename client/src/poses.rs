//! Poses on their way, and the frames that answer them.

use std::collections::VecDeque;
use std::time::Instant;

use crate::ViewRequest;

/// Poses that were sent and not answered; while there are so many, nothing is sent.
const MOST_SENT: usize = 64;
/// Frames that may be on their way, or here and not taken.
pub(crate) const CREDITS: usize = 2;

/// A pose that was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub(crate) request: ViewRequest,
    pub(crate) looked: Instant,
}

/// A pose that was sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sent {
    pub(crate) pose: Pose,
    pub(crate) sent: Instant,
}

/// Of one stream after the other: what one has not answered, the next is asked for, as far as it is the newest.
#[derive(Debug, Default)]
pub(crate) struct Poses {
    sent: VecDeque<Sent>,
    /// The last frame that came.
    answered: u64,
    /// Frames that are here and not taken: of the stream before, too.
    here: VecDeque<u64>,
}

impl Poses {
    /// Of a stream that has only begun.
    pub(crate) fn on_another_stream(&mut self) {
        self.sent.clear();
    }

    /// Whether a pose is to be sent.
    pub(crate) fn wants(&self, pose: &Pose) -> bool {
        let last = self.sent.back().map_or(self.answered, |sent| sent.pose.request.frame);
        pose.request.frame > last && self.sent.len() < MOST_SENT && self.here.len() < CREDITS
    }

    /// The viewer has all frames up to this one.
    pub(crate) fn taken(&mut self, frame: u64) {
        while self.here.front().is_some_and(|here| *here <= frame) {
            self.here.pop_front();
        }
    }

    pub(crate) fn sent(&mut self, pose: Pose) {
        self.sent.push_back(Sent { pose, sent: Instant::now() });
    }

    /// The pose that a frame answers; those before it were replaced by newer ones. `None` for a frame that was not asked
    /// for, or comes after a later one.
    pub(crate) fn answer(&mut self, frame: u64) -> Option<Sent> {
        let at = self.sent.iter().position(|sent| sent.pose.request.frame == frame)?;
        self.answered = frame;
        self.here.push_back(frame);
        self.sent.drain(..=at).next_back()
    }
}

#[cfg(test)]
mod tests {
    use depth_image::PinholeCamera;

    use super::*;

    fn pose(frame: u64) -> Pose {
        let (eye, up) = ([0.0, 0.0, 1.0].into(), [0.0, 1.0, 0.0].into());
        let camera = PinholeCamera::looking_at(eye, [0.0; 3].into(), up, 1.0, [8, 8].into());
        Pose { request: ViewRequest { frame, set_index: 0, camera }, looked: Instant::now() }
    }

    #[test]
    fn numbers_rise() {
        let mut poses = Poses::default();
        (1..=4).for_each(|frame| poses.sent(pose(frame)));
        assert_eq!(poses.answer(3).unwrap().pose.request.frame, 3);
        assert!(poses.answer(2).is_none() && poses.answer(3).is_none(), "a later one came");
        assert!(poses.answer(9).is_none(), "nobody asked for it");
        assert_eq!(poses.answer(4).unwrap().pose.request.frame, 4);
    }

    #[test]
    fn another_stream_is_asked_for_what_was_not_answered() {
        let mut poses = Poses::default();
        assert!(poses.wants(&pose(1)));
        (1..=3).for_each(|frame| poses.sent(pose(frame)));
        assert!(!poses.wants(&pose(3)), "sent already");
        poses.answer(2).unwrap();
        poses.on_another_stream();
        assert!(poses.wants(&pose(3)) && !poses.wants(&pose(2)));
        assert!(poses.answer(3).is_none(), "not asked for on this stream");
    }

    #[test]
    fn a_compositor_that_does_not_answer_is_not_asked_for_ever() {
        let mut poses = Poses::default();
        let asked = (1..1000).filter(|&frame| {
            let wants = poses.wants(&pose(frame));
            wants.then(|| poses.sent(pose(frame)));
            wants
        });
        assert_eq!(asked.count(), MOST_SENT);
        poses.answer(64).unwrap();
        assert!(poses.wants(&pose(1000)));
    }

    #[test]
    fn nothing_is_asked_for_a_viewer_that_takes_nothing() {
        let mut poses = Poses::default();
        (1..=2).for_each(|frame| poses.sent(pose(frame)));
        (1..=2).for_each(|frame| assert!(poses.answer(frame).is_some()));
        poses.on_another_stream();
        assert!(!poses.wants(&pose(3)));
        poses.taken(1);
        assert!(poses.wants(&pose(3)));
    }
}
