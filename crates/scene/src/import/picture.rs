//! Textures from encoded images; sizes are checked before a texel is decoded.

use std::io::Cursor;

use image::ImageReader;
use rayon::prelude::*;

use crate::error::{Fault, at_most};
use crate::{Limits, Texture};

/// An image file's bytes and its name in messages.
pub(crate) struct EncodedPicture {
    pub element: String,
    pub bytes: Vec<u8>,
    /// See [`Texture::is_srgb`].
    pub is_srgb: bool,
}

/// Decodes all images in parallel, after their headers show that they fit the limits together.
pub(crate) fn decode_all(pictures: &[EncodedPicture], limits: &Limits) -> Result<Vec<Texture>, Fault> {
    let mut decoded_bytes = 0u64;
    for picture in pictures {
        let (width_px, height_px) = size_px(picture)?;
        at_most(
            format!("{}, side in pixels", picture.element),
            width_px.max(height_px).into(),
            limits.texture_side_px.into(),
        )?;
        decoded_bytes += u64::from(width_px) * u64::from(height_px) * 4;
        at_most(format!("{}, decoded textures in bytes", picture.element), decoded_bytes, limits.texture_bytes)?;
    }
    pictures.par_iter().map(|picture| decode(picture, limits)).collect()
}

fn reader(picture: &EncodedPicture) -> Result<ImageReader<Cursor<&[u8]>>, Fault> {
    let reader = ImageReader::new(Cursor::new(picture.bytes.as_slice())).with_guessed_format();
    reader.map_err(|e| Fault::io(&picture.element, e))
}

fn size_px(picture: &EncodedPicture) -> Result<(u32, u32), Fault> {
    reader(picture)?.into_dimensions().map_err(|e| Fault::malformed(&picture.element, e.to_string()))
}

fn decode(picture: &EncodedPicture, limits: &Limits) -> Result<Texture, Fault> {
    let mut reader = reader(picture)?;
    let mut image_limits = image::Limits::default();
    image_limits.max_image_width = Some(limits.texture_side_px);
    image_limits.max_image_height = Some(limits.texture_side_px);
    // 16-bit channels and a decoder's working copy take a few times the 8-bit texels.
    image_limits.max_alloc = Some(limits.texture_bytes.saturating_mul(4));
    reader.limits(image_limits);
    let pixels = reader.decode().map_err(|e| Fault::malformed(&picture.element, e.to_string()))?.into_rgba8();
    let (width_px, height_px) = pixels.dimensions();
    Ok(Texture { width_px, height_px, is_srgb: picture.is_srgb, srgba8: pixels.into_raw() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SceneErrorKind;
    use image::RgbaImage;

    fn png(width: u32, height: u32) -> EncodedPicture {
        let mut bytes = Vec::new();
        let pixels = RgbaImage::from_fn(width, height, |x, y| image::Rgba([x as u8, y as u8, 7, 255]));
        pixels.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
        EncodedPicture { element: "image 0".into(), bytes, is_srgb: true }
    }

    #[test]
    fn decodes_rows_top_down() {
        let textures = decode_all(&[png(3, 2)], &Limits::default()).unwrap();
        assert_eq!((textures[0].width_px, textures[0].height_px), (3, 2));
        assert_eq!(textures[0].srgba8[3 * 4..3 * 4 + 4], [0, 1, 7, 255]);
    }

    #[test]
    fn a_header_that_claims_65535_squared_is_refused_before_decoding() {
        let mut picture = png(1, 1);
        picture.bytes[16..24].copy_from_slice(&[0, 0, 255, 255, 0, 0, 255, 255]);
        // The header's checksum is wrong as well. Either reason is right; an allocation is not.
        assert!(decode_all(&[picture], &Limits::default()).is_err());
    }

    #[test]
    fn sides_and_total_are_limited() {
        let sides = Limits { texture_side_px: 2, ..Limits::default() };
        let total = Limits { texture_bytes: 40, ..Limits::default() };
        for limits in [sides, total] {
            let fault = decode_all(&[png(3, 2), png(3, 2)], &limits).unwrap_err().in_file("a");
            assert!(matches!(fault.kind, SceneErrorKind::TooLarge { .. }), "{fault}");
        }
    }
}
