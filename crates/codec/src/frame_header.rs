//! The headers of frames.

use depth_image::{Antialias, PinholeCamera, ToneMapping};
use glam::UVec2;

use crate::{FrameCodec, SampleSetId};

/// Bytes of one encoded frame, all planes: those of 8192×8192 take 740 million where nothing can be packed.
pub const MAX_FRAME_BYTES: u64 = 1 << 30;

/// The header of a frame, whose planes' bytes follow one another.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameHeader {
    /// The set that the frame shows: one, never a mixture.
    pub sample_set_id: SampleSetId,
    /// The view cell whose images the frame is made from.
    pub cell: u32,
    /// The view's own cell was not loaded yet: the frame is made from the nearest one that was.
    pub is_neighbour_cell: bool,
    /// The camera of the view, as requested.
    pub camera: PinholeCamera,
    /// Columns and rows.
    pub size_px: UVec2,
    /// Samples a pixel of its colour, around the centres of the camera's pixels.
    pub antialias: Antialias,
    /// From the mean of these samples to its colour.
    pub tone: ToneMapping,
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

/// Times of a frame's stages at its compositor, in durations: clocks of machines differ.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StageTimes {
    /// The wait for the sample set.
    pub set_wait_s: f64,
    /// The wait until earlier frames were sent, and, on a live stream, acknowledged.
    pub credit_wait_s: f64,
    /// The wait in the queue for the device.
    pub queue_s: f64,
    /// The batch's device time: each of its views waits for all of them.
    pub batch_s: f64,
    /// The batch's device time divided by its views.
    pub reconstruct_s: f64,
    /// Encoding.
    pub encode_s: f64,
    /// The wait of the finished view for an encoder, and for earlier frames to be sent.
    pub send_wait_s: f64,
    /// From the request's arrival to the frame's departure.
    pub compositor_s: f64,
    /// The age of the sample set when the batch was begun; 0 where views are drawn from the scene.
    pub set_age_s: f64,
    /// Views of the batch.
    pub batch_count: u32,
}

impl StageTimes {
    /// The times of a frame that leaves `compositor_s` after its request: time that no other stage accounts for is a wait.
    #[must_use]
    pub fn leaving_after(self, compositor_s: f64) -> Self {
        let made_s = self.set_wait_s + self.credit_wait_s + self.queue_s + self.batch_s + self.encode_s;
        Self { compositor_s, send_wait_s: (compositor_s - made_s).max(0.0), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_add_up_to_the_whole() {
        let made = StageTimes {
            set_wait_s: 0.1,
            credit_wait_s: 0.2,
            queue_s: 0.3,
            batch_s: 0.4,
            encode_s: 0.5,
            reconstruct_s: 0.2,
            set_age_s: 9.0,
            ..StageTimes::default()
        };
        let left = made.leaving_after(2.0);
        assert!((1.5 + left.send_wait_s - left.compositor_s).abs() < 1e-12);
        assert_eq!(made.leaving_after(1.0).send_wait_s, 0.0, "clocks that were read in another order");
    }
}
