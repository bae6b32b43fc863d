//! Errors of decoders, and the limits that they keep.

use depth_image::MAX_IMAGE_SIDE_PX;

/// Why bytes do not make an image or a plane.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum DecodeError {
    /// A field of the header cannot be right.
    #[error("image header {field}: {reason}")]
    Header { field: &'static str, reason: &'static str },
    /// A size that the receiver does not allow.
    #[error("{field} is {value}, the limit is {limit}")]
    Limit { field: &'static str, value: u64, limit: u64 },
    /// The image is not of its camera's size.
    #[error("image of {width}×{height} for a camera of {camera_width}×{camera_height}")]
    CameraSize { width: u32, height: u32, camera_width: u32, camera_height: u32 },
    /// Bytes that do not decode.
    #[error("payload {field}: {reason}")]
    Corrupt { field: &'static str, reason: &'static str },
}

/// Why a view, or its colour, is not encoded or decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum FrameError {
    /// The slice has not three bytes a pixel.
    #[error("{rgb_bytes} bytes of RGB for a frame of {width}×{height}")]
    Size { width: u32, height: u32, rgb_bytes: usize },
    /// The library of a file format, JPEG or PNG, refuses.
    #[error("{format}: {reason}")]
    Picture { format: &'static str, reason: String },
    /// Size over the limits, or data that does not decode.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// A plane beside the colour is at fault.
    #[error("{plane}: {source}")]
    Plane { plane: &'static str, source: DecodeError },
    /// Planes of other lengths than the header says, or than the view's size.
    #[error("{plane} has {len} texels or bytes, must have {expected}")]
    Length { plane: &'static str, len: usize, expected: usize },
}

/// Limits that a decoder checks before it allocates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DecodeLimits {
    /// Texels of one image.
    pub max_texels: usize,
    /// Packed bytes of one image, all planes.
    pub max_payload_bytes: usize,
    /// Bytes of one image before any packing, all planes: images that pack best would take the most memory.
    pub max_image_bytes: usize,
}

impl Default for DecodeLimits {
    /// 16 million texels, 256 MiB packed: some fifty times the needs of the largest planned sample image. 1 GiB unpacked:
    /// the visibility of all lights at 1920×1080 takes half of that.
    fn default() -> Self {
        Self { max_texels: 1 << 24, max_payload_bytes: 256 << 20, max_image_bytes: 1 << 30 }
    }
}

impl DecodeLimits {
    /// Those of views: 67 million pixels, as of 8192×8192.
    pub const VIEWS: Self = Self { max_texels: 1 << 26, max_payload_bytes: 1 << 30, max_image_bytes: 1 << 30 };

    /// Texels of an image that is within the limits.
    ///
    /// # Errors
    /// Names the side or the product that is zero or too large.
    pub fn texels(&self, width: u32, height: u32) -> Result<usize, DecodeError> {
        if width == 0 || height == 0 {
            return Err(DecodeError::Header { field: "size", reason: "zero" });
        }
        check_limit("width", u64::from(width), u64::from(MAX_IMAGE_SIDE_PX))?;
        check_limit("height", u64::from(height), u64::from(MAX_IMAGE_SIDE_PX))?;
        let texels = u64::from(width) * u64::from(height);
        check_limit("texels", texels, self.max_texels as u64)?;
        Ok(texels as usize)
    }
}

pub(crate) fn check_limit(field: &'static str, value: u64, limit: u64) -> Result<(), DecodeError> {
    if value > limit { Err(DecodeError::Limit { field, value, limit }) } else { Ok(()) }
}
