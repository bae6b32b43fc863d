//! One plane of inverse depths by itself, for the bench of the codec.

use crate::{
    DecodeError, DecodeLimits, InverseDepthRange,
    depth_codec::{decode_depth, encode_depth, max_unpacked_bytes},
    error::check_limit,
    lz4::expand_lz4,
    quantise::quantise,
};

/// A packed plane of inverse depths.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedDepthPlane {
    /// The range that the codes span.
    pub range: InverseDepthRange,
    /// Bytes before LZ4.
    pub raw_bytes: u32,
    /// An LZ4 block.
    pub packed: Vec<u8>,
}

/// The 16-bit codes of a plane, over its own range.
#[must_use]
pub fn inverse_depth_codes(inverse_depth_per_m: &[f32]) -> Vec<u16> {
    let mut codes = vec![0; inverse_depth_per_m.len()];
    quantise(inverse_depth_per_m, InverseDepthRange::of_plane(inverse_depth_per_m), &mut codes);
    codes
}

/// Quantises and packs a plane.
#[must_use]
pub fn encode_depth_plane(inverse_depth_per_m: &[f32]) -> EncodedDepthPlane {
    let depth = encode_depth(inverse_depth_per_m);
    let packed = lz4_flex::block::compress(&depth.bytes);
    EncodedDepthPlane { range: depth.range, raw_bytes: depth.bytes.len() as u32, packed }
}

/// Unpacks a plane.
///
/// # Errors
/// A size over the limits, or bytes that do not decode to exactly that size.
pub fn decode_depth_plane(
    plane: &EncodedDepthPlane,
    width: u32,
    height: u32,
    limits: &DecodeLimits,
) -> Result<Vec<f32>, DecodeError> {
    let texels = limits.texels(width, height)?;
    plane.range.validate()?;
    check_limit("raw_bytes", u64::from(plane.raw_bytes), max_unpacked_bytes(texels) as u64)?;
    let bytes = expand_lz4(&plane.packed, plane.raw_bytes as usize, "inverse_depth")?;
    decode_depth(&bytes, texels, plane.range).map(|(_, plane)| plane)
}
