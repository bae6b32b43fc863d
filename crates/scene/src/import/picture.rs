//! Textures from encoded images, and the texture files of OBJ and PLY models; sizes are checked before a texel is decoded.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, ImageReader};
use rayon::prelude::*;

use super::file_search::{Found, search};
use super::{Import, MissingTextures, decoded, ktx2};
use crate::{Fault, Limits, SceneErrorKind, Texture, at_most, shortened};

/// The meaning of a picture's channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Content {
    /// sRGB-encoded.
    Colors,
    /// Factors.
    Data,
    /// Directions, with 0…1 for -1…1.
    Normals,
}

impl Content {
    /// The texel in place of a missing picture: half as bright as white, or what leaves a material's factors and
    /// normals alone.
    fn stand_in(self) -> [u8; 4] {
        match self {
            Self::Colors => [188, 188, 188, 255],
            Self::Data => [255; 4],
            Self::Normals => [128, 128, 255, 255],
        }
    }
}

/// An image file's bytes and its name in messages.
pub(crate) struct EncodedPicture {
    pub element: String,
    /// The file's name, as the scene has it.
    pub file: String,
    /// `None` where the file is missing.
    pub bytes: Option<Vec<u8>>,
    pub content: Content,
}

/// Decodes all images in parallel, after their headers show that they fit the limits together.
pub(crate) fn decode_all(
    pictures: &[EncodedPicture],
    limits: &Limits,
    missing: MissingTextures,
) -> Result<Vec<Texture>, Fault> {
    let files: Vec<String> = pictures.iter().filter(|p| p.bytes.is_none()).map(|p| p.file.clone()).collect();
    if !files.is_empty() && missing == MissingTextures::Refuse {
        return Err(Fault::new("textures", SceneErrorKind::MissingFiles(files)));
    } else if !files.is_empty() {
        let names = shortened(files.join(", "));
        tracing::warn!("{} textures are missing, and grey takes their place: {names}", files.len());
    }
    let mut decoded_bytes = 0u64;
    for picture in pictures {
        let Some(bytes) = &picture.bytes else { continue };
        let (width_px, height_px) = size_px(picture, bytes)?;
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

/// A format is known by its first bytes. TGA has no such signature and is known by the name's ending.
fn reader<'b>(picture: &EncodedPicture, bytes: &'b [u8]) -> Result<ImageReader<Cursor<&'b [u8]>>, Fault> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let mut reader = reader.map_err(|e| Fault::io(&picture.element, e))?;
    let is_tga = picture.file.to_ascii_lowercase().ends_with(".tga");
    if reader.format().is_none() && is_tga {
        reader.set_format(ImageFormat::Tga);
    }
    Ok(reader)
}

fn size_px(picture: &EncodedPicture, bytes: &[u8]) -> Result<(u32, u32), Fault> {
    if ktx2::is_ktx2(bytes) {
        return ktx2::size_px(bytes).map_err(|reason| ktx2_fault(picture, &reason));
    }
    reader(picture, bytes)?.into_dimensions().map_err(|e| Fault::malformed(&picture.element, e.to_string()))
}

fn ktx2_fault(picture: &EncodedPicture, reason: &str) -> Fault {
    let advice = "`npx @gltf-transform/cli ktxdecompress IN OUT` converts a file that is intact";
    Fault::malformed(&picture.element, format!("{reason}; {advice}"))
}

fn decode(picture: &EncodedPicture, limits: &Limits) -> Result<Texture, Fault> {
    let is_srgb = picture.content == Content::Colors;
    let Some(bytes) = &picture.bytes else {
        return Ok(Texture { width_px: 1, height_px: 1, is_srgb, srgba8: picture.content.stand_in().to_vec() });
    };
    if ktx2::is_ktx2(bytes) {
        let (width_px, height_px) = size_px(picture, bytes)?;
        let srgba8 = ktx2::rgba8(bytes).map_err(|reason| ktx2_fault(picture, &reason))?;
        return Ok(Texture { width_px, height_px, is_srgb, srgba8 });
    }
    let mut reader = reader(picture, bytes)?;
    let mut image_limits = image::Limits::default();
    image_limits.max_image_width = Some(limits.texture_side_px);
    image_limits.max_image_height = Some(limits.texture_side_px);
    // 16-bit channels and a decoder's working copy take a few times the 8-bit texels.
    image_limits.max_alloc = Some(limits.texture_bytes.saturating_mul(4));
    reader.limits(image_limits);
    let pixels = reader.decode().map_err(|e| Fault::malformed(&picture.element, e.to_string()))?.into_rgba8();
    let (width_px, height_px) = pixels.dimensions();
    Ok(Texture { width_px, height_px, is_srgb, srgba8: pixels.into_raw() })
}

