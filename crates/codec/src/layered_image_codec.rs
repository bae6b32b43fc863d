//! A layered image to header and payload, and back.

use depth_image::{LayeredDepthImage, LayeredError, ParallelCamera};
use glam::UVec2;

use crate::color_codec::{pack_colors, unpack_colors};
use crate::image_codec::{Packer, check_payload, put_specular, unpack_plane};
use crate::image_header::wrong_kinds;
use crate::layered_codec::{
    gather, layer_by_layer, pack_depths, pack_layer_counts, scatter, unpack_depths, unpack_layer_counts,
};
use crate::words_codec::{WordLayout, pack_words, unpack_words};
use crate::{
    DecodeError, DecodeLimits, EncodedImage, ImageHeader, InverseDepthRange, LayeredCounts, PlaneHeader, PlaneKind,
};

/// Packs a layered image. Depth is quantised to 16 bits over the camera's range, and all else is kept to the bit.
///
/// # Errors
/// Samples that are not those of the camera's lines; planes of highlights without normals.
pub fn encode_layered_image(image: &LayeredDepthImage) -> Result<EncodedImage, LayeredError> {
    image.validate()?;
    if image.specular.is_some() && image.normal_oct16.is_none() {
        return Err(LayeredError::Plane { plane: "normal", len: 0, expected: image.sample_count() });
    }
    let places = layer_by_layer(&image.first);
    let mut packer = Packer::default();
    packer.write(PlaneKind::LayerCount8, |out| pack_layer_counts(&image.first, out));
    packer.write(PlaneKind::LayerDepth, |out| {
        pack_depths(&gather(&image.planar_depth_m, &places), image.camera.range_m, out);
    });
    let normals: Vec<u32> = places.iter().map(|&at| image.plane_normal_oct8[at as usize].into()).collect();
    packer.write(PlaneKind::PlaneNormalOct8, |out| pack_words(&normals, WordLayout::TwoBytes, out));
    packer.write(PlaneKind::ColorRgb9e5, |out| pack_colors(&gather(&image.color_rgb9e5, &places), out));
    let mut write = |kind, plane: &[u32], layout| {
        packer.write(kind, |out| pack_words(&gather(plane, &places), layout, out));
    };
    if let Some(normals) = &image.normal_oct16 {
        write(PlaneKind::NormalOct16, normals, WordLayout::Halves);
    }
    if let Some(specular) = &image.specular {
        write(PlaneKind::ReflectanceRoughness8, &specular.reflectance_srgb8_roughness8, WordLayout::Bytes);
        specular.visibility8.iter().for_each(|plane| write(PlaneKind::Visibility8, plane, WordLayout::Bytes));
    }
    Ok(encoded(
        packer,
        image.camera.size_px,
        LayeredCounts { sample_count: places.len() as u32, truncated: image.truncated },
    ))
}

/// The image of packed planes.
pub(crate) fn encoded(packer: Packer, size_px: UVec2, layered: LayeredCounts) -> EncodedImage {
    let [width, height] = size_px.to_array();
    let inverse_depth_range = InverseDepthRange { least_per_m: 0.0, greatest_per_m: 0.0 };
    let header = ImageHeader { width, height, inverse_depth_range, layered: Some(layered), planes: packer.planes };
    EncodedImage { header, payload: packer.payload.into() }
}

/// The lines of a packed image, and its planes after theirs.
pub(crate) struct PackedLines<'p> {
    pub first: Vec<u32>,
    /// Of samples, in the order in which they are packed.
    pub places: Vec<u32>,
    pub truncated: bool,
    pub planes: &'p [PlaneHeader],
    /// Of those planes.
    pub payload: &'p [u8],
}

/// Unpacks the lines of an image of this size.
pub(crate) fn unpack_lines<'p>(
    header: &'p ImageHeader,
    size_px: UVec2,
    payload: &'p [u8],
    limits: &DecodeLimits,
) -> Result<PackedLines<'p>, DecodeError> {
    let lines = header.validate(limits)?;
    check_payload(header, size_px, payload)?;
    let Some(LayeredCounts { sample_count, truncated }) = header.layered else {
        return Err(wrong_kinds("not those of a layered image"));
    };
    let [counts, planes @ ..] = &header.planes[..] else {
        return Err(DecodeError::Header { field: "planes", reason: "none" });
    };
    let mut packed = payload;
    let first = unpack_plane(counts, &mut packed, |input| unpack_layer_counts(input, lines, sample_count as usize))?;
    Ok(PackedLines { places: layer_by_layer(&first), first, truncated, planes, payload: packed })
}

/// Unpacks a layered image. The camera must have passed its own validation.
///
/// # Errors
/// A header that is inconsistent, over the limits or not of the camera's size. A payload that does not decode to exactly
/// the planes of the header.
pub fn decode_layered_image(
    header: &ImageHeader,
    camera: ParallelCamera,
    payload: &[u8],
    limits: &DecodeLimits,
) -> Result<LayeredDepthImage, DecodeError> {
    let PackedLines { first, places, truncated, planes, payload: mut packed } =
        unpack_lines(header, camera.size_px, payload, limits)?;
    if planes.get(1).is_none_or(|plane| plane.kind != PlaneKind::PlaneNormalOct8) {
        return Err(wrong_kinds("those of a light field"));
    }
    let mut image = LayeredDepthImage {
        camera,
        first,
        planar_depth_m: Vec::new(),
        plane_normal_oct8: Vec::new(),
        color_rgb9e5: Vec::new(),
        normal_oct16: None,
        specular: None,
        truncated,
    };
    for plane in planes {
        unpack_plane(plane, &mut packed, |input| decode_plane(plane.kind, input, &places, &mut image))?;
    }
    image.validate().map_err(|_| DecodeError::Corrupt { field: "layer_depth", reason: "falls along a line" })?;
    Ok(image)
}

fn decode_plane(
    kind: PlaneKind,
    input: &mut &[u8],
    places: &[u32],
    image: &mut LayeredDepthImage,
) -> Result<(), DecodeError> {
    let samples = places.len();
    let words = |input: &mut &[u8], layout| -> Result<Vec<u32>, DecodeError> {
        Ok(scatter(&unpack_words(input, samples, layout)?, places))
    };
    match kind {
        PlaneKind::LayerDepth => {
            image.planar_depth_m = scatter(&unpack_depths(input, samples, image.camera.range_m)?, places);
        }
        PlaneKind::PlaneNormalOct8 => {
            let normals = words(input, WordLayout::TwoBytes)?;
            image.plane_normal_oct8 = normals.into_iter().map(|normal| normal as u16).collect();
        }
        PlaneKind::ColorRgb9e5 => image.color_rgb9e5 = scatter(&unpack_colors(input, samples)?, places),
        PlaneKind::NormalOct16 => image.normal_oct16 = Some(words(input, WordLayout::Halves)?),
        PlaneKind::ReflectanceRoughness8 | PlaneKind::Visibility8 => {
            put_specular(&mut image.specular, kind, words(input, WordLayout::Bytes)?);
        }
        _ => return Err(wrong_kinds("of depth images alone")),
    }
    Ok(())
}

#[cfg(test)]
#[path = "layered_image_codec_tests.rs"]
mod tests;
