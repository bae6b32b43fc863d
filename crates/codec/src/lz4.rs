//! LZ4 blocks from a peer, expanded within a bound.

use crate::DecodeError;

/// Expands an LZ4 block that must give exactly `unpacked_bytes`, a size that the caller has checked.
pub(crate) fn expand_lz4(packed: &[u8], unpacked_bytes: usize, field: &'static str) -> Result<Vec<u8>, DecodeError> {
    // LZ4 cannot do better than 255 to 1: a few bytes do not get to claim a large buffer.
    if unpacked_bytes / 255 > packed.len() {
        return Err(DecodeError::Corrupt { field, reason: "claims more than LZ4 can hold" });
    }
    let unpacked = expand_lz4_up_to(packed, unpacked_bytes, field)?;
    if unpacked.len() < unpacked_bytes {
        return Err(DecodeError::Corrupt { field, reason: "LZ4 block is too short" });
    }
    Ok(unpacked)
}

/// Expands an LZ4 block that gives at most `max_unpacked_bytes`, a bound that follows from an image's size.
pub(crate) fn expand_lz4_up_to(
    packed: &[u8],
    max_unpacked_bytes: usize,
    field: &'static str,
) -> Result<Vec<u8>, DecodeError> {
    let mut unpacked = vec![0; max_unpacked_bytes.min(packed.len().saturating_mul(255))];
    let written = lz4_flex::block::decompress_into(packed, &mut unpacked)
        .map_err(|_| DecodeError::Corrupt { field, reason: "LZ4 block is invalid" })?;
    unpacked.truncate(written);
    Ok(unpacked)
}
