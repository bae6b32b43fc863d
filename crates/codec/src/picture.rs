//! Pictures of file formats, decoded to a size that is known.

use glam::UVec2;
use image::error::{ParameterError, ParameterErrorKind};
use image::{ColorType, ImageDecoder, ImageError, ImageResult, Limits};

/// Three bytes a pixel of a picture that must be of the given size.
pub(crate) fn decode_rgb(mut decoder: impl ImageDecoder, size_px: UVec2) -> ImageResult<Vec<u8>> {
    let width = size_px.x;
    let height = size_px.y;
    if decoder.dimensions() != (width, height) || decoder.color_type() != ColorType::Rgb8 {
        let reason = format!("not an RGB picture of {width}×{height}");
        return Err(ImageError::Parameter(ParameterError::from_kind(ParameterErrorKind::Generic(reason))));
    }
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(width), Some(height));
    decoder.set_limits(limits)?;
    let mut rgb = vec![0; width as usize * height as usize * 3];
    decoder.read_image(&mut rgb)?;
    Ok(rgb)
}
