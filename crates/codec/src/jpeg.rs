//! Baseline JPEG by the libraries, with the size checked against the frame's.

use std::io::Cursor;

use image::{ColorType, ImageDecoder, Limits, codecs::jpeg::JpegDecoder};
use jpeg_encoder::Encoder;

use crate::FrameError;

/// Packs three bytes a pixel.
pub(crate) fn encode(width: u32, height: u32, rgb: &[u8], quality: u8) -> Result<Vec<u8>, FrameError> {
    if !(1..=100).contains(&quality) {
        return Err(FrameError::Quality(quality));
    }
    let side = |side: u32| u16::try_from(side).map_err(|_| FrameError::Size { width, height, rgb_bytes: rgb.len() });
    let mut data = Vec::new();
    Encoder::new(&mut data, quality)
        .encode(rgb, side(width)?, side(height)?, jpeg_encoder::ColorType::Rgb)
        .map_err(|error| FrameError::Jpeg(error.to_string()))?;
    Ok(data)
}

/// Unpacks a picture that must be of the given size, which the caller has checked against its limits.
pub(crate) fn decode(width: u32, height: u32, data: &[u8]) -> Result<Vec<u8>, FrameError> {
    let jpeg_error = |error: image::ImageError| FrameError::Jpeg(error.to_string());
    let mut decoder = JpegDecoder::new(Cursor::new(data)).map_err(jpeg_error)?;
    if decoder.dimensions() != (width, height) || decoder.color_type() != ColorType::Rgb8 {
        return Err(FrameError::Jpeg(format!("not an RGB picture of {width}×{height}")));
    }
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(width), Some(height));
    decoder.set_limits(limits).map_err(jpeg_error)?;
    let mut rgb = vec![0; width as usize * height as usize * 3];
    decoder.read_image(&mut rgb).map_err(jpeg_error)?;
    Ok(rgb)
}
