//! Layered images and light fields to header and payload, and back.

use depth_image::{LayeredDepthImage, LayeredLightField, LightFieldCamera, ParallelCamera, SampleImageError};
use glam::UVec2;

use crate::image_codec::{Packer, check_payload, put_specular, specular_planes, unpack_plane};
use crate::image_header::wrong_kinds;
use crate::layered_codec::{
    gather, layer_by_layer, pack_depths, pack_layer_counts, scatter, unpack_depths, unpack_layer_counts,
};
use crate::{
    DecodeError, DecodeLimits, EncodedImage, ImageHeader, InverseDepthRange, LayeredCounts, PlaneHeader, PlaneKind,
};

/// Packs a layered image. Depth is quantised to 16 bits over the camera's range, and all else is kept to the bit.
///
/// # Errors
/// Samples that are not those of the camera's lines; planes of highlights without normals.
pub fn encode_layered_image(image: &LayeredDepthImage) -> Result<EncodedImage, SampleImageError> {
    image.validate()?;
    if image.specular.is_some() && image.normal_oct16.is_none() {
        return Err(SampleImageError::Plane { plane: "normal", len: 0, expected: image.sample_count() });
    }
    let (places, mut packer) = pack_lines(&image.first, &image.planar_depth_m, image.camera.range_m);
    let normals: Vec<u32> = places.iter().map(|&at| image.plane_normal_oct8[at as usize].into()).collect();
    packer.push_words(PlaneKind::PlaneNormalOct8, &normals);
    packer.push_words(PlaneKind::ColorRgb9e5, &gather(&image.color_rgb9e5, &places));
    if let Some(normals) = &image.normal_oct16 {
        packer.push_words(PlaneKind::NormalOct16, &gather(normals, &places));
    }
    for (kind, plane) in image.specular.iter().flat_map(specular_planes) {
        packer.push_words(kind, &gather(plane, &places));
    }
    let counts = LayeredCounts { sample_count: places.len() as u32, truncated: image.truncated };
    Ok(packer.finish(image.camera.size_px, InverseDepthRange::default(), Some(counts)))
}

/// Packs a light field. Depth is quantised to 16 bits over the camera's range; radiance is kept to the bit.
///
/// # Errors
/// Samples that are not those of the camera's lines.
pub fn encode_light_field(field: &LayeredLightField) -> Result<EncodedImage, SampleImageError> {
    field.validate()?;
    let (places, mut packer) = pack_lines(&field.first, &field.planar_depth_m, field.camera.range_m());
    packer.push_words(PlaneKind::ColorRgb9e5, &gather(&field.radiance_rgb9e5, &places));
    let counts = LayeredCounts { sample_count: places.len() as u32, truncated: false };
    Ok(packer.finish(field.camera.size_px(), InverseDepthRange::default(), Some(counts)))
}

/// Packs the counts and the depths of samples. Gives the places of samples in the order in which all planes are packed.
fn pack_lines(first: &[u32], planar_depth_m: &[f32], range_m: f32) -> (Vec<u32>, Packer) {
    let places = layer_by_layer(first);
    let mut packer = Packer::default();
    packer.write(PlaneKind::LayerCount8, |out| pack_layer_counts(first, out));
    packer.write(PlaneKind::LayerDepth, |out| pack_depths(&gather(planar_depth_m, &places), range_m, out));
    (places, packer)
}

/// The unpacked lines and depths of an image, and its packed planes after them.
struct Lines<'p> {
    first: Vec<u32>,
    planar_depth_m: Vec<f32>,
    truncated: bool,
    /// The places of samples, in the order in which they are packed.
    places: Vec<u32>,
    planes: &'p [PlaneHeader],
    payload: &'p [u8],
}

impl<'p> Lines<'p> {
    /// Unpacks the lines of an image of this size, and the depths of their samples.
    fn unpack(
        header: &'p ImageHeader,
        size_px: UVec2,
        range_m: f32,
        mut payload: &'p [u8],
        limits: &DecodeLimits,
    ) -> Result<Self, DecodeError> {
        let lines = header.validate(limits)?;
        check_payload(header, size_px, payload)?;
        let Some(LayeredCounts { sample_count, truncated }) = header.layered else {
            return Err(wrong_kinds("not those of a layered image"));
        };
        let [counts, depths, planes @ ..] = &header.planes[..] else {
            return Err(DecodeError::Header { field: "planes", reason: "none" });
        };
        let samples = sample_count as usize;
        let first = unpack_plane(counts, &mut payload, |input| unpack_layer_counts(input, lines, samples))?;
        let places = layer_by_layer(&first);
        let depths_m = unpack_plane(depths, &mut payload, |input| unpack_depths(input, samples, range_m))?;
        Ok(Self { first, planar_depth_m: scatter(&depths_m, &places), truncated, places, planes, payload })
    }

    /// Unpacks the next plane, which is one of words.
    fn unpack_words(&mut self, plane: &PlaneHeader) -> Result<Vec<u32>, DecodeError> {
        let count = self.places.len();
        let words = unpack_plane(plane, &mut self.payload, |input| plane.kind.unpack_words(input, count))?;
        Ok(scatter(&words, &self.places))
    }
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
    let mut lines = Lines::unpack(header, camera.size_px, camera.range_m, payload, limits)?;
    if lines.planes.first().is_none_or(|plane| plane.kind != PlaneKind::PlaneNormalOct8) {
        return Err(wrong_kinds("those of a light field"));
    }
    let mut image = LayeredDepthImage {
        camera,
        first: std::mem::take(&mut lines.first),
        planar_depth_m: std::mem::take(&mut lines.planar_depth_m),
        plane_normal_oct8: Vec::new(),
        color_rgb9e5: Vec::new(),
        normal_oct16: None,
        specular: None,
        truncated: lines.truncated,
    };
    for plane in lines.planes {
        let words = lines.unpack_words(plane)?;
        match plane.kind {
            PlaneKind::PlaneNormalOct8 => image.plane_normal_oct8 = words.into_iter().map(|word| word as u16).collect(),
            PlaneKind::ColorRgb9e5 => image.color_rgb9e5 = words,
            PlaneKind::NormalOct16 => image.normal_oct16 = Some(words),
            kind => put_specular(&mut image.specular, kind, words),
        }
    }
    image.validate().map_err(|_| DecodeError::Corrupt { field: "layer_depth", reason: "falls along a line" })?;
    Ok(image)
}

/// Unpacks a light field. The camera must have passed its own validation.
///
/// # Errors
/// A header that is inconsistent, over the limits or not of the camera's size. A payload that does not decode to exactly
/// the planes of the header.
pub fn decode_light_field(
    header: &ImageHeader,
    camera: LightFieldCamera,
    payload: &[u8],
    limits: &DecodeLimits,
) -> Result<LayeredLightField, DecodeError> {
    let mut lines = Lines::unpack(header, camera.size_px(), camera.range_m(), payload, limits)?;
    if lines.truncated {
        return Err(DecodeError::Header { field: "layered.truncated", reason: "of layered depth images alone" });
    }
    let [colors] = lines.planes else {
        return Err(wrong_kinds("not those of a light field"));
    };
    let radiance_rgb9e5 = lines.unpack_words(colors)?;
    let Lines { first, planar_depth_m, .. } = lines;
    let field = LayeredLightField { camera, first, planar_depth_m, radiance_rgb9e5 };
    field.validate().map_err(|_| DecodeError::Corrupt { field: "layer_depth", reason: "falls along a line" })?;
    Ok(field)
}

#[cfg(test)]
#[path = "layered_image_codec_tests.rs"]
mod tests;
