//! The headers of frames.

use bytes::Bytes;
use depth_image::PinholeCamera;
use glam::UVec2;

use crate::{FrameCodec, SampleSetId, StageTimes};

/// Bytes of one encoded frame, all planes.
pub const MAX_FRAME_BYTES: u64 = 512 << 20;

/// The header of a frame, whose planes' bytes follow one another.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameHeader {
    /// The set that the frame shows: one, never a mixture.
    pub sample_set_id: SampleSetId,
    /// The camera of the view, as requested.
    pub camera: PinholeCamera,
    /// Columns and rows.
    pub size_px: UVec2,
    /// The encoding of its colour.
    pub codec: FrameCodec,
    /// Bytes of the encoded colour.
    pub color_bytes: u64,
    /// Bytes of the packed inverse depths; 0 without them.
    pub inverse_depth_bytes: u64,
    /// Bytes of the packed provenance; 0 without it.
    pub provenance_bytes: u64,
    /// CRC-32 of all bytes.
    pub crc32: u32,
    /// Where its time went at the compositor.
    pub stage_times: StageTimes,
}

impl FrameHeader {
    /// Bytes of all planes; saturates.
    #[must_use]
    pub fn total_bytes(&self) -> u64 {
        self.color_bytes.saturating_add(self.inverse_depth_bytes).saturating_add(self.provenance_bytes)
    }
}

/// A frame whose parts have all come.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeFrame {
    /// The client's number of the frame.
    pub frame: u64,
    /// Its header.
    pub header: FrameHeader,
    /// All planes; their checksum has been verified.
    pub data: Bytes,
}
