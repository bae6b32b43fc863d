//! Views that a caller asks for, and the frames that answer them.

use std::time::Instant;

use bytes::Bytes;
use codec::{FrameCodec, FrameHeader};
use depth_image::{Antialias, PinholeCamera, View, ViewPlanes};

use crate::error::ClientError;

/// How a session's views are made and sent.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ViewSettings {
    /// The reconstruction method.
    pub(crate) method: String,
    /// The encoding of frames.
    pub(crate) codec: FrameCodec,
    /// Planes beside colour.
    pub(crate) planes: ViewPlanes,
}

/// How one picture is made and sent, in place of the session's way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PictureQuality {
    /// The encoding.
    pub codec: FrameCodec,
    /// Samples a pixel.
    pub antialias: Antialias,
    /// The reconstruction method, whose samples must be those of the session's; `None`: the session's.
    pub method: Option<String>,
    /// Whether the picture waits for its sample set, as a still does.
    pub waits_for_set: bool,
}

/// One view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewRequest {
    /// The client's own number; numbers rise within a call.
    pub frame: u64,
    /// Index into the session's timeline.
    pub set_index: u32,
    /// The camera of the view.
    pub camera: PinholeCamera,
}

impl ViewRequest {
    /// # Errors
    /// For a camera that cannot be used, and for a set beyond the `set_count` sets of the timeline.
    pub(crate) fn check(&self, set_count: u32) -> Result<(), ClientError> {
        let (field, reason) = match self.camera.validate() {
            Err(error) => ("camera", format!("frame {}: {error}", self.frame)),
            Ok(()) if self.set_index >= set_count => {
                ("set_index", format!("{} is beyond the timeline", self.set_index))
            }
            Ok(()) => return Ok(()),
        };
        Err(ClientError::Invalid { field, reason })
    }
}

/// A frame that was received and decoded.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The request that it answers.
    pub request: ViewRequest,
    /// The picture.
    pub view: View,
    /// Its sample set, encoding and stage times.
    pub header: FrameHeader,
}

/// A frame of a camera that moves, and its times.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveFrame {
    /// The frame; its number rises.
    pub frame: Frame,
    /// The pose was given, by the clock of this machine. Times elsewhere are in the frame's header.
    pub posed: Instant,
    /// The pose was sent.
    pub sent: Instant,
    /// The frame was received.
    pub received: Instant,
    /// The frame was decoded.
    pub decoded: Instant,
}

/// A frame of a camera that moves, as it came. Its checksum has been verified.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedFrame {
    /// The request that it answers; its number rises.
    pub request: ViewRequest,
    /// Its sample set, encoding and stage times.
    pub header: FrameHeader,
    /// All planes, colour first, as the header says.
    pub data: Bytes,
    /// The compositor that made it.
    pub node_name: String,
    /// The pose was given, by the clock of this machine.
    pub posed: Instant,
    /// The pose was sent, by the clock of this machine.
    pub sent: Instant,
    /// The frame was received, by the clock of this machine.
    pub received: Instant,
}
