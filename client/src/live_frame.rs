//! Frames of a camera that moves, and their times on this machine.

use std::time::Instant;

use crate::view_request::{Frame, ViewRequest};

/// Frames that may be on their way, or received and not taken.
pub(crate) const CREDITS: usize = 2;

/// A frame, and its times.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveFrame {
    /// The frame; its number rises.
    pub frame: Frame,
    /// Times on this machine. Those elsewhere are in the frame's header.
    pub times: LiveTimes,
}

/// Times on this machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveTimes {
    /// The pose was given.
    pub posed: Instant,
    /// The pose was sent.
    pub sent: Instant,
    /// The frame was received.
    pub received: Instant,
    /// The frame was decoded.
    pub decoded: Instant,
}

/// A pose that was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub(crate) request: ViewRequest,
    pub(crate) posed: Instant,
}

/// A pose that was sent.
#[derive(Debug, Clone, Copy, PartialEq)]
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