/// The texture files of a model, each read once.
#[derive(Default)]
pub(crate) struct TextureFiles {
    pictures: Vec<EncodedPicture>,
    number_of: HashMap<(String, Content), u32>,
}

/// A reference to a texture file.
pub(crate) struct TextureReference<'n> {
    /// The statement that refers to the file, in messages.
    pub element: String,
    /// Spellings of the file's name. The last one is that of messages.
    pub names: Vec<&'n [u8]>,
    /// A folder relative to the scene's folder, in which the file is looked for before that.
    pub base: &'n Path,
    pub content: Content,
}

impl TextureFiles {
    /// Reads the file unless it is known, and returns its number.
    pub(crate) fn number_of(&mut self, reference: TextureReference, import: &Import) -> Result<u32, Fault> {
        let TextureReference { element, names, base, content } = reference;
        let name = names.last().map(|name| decoded(name).into_owned()).unwrap_or_default();
        let (file, bytes) = match search(&import.folder, &[base, Path::new("")], &names, &import.warnings) {
            Found::File(path) => {
                let file = path.display().to_string();
                if let Some(&number) = self.number_of.get(&(file.clone(), content)) {
                    return Ok(number);
                }
                (file, Some(import.folder.read_relative(&element, &path)?))
            }
            Found::Outside(reason) if import.options.missing_textures == MissingTextures::Refuse => {
                return Err(Fault::forbidden(element, &name, reason));
            }
            Found::Outside(_) | Found::Missing => (name, None),
        };
        let next = self.pictures.len() as u32;
        let number = *self.number_of.entry((file.clone(), content)).or_insert(next);
        if number == next {
            self.pictures.push(EncodedPicture { element, file, bytes, content });
        }
        Ok(number)
    }

    /// Decodes all files, in the order of their numbers.
    pub(crate) fn decode(&self, import: &Import) -> Result<Vec<Texture>, Fault> {
        decode_all(&self.pictures, import.limits, import.options.missing_textures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbaImage;

    fn decoded(pictures: &[EncodedPicture], limits: &Limits) -> Result<Vec<Texture>, Fault> {
        decode_all(pictures, limits, MissingTextures::Refuse)
    }

    fn png(width: u32, height: u32) -> EncodedPicture {
        let mut bytes = Vec::new();
        let pixels = RgbaImage::from_fn(width, height, |x, y| image::Rgba([x as u8, y as u8, 7, 255]));
        pixels.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        EncodedPicture { element: "image 0".into(), file: "a.png".into(), bytes: Some(bytes), content: Content::Colors }
    }

    #[test]
    fn decodes_rows_top_down() {
        let textures = decoded(&[png(3, 2)], &Limits::default()).unwrap();
        assert_eq!((textures[0].width_px, textures[0].height_px), (3, 2));
        assert_eq!(textures[0].srgba8[3 * 4..3 * 4 + 4], [0, 1, 7, 255]);
    }

    #[test]
    fn a_header_that_claims_65535_squared_is_refused_before_decoding() {
        let mut picture = png(1, 1);
        picture.bytes.as_mut().unwrap()[16..24].copy_from_slice(&[0, 0, 255, 255, 0, 0, 255, 255]);
        // The header's checksum is wrong as well. Either reason is right; an allocation is not.
        assert!(decoded(&[picture], &Limits::default()).is_err());
    }

    #[test]
    fn sides_and_total_are_limited() {
        let sides = Limits { texture_side_px: 2, ..Limits::default() };
        let total = Limits { texture_bytes: 40, ..Limits::default() };
        for limits in [sides, total] {
            let fault = decoded(&[png(3, 2), png(3, 2)], &limits).unwrap_err().in_file("a");
            assert!(matches!(fault.kind, SceneErrorKind::TooLarge { .. }), "{fault}");
        }
    }
}
