//! Frames in parts.

use cluster::{InvalidField, at_most, finite_seconds};
use codec::{DecodeLimits, FrameCodec, FrameHeader, FramePart, MAX_FRAME_BYTES, SampleSetId, StageTimes};
use glam::UVec2;

use super::geometry::{pinhole_from, pinhole_to};
use crate::error::{WireError, required};
use crate::proto;
use crate::rpc::MAX_MESSAGE_BYTES;

/// A codec by its name in settings.
pub(crate) fn frame_codec(text: &str, field: &'static str) -> Result<FrameCodec, InvalidField> {
    let short: String = text.chars().take(32).collect();
    text.parse().map_err(|_| InvalidField::out_of_range(field, short, "lz4, jpeg or jpeg:QUALITY"))
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
        validate(&header)?;
        Ok(header)
    }
}

fn validate(header: &FrameHeader) -> Result<(), InvalidField> {
    let UVec2 { x, y } = header.size_px;
    let texels = DecodeLimits::default().texels(x, y);
    texels.map_err(|error| InvalidField::out_of_range("header.size_px", error, "within the limits"))?;
    if header.camera.size_px != header.size_px {
        return Err(InvalidField::out_of_range("header.camera.size_px", header.camera.size_px, "the frame's"));
    }
    match header.total_bytes() {
        0..=MAX_FRAME_BYTES => Ok(()),
        count => Err(InvalidField::TooMany { field: "header.total_bytes", count, limit: MAX_FRAME_BYTES }),
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

impl TryFrom<proto::StageTimes> for StageTimes {
    type Error = WireError;

    fn try_from(t: proto::StageTimes) -> Result<Self, WireError> {
        Ok(Self {
            set_wait_s: finite_seconds(t.set_wait_s, "set_wait_s")?,
            credit_wait_s: finite_seconds(t.credit_wait_s, "credit_wait_s")?,
            queue_s: finite_seconds(t.queue_s, "queue_s")?,
            batch_s: finite_seconds(t.batch_s, "batch_s")?,
            reconstruct_s: finite_seconds(t.reconstruct_s, "reconstruct_s")?,
            encode_s: finite_seconds(t.encode_s, "encode_s")?,
            send_wait_s: finite_seconds(t.send_wait_s, "send_wait_s")?,
            compositor_s: finite_seconds(t.compositor_s, "compositor_s")?,
            set_age_s: finite_seconds(t.set_age_s, "set_age_s")?,
            batch_count: t.batch_count,
        })
    }
}

impl From<StageTimes> for proto::StageTimes {
    fn from(t: StageTimes) -> Self {
        Self {
            set_wait_s: t.set_wait_s,
            credit_wait_s: t.credit_wait_s,
            queue_s: t.queue_s,
            batch_s: t.batch_s,
            reconstruct_s: t.reconstruct_s,
            encode_s: t.encode_s,
            send_wait_s: t.send_wait_s,
            compositor_s: t.compositor_s,
            set_age_s: t.set_age_s,
            batch_count: t.batch_count,
        }
    }
}
