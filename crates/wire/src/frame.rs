//! Views asked for, and frames in parts.

use bytes::Bytes;
use depth_image::{PinholeCamera, ViewPlanes};
use glam::UVec2;

use crate::codec::{DecodeLimits, FrameCodec, SampleSetId};
use crate::error::{WireError, at_most, required};
use crate::geometry::{pinhole_from, pinhole_to};
use crate::limits::{MAX_FRAME_BYTES, MAX_MESSAGE_BYTES, MAX_VIEWS_PER_REQUEST, PART_BYTES, nonempty};
use crate::live::{LiveRequest, view_counts};
use crate::proto;
use crate::stage_times::StageTimes;

/// Views of one sample set, all made alike.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderViews {
    /// Of the session's plan.
    pub plan_epoch: u64,
    /// Into the timeline.
    pub set_index: u32,
    /// How they are reconstructed.
    pub method: String,
    /// How frames are encoded.
    pub codec: FrameCodec,
    /// Planes beside colour.
    pub planes: ViewPlanes,
    /// Frame numbers and cameras; of a live stream one at most.
    pub views: Vec<RequestedView>,
    /// Whether the stream is live.
    pub live: Option<LiveRequest>,
}

/// One view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RequestedView {
    /// The client's own number.
    pub frame: u64,
    /// From where.
    pub camera: PinholeCamera,
}

impl TryFrom<proto::RenderViewsRequest> for RenderViews {
    type Error = WireError;

    fn try_from(r: proto::RenderViewsRequest) -> Result<Self, WireError> {
        at_most(r.views.len(), MAX_VIEWS_PER_REQUEST, "views")?;
        view_counts(r.views.len(), r.live.is_some())?;
        let view = |v: proto::RequestedView| {
            Ok(RequestedView { frame: v.frame_number, camera: pinhole_from(v.camera, "views.camera")? })
        };
        Ok(Self {
            plan_epoch: r.plan_epoch,
            set_index: r.set_index,
            method: nonempty(r.reconstruction_method, "reconstruction_method")?,
            codec: frame_codec(&r.frame_codec, "frame_codec")?,
            planes: ViewPlanes { inverse_depth: r.with_inverse_depth, provenance: r.with_provenance },
            views: r.views.into_iter().map(view).collect::<Result<_, WireError>>()?,
            live: r.live.map(Into::into),
        })
    }
}

impl From<RenderViews> for proto::RenderViewsRequest {
    fn from(r: RenderViews) -> Self {
        let view =
            |v: &RequestedView| proto::RequestedView { frame_number: v.frame, camera: Some(pinhole_to(&v.camera)) };
        Self {
            plan_epoch: r.plan_epoch,
            set_index: r.set_index,
            reconstruction_method: r.method,
            frame_codec: r.codec.to_string(),
            with_inverse_depth: r.planes.inverse_depth,
            with_provenance: r.planes.provenance,
            views: r.views.iter().map(view).collect(),
            live: r.live.map(Into::into),
        }
    }
}

/// What a frame is. The planes' bytes follow one another.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameHeader {
    /// What it shows: one set, never a mixture.
    pub sample_set_id: SampleSetId,
    /// From where it was seen, as asked for.
    pub camera: PinholeCamera,
    /// Columns and rows.
    pub size_px: UVec2,
    /// How its colour is encoded.
    pub codec: FrameCodec,
    /// Encoded colour.
    pub color_bytes: u64,
    /// Packed inverse depths; 0 without them.
    pub inverse_depth_bytes: u64,
    /// Packed provenance; 0 without it.
    pub provenance_bytes: u64,
    /// Of all bytes.
    pub crc32: u32,
    /// Where its time went.
    pub stage_times: StageTimes,
}

impl FrameHeader {
    /// Of all planes.
    #[must_use]
    pub fn total_bytes(&self) -> u64 {
        self.color_bytes.saturating_add(self.inverse_depth_bytes).saturating_add(self.provenance_bytes)
    }

    fn check(self) -> Result<Self, WireError> {
        let limits = DecodeLimits::default();
        limits.texels(self.size_px.x, self.size_px.y).map_err(|error| WireError::corrupt("header.size_px", error))?;
        if self.camera.size_px != self.size_px {
            return Err(WireError::out_of_range("header.camera.size_px", self.camera.size_px, "the frame's"));
        }
        let (count, limit) = (self.total_bytes(), MAX_FRAME_BYTES);
        if count > limit { Err(WireError::TooMany { field: "header.total_bytes", count, limit }) } else { Ok(self) }
    }
}

impl TryFrom<proto::FrameHeader> for FrameHeader {
    type Error = WireError;

    fn try_from(h: proto::FrameHeader) -> Result<Self, WireError> {
        let header = Self {
            sample_set_id: SampleSetId { plan_epoch: h.plan_epoch, index: h.set_index.into() },
            camera: pinhole_from(h.camera, "header.camera")?,
            size_px: UVec2::new(h.width_px, h.height_px),
            codec: frame_codec(&h.frame_codec, "header.frame_codec")?,
            color_bytes: h.color_bytes,
            inverse_depth_bytes: h.inverse_depth_bytes,
            provenance_bytes: h.provenance_bytes,
            crc32: h.frame_crc32,
            stage_times: required(h.stage_times, "header.stage_times")?.try_into()?,
        };
        header.check()
    }
}

