//! What decoders refuse, and how much they take on.

use depth_image::MAX_IMAGE_SIDE_PX;

/// Why bytes do not make an image or a plane.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// A field of the header cannot be right.
    #[error("image header {field}: {reason}")]
    Header {
        /// Which.
        field: &'static str,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// More than the receiver allows.
    #[error("{field} is {value}, the limit is {limit}")]
    Limit {
        /// Of what.
        field: &'static str,
        /// What was asked for.
        value: u64,
        /// What is allowed.
        limit: u64,
    },
    /// The image is not of its camera's size.
    #[error("image of {width}×{height} for a camera of {camera_width}×{camera_height}")]
    CameraSize {
        /// Columns in the header.
        width: u32,
        /// Rows in the header.
        height: u32,
        /// Columns of the camera.
        camera_width: u32,
        /// Rows of the camera.
        camera_height: u32,
    },
    /// Bytes that do not decode.
    #[error("payload {field}: {reason}")]
    Corrupt {
        /// Which part.
        field: &'static str,
        /// What is wrong with it.
        reason: &'static str,
    },
}

/// How much a decoder takes on before it allocates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DecodeLimits {
    /// Longest side of an image.
    pub max_side_px: u32,
    /// Texels of one image.
    pub max_texels: usize,
    /// Packed bytes of one image, all planes.
    pub max_payload_bytes: usize,
    /// Bytes of one image before any packing, all planes: what packs best would take the most memory.
    pub max_image_bytes: usize,
}

impl Default for DecodeLimits {
    /// 16 million texels, 256 MiB packed: some fifty times what the largest planned sample image needs. 1 GiB
    /// unpacked: all lights' visibility at 1920×1080 takes half of that.
    fn default() -> Self {
        Self {
            max_side_px: MAX_IMAGE_SIDE_PX,
            max_texels: 1 << 24,
            max_payload_bytes: 256 << 20,
            max_image_bytes: 1 << 30,
        }
    }
}

impl DecodeLimits {
    /// Texels of an image that is within the limits.
    ///
    /// # Errors
    /// Names the side or the product that is zero or too large.
    pub fn texels(&self, width: u32, height: u32) -> Result<usize, DecodeError> {
        if width == 0 || height == 0 {
            return Err(DecodeError::Header { field: "size", reason: "zero" });
        }
        for (field, side) in [("width", width), ("height", height)] {
            check_limit(field, u64::from(side), u64::from(self.max_side_px))?;
        }
        let texels = u64::from(width) * u64::from(height);
        check_limit("texels", texels, self.max_texels as u64)?;
        Ok(texels as usize)
    }
}

pub(super) fn check_limit(field: &'static str, value: u64, limit: u64) -> Result<(), DecodeError> {
    if value > limit { Err(DecodeError::Limit { field, value, limit }) } else { Ok(()) }
}

/// Expands an LZ4 block that must give exactly `unpacked_bytes`, a size that the caller has checked.
pub(super) fn expand_lz4(packed: &[u8], unpacked_bytes: usize, field: &'static str) -> Result<Vec<u8>, DecodeError> {
    // LZ4 cannot do better than 255 to 1: a few bytes do not get to claim a large buffer.
    if unpacked_bytes / 255 > packed.len() {
        return Err(DecodeError::Corrupt { field, reason: "claims more than LZ4 can hold" });
    }
    let mut unpacked = vec![0; unpacked_bytes];
    match lz4_flex::block::decompress_into(packed, &mut unpacked) {
        Ok(written) if written == unpacked_bytes => Ok(unpacked),
        Ok(_) => Err(DecodeError::Corrupt { field, reason: "LZ4 block is too short" }),
        Err(_) => Err(DecodeError::Corrupt { field, reason: "LZ4 block is invalid" }),
    }
}

/// Expands an LZ4 block that gives at most `max_unpacked_bytes`, a bound that follows from an image's size.
pub(super) fn expand_lz4_up_to(
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
