//! Pictures of file formats by the libraries, with the size checked against the frame's: baseline JPEG, and PNG in its fastest
//! compression.

use glam::UVec2;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::error::{ParameterError, ParameterErrorKind};
use image::{ColorType, ExtendedColorType, ImageDecoder, ImageEncoder as _, ImageError, ImageResult, Limits};

use crate::FrameError;

/// Packs three bytes a pixel as JPEG.
pub(crate) fn encode_jpeg(width: u32, height: u32, rgb: &[u8], quality: u8) -> Result<Vec<u8>, FrameError> {
    let (Ok(columns), Ok(rows)) = (u16::try_from(width), u16::try_from(height)) else {
        return Err(FrameError::Size { width, height, rgb_bytes: rgb.len() });
    };
    let mut data = Vec::new();
    jpeg_encoder::Encoder::new(&mut data, quality)
        .encode(rgb, columns, rows, jpeg_encoder::ColorType::Rgb)
        .map_err(|error| FrameError::Picture { format: "JPEG", reason: error.to_string() })?;
    Ok(data)
}

/// Packs three bytes a pixel as PNG.
pub(crate) fn encode_png(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, FrameError> {
    let mut data = Vec::new();
    PngEncoder::new_with_quality(&mut data, CompressionType::Fast, FilterType::Adaptive)
        .write_image(rgb, width, height, ExtendedColorType::Rgb8)
        .map_err(|error| FrameError::Picture { format: "PNG", reason: error.to_string() })?;
    Ok(data)
}

/// Unpacks a picture that must be of the given size, which the caller has checked against its limits.
pub(crate) fn decode_picture<D: ImageDecoder>(
    format: &'static str,
    decoder: ImageResult<D>,
    size_px: UVec2,
) -> Result<Vec<u8>, FrameError> {
    let decoded = decoder.and_then(|decoder| decode_rgb(decoder, size_px));
    decoded.map_err(|error| FrameError::Picture { format, reason: error.to_string() })
}

fn decode_rgb(mut decoder: impl ImageDecoder, size_px: UVec2) -> ImageResult<Vec<u8>> {
    let [width, height] = size_px.to_array();
    if decoder.dimensions() != (width, height) || decoder.color_type() != ColorType::Rgb8 {
        let reason = format!("not an RGB picture of {width}×{height}");
        return Err(ImageError::Parameter(ParameterError::from_kind(ParameterErrorKind::Generic(reason))));
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(width);
    limits.max_image_height = Some(height);
    decoder.set_limits(limits)?;
    let mut rgb = vec![0; width as usize * height as usize * 3];
    decoder.read_image(&mut rgb)?;
    Ok(rgb)
}
