//! Baseline JPEG by the libraries, with the size checked against the frame's.

use std::io::Cursor;

use glam::UVec2;
use image::codecs::jpeg::JpegDecoder;
use jpeg_encoder::Encoder;

use crate::FrameError;
use crate::picture::decode_rgb;

/// Packs three bytes a pixel.
pub(crate) fn encode(width: u32, height: u32, rgb: &[u8], quality: u8) -> Result<Vec<u8>, FrameError> {
    if !(1..=100).contains(&quality) {
        return Err(FrameError::Quality(quality));
    }
    let (Ok(columns), Ok(rows)) = (u16::try_from(width), u16::try_from(height)) else {
        return Err(FrameError::Size { width, height, rgb_bytes: rgb.len() });
    };
    let mut data = Vec::new();
    Encoder::new(&mut data, quality)
        .encode(rgb, columns, rows, jpeg_encoder::ColorType::Rgb)
        .map_err(|error| FrameError::Jpeg(error.to_string()))?;
    Ok(data)
}

/// Unpacks a picture that must be of the given size, which the caller has checked against its limits.
pub(crate) fn decode(size_px: UVec2, data: &[u8]) -> Result<Vec<u8>, FrameError> {
    let decoded = JpegDecoder::new(Cursor::new(data)).and_then(|decoder| decode_rgb(decoder, size_px));
    decoded.map_err(|error| FrameError::Jpeg(error.to_string()))
}