impl From<FrameHeader> for proto::FrameHeader {
    fn from(h: FrameHeader) -> Self {
        Self {
            plan_epoch: h.sample_set_id.plan_epoch,
            set_index: h.sample_set_id.index as u32,
            width_px: h.size_px.x,
            height_px: h.size_px.y,
            frame_codec: h.codec.to_string(),
            color_bytes: h.color_bytes,
            inverse_depth_bytes: h.inverse_depth_bytes,
            provenance_bytes: h.provenance_bytes,
            frame_crc32: h.crc32,
            stage_times: Some(h.stage_times.into()),
            camera: Some(pinhole_to(&h.camera)),
        }
    }
}

/// A codec by its name in settings.
fn frame_codec(text: &str, field: &'static str) -> Result<FrameCodec, WireError> {
    let short: String = text.chars().take(32).collect();
    text.parse().map_err(|_| WireError::out_of_range(field, short, "lz4, jpeg or jpeg:QUALITY"))
}

/// A piece of an encoded frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FramePart {
    /// Whose.
    pub frame: u64,
    /// On the first piece.
    pub header: Option<FrameHeader>,
    /// Where it starts.
    pub offset_bytes: u64,
    /// What it holds.
    pub data: Bytes,
}

impl FramePart {
    /// Cuts an encoded frame; no bytes are copied.
    pub fn cut(frame: u64, header: FrameHeader, encoded: Bytes) -> impl Iterator<Item = Self> {
        let mut header = Some(header);
        let starts = (0..encoded.len().max(1)).step_by(PART_BYTES);
        starts.map(move |start| {
            let data = encoded.slice(start..encoded.len().min(start + PART_BYTES));
            Self { frame, header: header.take(), offset_bytes: start as u64, data }
        })
    }
}

impl TryFrom<proto::RenderViewsResponse> for FramePart {
    type Error = WireError;

    fn try_from(r: proto::RenderViewsResponse) -> Result<Self, WireError> {
        at_most(r.data.len(), MAX_MESSAGE_BYTES, "data")?;
        Ok(Self {
            frame: r.frame_number,
            header: r.header.map(TryInto::try_into).transpose()?,
            offset_bytes: r.offset_bytes,
            data: r.data,
        })
    }
}

impl From<FramePart> for proto::RenderViewsResponse {
    fn from(part: FramePart) -> Self {
        Self {
            frame_number: part.frame,
            header: part.header.map(Into::into),
            offset_bytes: part.offset_bytes,
            data: part.data,
        }
    }
}

/// A frame whose parts have all come.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeFrame {
    /// Whose.
    pub frame: u64,
    /// What it is.
    pub header: FrameHeader,
    /// All planes, as checksummed.
    pub data: Bytes,
}

/// Puts one stream's frames together: they come one after the other, parts in order.
#[derive(Debug, Default)]
pub struct FrameAssembly {
    open: Option<(u64, FrameHeader, Vec<u8>)>,
}

impl FrameAssembly {
    /// Adds a part; gives the frame that it completes.
    ///
    /// # Errors
    /// For parts out of order, repeated, beyond the announced size or with a wrong checksum.
    pub fn push(&mut self, part: FramePart) -> Result<Option<WholeFrame>, WireError> {
        let (frame, header, data) = match (self.open.take(), part.header) {
            (None, Some(header)) if part.data.len() as u64 == header.total_bytes() => {
                return whole(part.frame, header, part.data).map(Some);
            }
            (None, Some(header)) => (part.frame, header, Vec::new()),
            (Some((frame, header, data)), None) if frame == part.frame => (frame, header, data),
            (None, None) => return Err(WireError::Missing { field: "header" }),
            (Some((open, ..)), _) => {
                return Err(WireError::corrupt(
                    "frame_number",
                    format!("frame {open} is cut off by frame {}", part.frame),
                ));
            }
        };
        self.extend(frame, header, data, part.offset_bytes, &part.data)
    }

    fn extend(
        &mut self,
        frame: u64,
        header: FrameHeader,
        mut data: Vec<u8>,
        offset_bytes: u64,
        piece: &[u8],
    ) -> Result<Option<WholeFrame>, WireError> {
        if offset_bytes != data.len() as u64 {
            return Err(WireError::corrupt(
                "offset_bytes",
                format!("{offset_bytes} after {} bytes of frame {frame}", data.len()),
            ));
        }
        let count = (data.len() + piece.len()) as u64;
        if count > header.total_bytes() {
            return Err(WireError::TooMany { field: "data", count, limit: header.total_bytes() });
        }
        data.extend_from_slice(piece);
        if count == header.total_bytes() {
            return whole(frame, header, data.into()).map(Some);
        }
        self.open = Some((frame, header, data));
        Ok(None)
    }

    /// Checks that the stream did not end inside a frame.
    ///
    /// # Errors
    /// Names the frame that is cut off.
    pub fn finish(&self) -> Result<(), WireError> {
        match &self.open {
            Some((frame, ..)) => Err(WireError::corrupt("data", format!("the stream ends inside frame {frame}"))),
            None => Ok(()),
        }
    }
}

fn whole(frame: u64, header: FrameHeader, data: Bytes) -> Result<WholeFrame, WireError> {
    if crc32fast::hash(&data) == header.crc32 {
        Ok(WholeFrame { frame, header, data })
    } else {
        Err(WireError::corrupt("frame_crc32", format!("frame {frame} has another checksum")))
    }
}

#[cfg(test)]
#[path = "frame_tests.rs"]
mod tests;
