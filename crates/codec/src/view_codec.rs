//! Views to bytes and back: colour by the frame codec, other planes without loss.

use bytes::Bytes;
use depth_image::{PinholeCamera, Provenance, View};
use glam::UVec2;

use crate::{
    DecodeError, DecodeLimits, EncodedFrame, FrameCodec, FrameError, FrameHeader, SampleSetId, StageTimes, WholeFrame,
    decode_frame, encode_frame, pack_f32_plane, pack_u32_plane, unpack_f32_plane, unpack_u32_plane,
};

/// Why a view is not encoded or decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum ViewCodecError {
    /// The colour is at fault.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Another plane is at fault.
    #[error("{plane}: {source}")]
    Plane { plane: &'static str, source: DecodeError },
    /// Planes of other lengths than the header says, or than the view's size.
    #[error("{plane} has {len} texels or bytes, must have {expected}")]
    Length { plane: &'static str, len: usize, expected: usize },
}

/// A view's bytes, planes one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedView {
    size_px: UVec2,
    codec: FrameCodec,
    /// Bytes of colour, inverse depth and provenance.
    lengths: [u64; 3],
    crc32: u32,
    /// All planes.
    pub data: Bytes,
}

impl EncodedView {
    /// The header of a frame with this view.
    #[must_use]
    pub fn header(&self, sample_set_id: SampleSetId, camera: PinholeCamera, stage_times: StageTimes) -> FrameHeader {
        let [color_bytes, inverse_depth_bytes, provenance_bytes] = self.lengths;
        FrameHeader {
            sample_set_id,
            camera,
            size_px: self.size_px,
            codec: self.codec,
            color_bytes,
            inverse_depth_bytes,
            provenance_bytes,
            crc32: self.crc32,
            stage_times,
        }
    }
}

/// Encodes a view.
///
/// # Errors
/// For planes that are not of the view's size, or a size that the codec cannot have.
pub fn encode_view(view: &View, codec: FrameCodec) -> Result<EncodedView, ViewCodecError> {
    let texels = view.size_px.element_product() as usize;
    let right = |plane, len| {
        if len == texels { Ok(()) } else { Err(ViewCodecError::Length { plane, len, expected: texels }) }
    };
    right("inverse_depth", view.inverse_depth_per_m.as_ref().map_or(texels, Vec::len))?;
    right("provenance", view.provenance.as_ref().map_or(texels, Vec::len))?;
    let color = encode_frame(codec, view.size_px.x, view.size_px.y, &view.srgb8)?.data;
    let depth = view.inverse_depth_per_m.as_deref().map_or_else(Vec::new, pack_f32_plane);
    let provenance = view.provenance.as_deref().map_or_else(Vec::new, |plane| pack_u32_plane(&words_of(plane)));
    let lengths = [color.len(), depth.len(), provenance.len()].map(|len| len as u64);
    let data = if depth.is_empty() && provenance.is_empty() {
        color
    } else {
        [&color[..], &depth, &provenance].concat().into()
    };
    Ok(EncodedView { size_px: view.size_px, codec, lengths, crc32: crc32fast::hash(&data), data })
}

fn words_of(plane: &[Provenance]) -> Vec<u32> {
    plane.iter().map(|provenance| provenance.0).collect()
}

/// Decodes a whole frame.
///
/// # Errors
/// For sizes over the limits, and data that does not decode to the planes of the header.
pub fn decode_view(frame: &WholeFrame, limits: &DecodeLimits) -> Result<View, ViewCodecError> {
    let FrameHeader { size_px, codec, .. } = frame.header;
    let plane_error = |plane| move |source| ViewCodecError::Plane { plane, source };
    let texels = limits.texels(size_px.x, size_px.y).map_err(plane_error("size"))?;
    let [color, depth, provenance] = planes(frame)?;
    let color =
        EncodedFrame { codec, width: size_px.x, height: size_px.y, crc32: crc32fast::hash(&color), data: color };
    let some = |data: Bytes| (!data.is_empty()).then_some(data);
    let depth = some(depth).map(|data| unpack_f32_plane(&data, texels).map_err(plane_error("inverse_depth")));
    let provenance = some(provenance).map(|data| unpack_u32_plane(&data, texels).map_err(plane_error("provenance")));
    Ok(View {
        size_px,
        srgb8: decode_frame(&color, limits)?,
        inverse_depth_per_m: depth.transpose()?,
        provenance: provenance.transpose()?.map(|words| words.into_iter().map(Provenance).collect()),
    })
}

fn planes(frame: &WholeFrame) -> Result<[Bytes; 3], ViewCodecError> {
    let header = &frame.header;
    if frame.data.len() as u64 != header.total_bytes() {
        return Err(ViewCodecError::Length {
            plane: "data",
            len: frame.data.len(),
            expected: header.total_bytes() as usize,
        });
    }
    let mut rest = frame.data.clone();
    let color = rest.split_to(header.color_bytes as usize);
    let depth = rest.split_to(header.inverse_depth_bytes as usize);
    Ok([color, depth, rest])
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn view(planes: bool) -> View {
        View {
            size_px: UVec2::new(20, 10),
            srgb8: (0..600).map(|i| (i % 251) as u8).collect(),
            inverse_depth_per_m: planes.then(|| (0..200).map(|i| i as f32 * 0.01).collect()),
            provenance: planes.then(|| (0..200).map(Provenance).collect()),
        }
    }

    fn sent(view: &View) -> WholeFrame {
        let encoded = encode_view(view, FrameCodec::Lz4).unwrap();
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, view.size_px);
        let header = encoded.header(SampleSetId { plan_epoch: 3, index: 2 }, camera, StageTimes::default());
        WholeFrame { frame: 1, header, data: encoded.data }
    }

    #[test]
    fn views_survive_to_the_bit() {
        for view in [view(false), view(true)] {
            assert_eq!(decode_view(&sent(&view), &DecodeLimits::default()).unwrap(), view);
        }
    }

    #[test]
    fn planes_of_wrong_lengths_are_refused() {
        let limits = DecodeLimits::default();
        let good = sent(&view(true));
        let spoilt = |change: &dyn Fn(&mut WholeFrame)| {
            let mut frame = good.clone();
            change(&mut frame);
            decode_view(&frame, &limits).is_err()
        };
        assert!(spoilt(&|f| f.header.color_bytes += 1));
        assert!(spoilt(&|f| (f.header.color_bytes, f.header.inverse_depth_bytes) =
            (f.header.color_bytes - 1, f.header.inverse_depth_bytes + 1)));
        assert!(spoilt(&|f| f.header.size_px.x = 21));
        assert!(spoilt(&|f| f.header.size_px = UVec2::splat(65_535)));
        assert!(spoilt(&|f| f.data.truncate(10)));
        assert!(encode_view(&View { provenance: Some(Vec::new()), ..view(true) }, FrameCodec::Lz4).is_err());
    }
}
