//! Views to bytes and back: colour by the frame codec, other planes without loss.

use bytes::Bytes;
use depth_image::{HOLE_INVERSE_DEPTH, PinholeCamera, Provenance, View, ViewPlanes};
use glam::UVec2;

use crate::frame_codec::{decode_frame, encode_frame};
use crate::lz4::expand_lz4_up_to;
use crate::words_codec::{WordLayout, max_words_bytes, pack_words, unpack_words};
use crate::{DecodeError, DecodeLimits, FrameCodec, FrameError, FrameHeader, SampleSetId, StageTimes, WholeFrame};

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
    /// The header of a frame with this view, made from the images of a set's view cell: its index, and whether it is not
    /// the view's own.
    #[must_use]
    pub fn header(
        &self,
        sample_set_id: SampleSetId,
        cell: u32,
        is_neighbour_cell: bool,
        camera: PinholeCamera,
        planes: ViewPlanes,
        stage_times: StageTimes,
    ) -> FrameHeader {
        let [color_bytes, inverse_depth_bytes, provenance_bytes] = self.lengths;
        FrameHeader {
            sample_set_id,
            cell,
            is_neighbour_cell,
            camera,
            size_px: self.size_px,
            antialias: planes.antialias,
            tone: planes.tone,
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
pub fn encode_view(view: &View, codec: FrameCodec) -> Result<EncodedView, FrameError> {
    let texels = view.size_px.element_product() as usize;
    check_length("inverse_depth", view.inverse_depth_per_m.as_ref().map_or(texels, Vec::len), texels)?;
    check_length("provenance", view.provenance.as_ref().map_or(texels, Vec::len), texels)?;
    let color = encode_frame(codec, view.size_px, &view.srgb8)?;
    let depth = view.inverse_depth_per_m.as_deref().map_or_else(Vec::new, pack_f32_plane);
    let provenance =
        view.provenance.as_deref().map_or_else(Vec::new, |plane| pack_u32_plane(plane.iter().map(|p| p.0)));
    let lengths = [color.len(), depth.len(), provenance.len()].map(|len| len as u64);
    let data = if depth.is_empty() && provenance.is_empty() {
        color
    } else {
        [&color[..], &depth, &provenance].concat().into()
    };
    Ok(EncodedView { size_px: view.size_px, codec, lengths, crc32: crc32fast::hash(&data), data })
}

/// Decodes a whole frame.
///
/// # Errors
/// For sizes over the limits, and data that does not decode to the planes of the header.
pub fn decode_view(frame: &WholeFrame, limits: &DecodeLimits) -> Result<View, FrameError> {
    let FrameHeader { size_px, codec, .. } = frame.header;
    let texels = limits.texels(size_px.x, size_px.y).map_err(plane_error("size"))?;
    let [color, depth, provenance] = planes(frame)?;
    let depth = (!depth.is_empty()).then(|| unpack_f32_plane(&depth, texels).map_err(plane_error("inverse_depth")));
    let provenance =
        (!provenance.is_empty()).then(|| unpack_u32_plane(&provenance, texels).map_err(plane_error("provenance")));
    Ok(View {
        size_px,
        srgb8: decode_frame(codec, size_px, &color, limits)?,
        inverse_depth_per_m: depth.transpose()?,
        provenance: provenance.transpose()?.map(|words| words.into_iter().map(Provenance).collect()),
    })
}

fn check_length(plane: &'static str, len: usize, expected: usize) -> Result<(), FrameError> {
    if len == expected { Ok(()) } else { Err(FrameError::Length { plane, len, expected }) }
}

fn plane_error(plane: &'static str) -> impl FnOnce(DecodeError) -> FrameError {
    move |source| FrameError::Plane { plane, source }
}

fn planes(frame: &WholeFrame) -> Result<[Bytes; 3], FrameError> {
    let header = &frame.header;
    check_length("data", frame.data.len(), usize::try_from(header.total_bytes()).unwrap_or(usize::MAX))?;
    let mut rest = frame.data.clone();
    let color = rest.split_to(header.color_bytes as usize);
    let depth = rest.split_to(header.inverse_depth_bytes as usize);
    Ok([color, depth, rest])
}

fn pack_u32_plane(words: impl Iterator<Item = u32>) -> Vec<u8> {
    let words: Vec<u32> = words.collect();
    let mut packed = Vec::with_capacity(2 * words.len());
    pack_words(&words, WordLayout::Whole, &mut packed);
    lz4_flex::block::compress(&packed)
}

/// The inverse of [`pack_u32_plane`]. `texels` comes from a size that [`DecodeLimits::texels`] has passed.
fn unpack_u32_plane(data: &[u8], texels: usize) -> Result<Vec<u32>, DecodeError> {
    let packed = expand_lz4_up_to(data, max_words_bytes(texels, WordLayout::Whole), "plane")?;
    let mut input = &packed[..];
    let words = unpack_words(&mut input, texels, WordLayout::Whole)?;
    if input.is_empty() { Ok(words) } else { Err(DecodeError::Corrupt { field: "plane", reason: "bytes left over" }) }
}

/// Packs a plane of inverse depths to the bit; numbers that are not finite become holes.
fn pack_f32_plane(inverse_depth_per_m: &[f32]) -> Vec<u8> {
    let finite = inverse_depth_per_m.iter().map(|&value| if value.is_finite() { value } else { HOLE_INVERSE_DEPTH });
    pack_u32_plane(finite.map(f32::to_bits))
}

/// The inverse of [`pack_f32_plane`], with `texels` as in [`unpack_u32_plane`].
fn unpack_f32_plane(data: &[u8], texels: usize) -> Result<Vec<f32>, DecodeError> {
    let plane: Vec<f32> = unpack_u32_plane(data, texels)?.into_iter().map(f32::from_bits).collect();
    if plane.iter().all(|value| value.is_finite()) {
        return Ok(plane);
    }
    Err(DecodeError::Corrupt { field: "plane", reason: "not finite" })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::test_support::{Random, tree_over_terrain};

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
        let header = encoded.header(
            SampleSetId { plan_epoch: 3, index: 2 },
            0,
            false,
            camera,
            ViewPlanes::ALL,
            StageTimes::default(),
        );
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

    #[test]
    fn planes_survive_to_the_bit() {
        let plane = tree_over_terrain(200, 150, 17);
        let packed = pack_f32_plane(&plane);
        let raw: Vec<u8> = plane.iter().flat_map(|value| value.to_le_bytes()).collect();
        assert!(packed.len() < lz4_flex::block::compress(&raw).len());
        assert_eq!(unpack_f32_plane(&packed, plane.len()), Ok(plane));
        let words: Vec<u32> = (0..30_000).map(|i| i / 700 * 0x0101).collect();
        assert_eq!(unpack_u32_plane(&pack_u32_plane(words.iter().copied()), words.len()), Ok(words));
    }

    #[test]
    fn numbers_that_are_not_finite_are_not_decoded() {
        let packed = pack_f32_plane(&[0.5, f32::NAN, f32::INFINITY, -0.0]);
        assert_eq!(unpack_f32_plane(&packed, 4), Ok(vec![0.5, HOLE_INVERSE_DEPTH, HOLE_INVERSE_DEPTH, 0.0]));
        assert!(unpack_f32_plane(&pack_u32_plane([f32::NAN.to_bits()].into_iter()), 1).is_err());
    }

    #[test]
    fn damaged_planes_never_panic() {
        let good = pack_f32_plane(&tree_over_terrain(30, 20, 18));
        let mut random = Random::new(19);
        for _ in 0..4000 {
            let mut bad = good.clone();
            let at = random.below(bad.len());
            bad[at] ^= 1 << random.below(8);
            if let Ok(plane) = unpack_f32_plane(&bad, 600) {
                assert!(plane.len() == 600 && plane.iter().all(|value| value.is_finite()));
            }
            assert!(unpack_f32_plane(&good[..at], 600).is_err());
        }
    }
}
