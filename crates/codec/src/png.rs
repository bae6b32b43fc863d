//! PNG by the library, in its fastest compression, with the size checked against the frame's.

use std::io::Cursor;

use glam::UVec2;
use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _, ImageError};

use crate::FrameError;
use crate::picture::decode_rgb;

/// Packs three bytes a pixel.
pub(crate) fn encode(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, FrameError> {
    let mut data = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut data, CompressionType::Fast, FilterType::Adaptive);
    encoder.write_image(rgb, width, height, ExtendedColorType::Rgb8).map_err(png_error)?;
    Ok(data)
}

/// Unpacks a picture that must be of the given size, which the caller has checked against its limits.
pub(crate) fn decode(size_px: UVec2, data: &[u8]) -> Result<Vec<u8>, FrameError> {
    PngDecoder::new(Cursor::new(data)).and_then(|decoder| decode_rgb(decoder, size_px)).map_err(png_error)
}

fn png_error(error: ImageError) -> FrameError {
    FrameError::Png(error.to_string())
}
