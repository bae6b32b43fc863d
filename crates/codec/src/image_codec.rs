//! A depth image to header and payload, and back.

use bytes::Bytes;
use depth_image::{Camera, DepthImage, LightPlanes, SampleImageError, SpecularPlanes, SurfaceId};
use glam::UVec2;

use crate::depth_codec::{decode_depth, encode_depth};
use crate::image_header::wrong_kinds;
use crate::lz4::expand_lz4;
use crate::runs::Runs;
use crate::tagged::{take, take_array};
use crate::words_codec::{WordLayout, pack_words, unpack_words};
use crate::{DecodeError, DecodeLimits, ImageHeader, InverseDepthRange, LayeredCounts, PlaneHeader, PlaneKind};

/// An encoded sample image, without its camera.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedImage {
    /// The description of the payload.
    pub header: ImageHeader,
    /// The planes, one after the other.
    pub payload: Bytes,
}

/// Packs an image. Inverse depth is quantised to 16 bits over the image's range. Other planes are kept to the bit at
/// samples, and decode to zeros at texels without one. An image with light is encoded with all of its planes but surface
/// keys.
///
/// # Errors
/// Planes that do not form an image; planes of highlights without normals.
pub fn encode_depth_image(image: &DepthImage) -> Result<EncodedImage, SampleImageError> {
    image.validate()?;
    if image.specular.is_some() && image.normal_oct16.is_none() {
        return Err(SampleImageError::Size { plane: "normal", len: 0, expected: image.inverse_depth_per_m.len() });
    }
    let depth = encode_depth(&image.inverse_depth_per_m);
    let mut packer = Packer::default();
    packer.push(PlaneKind::InverseDepth, &depth.bytes);
    match &image.light {
        Some(light) => pack_light(image, light, &depth.runs, &mut packer),
        None => pack_color(image, &depth.runs, &mut packer),
    }
    if let Some(passed) = &image.passed {
        packer.push(PlaneKind::Passed1, &pack_bits(passed));
    }
    if let Some(corners) = &image.corner_inverse_depth_per_m {
        packer.push(PlaneKind::CornerInverseDepth, &pack_corners(corners));
    }
    Ok(packer.finish(image.size_px(), depth.range, None))
}

/// Packs colour, and what a method or highlights need beside it.
fn pack_color(image: &DepthImage, runs: &Runs, packer: &mut Packer) {
    packer.push_words(PlaneKind::ColorRgb9e5, &runs.gather(&image.color_rgb9e5));
    if let Some(normals) = &image.normal_oct16 {
        packer.push_words(PlaneKind::NormalOct16, &runs.gather(normals));
    }
    if let Some(ids) = &image.surface_id {
        packer.write(PlaneKind::SurfaceId, |out| pack_surface_ids(&runs.gather(ids), out));
    }
    for (kind, plane) in image.specular.iter().flat_map(specular_planes) {
        packer.push_words(kind, &runs.gather(plane));
    }
}

/// Packs light and both normals, of an image that has passed its validation.
fn pack_light(image: &DepthImage, light: &LightPlanes, runs: &Runs, packer: &mut Packer) {
    packer.push_words(PlaneKind::TriangleNormalOct16, &runs.gather(&light.triangle_normal_oct16));
    if let Some(normals) = &image.normal_oct16 {
        packer.push_words(PlaneKind::NormalOct16, &runs.gather(normals));
    }
    packer.push_words(PlaneKind::LampsRgb9e5, &runs.gather(&light.lamps_rgb9e5));
    packer.push_words(PlaneKind::EnvironmentRgb9e5, &runs.gather(&light.environment_rgb9e5));
    for share in &light.share8 {
        packer.push_words(PlaneKind::LightShare8, &runs.gather(share));
    }
}

/// The planes of highlights, in the order of the payload.
pub(crate) fn specular_planes(specular: &SpecularPlanes) -> impl Iterator<Item = (PlaneKind, &Vec<u32>)> {
    let visibilities = specular.visibility8.iter().map(|plane| (PlaneKind::Visibility8, plane));
    std::iter::once((PlaneKind::ReflectanceRoughness8, &specular.reflectance_srgb8_roughness8)).chain(visibilities)
}

/// Unpacks an image. The camera must have passed its own validation.
///
/// # Errors
/// A header that is inconsistent, over the limits or not of the camera's size. A payload that does not decode to exactly
/// the planes of the header.
pub fn decode_depth_image(
    header: &ImageHeader,
    camera: Camera,
    payload: &[u8],
    limits: &DecodeLimits,
) -> Result<DepthImage, DecodeError> {
    let texels = header.validate(limits)?;
    check_payload(header, camera.size_px(), payload)?;
    let [first, others @ ..] = &header.planes[..] else {
        return Err(DecodeError::Header { field: "planes", reason: "none" });
    };
    let mut packed = payload;
    let (runs, inverse_depth_per_m) =
        decode_depth(&expand_plane(first, &mut packed)?, texels, header.inverse_depth_range)?;
    let mut image = DepthImage {
        camera,
        inverse_depth_per_m,
        color_rgb9e5: Vec::new(),
        normal_oct16: None,
        surface_id: None,
        specular: None,
        passed: None,
        corner_inverse_depth_per_m: None,
        light: None,
    };
    for plane in others {
        unpack_plane(plane, &mut packed, |input| decode_plane(plane.kind, input, &runs, header.corners(), &mut image))?;
    }
    Ok(image)
}

/// Planes that are packed one after another.
#[derive(Default)]
pub(crate) struct Packer {
    planes: Vec<PlaneHeader>,
    payload: Vec<u8>,
}

impl Packer {
    fn push(&mut self, kind: PlaneKind, raw: &[u8]) {
        let packed = lz4_flex::block::compress(raw);
        self.payload.extend_from_slice(&packed);
        self.planes.push(PlaneHeader {
            kind,
            encoding: kind.encoding(),
            raw_bytes: raw.len() as u32,
            packed_bytes: packed.len() as u32,
        });
    }

    /// Packs a plane of words.
    pub fn push_words(&mut self, kind: PlaneKind, words: &[u32]) {
        self.write(kind, |out| kind.pack_words(words, out));
    }

    pub fn write(&mut self, kind: PlaneKind, write: impl FnOnce(&mut Vec<u8>)) {
        let mut raw = Vec::new();
        write(&mut raw);
        self.push(kind, &raw);
    }

    /// The image of the planes.
    pub fn finish(self, size_px: UVec2, range: InverseDepthRange, layered: Option<LayeredCounts>) -> EncodedImage {
        let [width, height] = size_px.to_array();
        let header = ImageHeader { width, height, inverse_depth_range: range, layered, planes: self.planes };
        EncodedImage { header, payload: self.payload.into() }
    }
}

/// Checks that an image is of its camera's size, and its payload as long as its header says.
pub(crate) fn check_payload(header: &ImageHeader, camera_px: UVec2, payload: &[u8]) -> Result<(), DecodeError> {
    let width = header.width;
    let height = header.height;
    let [camera_width, camera_height] = camera_px.to_array();
    if (width, height) != (camera_width, camera_height) {
        return Err(DecodeError::CameraSize { width, height, camera_width, camera_height });
    }
    if payload.len() as u64 != header.payload_bytes() {
        return Err(DecodeError::Corrupt { field: "payload", reason: "not as long as the header says" });
    }
    Ok(())
}

/// Unpacks the next plane with `unpack`, which must leave none of its bytes.
pub(crate) fn unpack_plane<T>(
    plane: &PlaneHeader,
    packed: &mut &[u8],
    unpack: impl FnOnce(&mut &[u8]) -> Result<T, DecodeError>,
) -> Result<T, DecodeError> {
    let raw = expand_plane(plane, packed)?;
    let mut input = &raw[..];
    let unpacked = unpack(&mut input)?;
    if input.is_empty() {
        return Ok(unpacked);
    }
    Err(DecodeError::Corrupt { field: plane.kind.name(), reason: "bytes left over" })
}

fn expand_plane(plane: &PlaneHeader, packed: &mut &[u8]) -> Result<Vec<u8>, DecodeError> {
    let field = plane.kind.name();
    let (own, rest) = packed
        .split_at_checked(plane.packed_bytes as usize)
        .ok_or(DecodeError::Corrupt { field, reason: "ends too early" })?;
    *packed = rest;
    expand_lz4(own, plane.raw_bytes as usize, field)
}

fn decode_plane(
    kind: PlaneKind,
    input: &mut &[u8],
    runs: &Runs,
    corners: usize,
    image: &mut DepthImage,
) -> Result<(), DecodeError> {
    let samples = runs.sample_count();
    match kind {
        PlaneKind::InverseDepth => {}
        PlaneKind::SurfaceId => {
            let nothing = SurfaceId { instance: 0, primitive: 0 };
            image.surface_id = Some(runs.scatter(&unpack_surface_ids(input, samples)?, nothing));
        }
        PlaneKind::Passed1 => {
            let texels = image.inverse_depth_per_m.len();
            let bits = take(input, texels.div_ceil(8))?;
            image.passed = Some((0..texels).map(|index| bits[index / 8] >> (index % 8) & 1 != 0).collect());
        }
        PlaneKind::CornerInverseDepth => {
            image.corner_inverse_depth_per_m = Some(unpack_corners(std::mem::take(input), corners)?);
        }
        PlaneKind::LayerCount8 | PlaneKind::LayerDepth | PlaneKind::PlaneNormalOct8 => {
            return Err(wrong_kinds("of layered images alone"));
        }
        _ => put_words(image, kind, runs.scatter(&kind.unpack_words(input, samples)?, 0)),
    }
    Ok(())
}

/// Adds a plane of words.
fn put_words(image: &mut DepthImage, kind: PlaneKind, words: Vec<u32>) {
    match kind {
        PlaneKind::ColorRgb9e5 => image.color_rgb9e5 = words,
        PlaneKind::NormalOct16 => image.normal_oct16 = Some(words),
        PlaneKind::ReflectanceRoughness8 | PlaneKind::Visibility8 => put_specular(&mut image.specular, kind, words),
        PlaneKind::TriangleNormalOct16 => image.light.get_or_insert_default().triangle_normal_oct16 = words,
        PlaneKind::LampsRgb9e5 => image.light.get_or_insert_default().lamps_rgb9e5 = words,
        PlaneKind::EnvironmentRgb9e5 => image.light.get_or_insert_default().environment_rgb9e5 = words,
        _ => image.light.get_or_insert_default().share8.push(words),
    }
}

/// Adds a plane of inputs of highlights.
pub(crate) fn put_specular(specular: &mut Option<SpecularPlanes>, kind: PlaneKind, words: Vec<u32>) {
    let specular = specular.get_or_insert_default();
    match kind {
        PlaneKind::ReflectanceRoughness8 => specular.reflectance_srgb8_roughness8 = words,
        _ => specular.visibility8.push(words),
    }
}

fn pack_bits(bits: &[bool]) -> Vec<u8> {
    bits.chunks(8).map(|eight| (0..).zip(eight).map(|(place, &bit)| u8::from(bit) << place).sum()).collect()
}

fn pack_corners(corners: &[f32]) -> Vec<u8> {
    let depth = encode_depth(corners);
    let range = [depth.range.least_per_m, depth.range.greatest_per_m].map(f32::to_le_bytes);
    [range.as_flattened(), &depth.bytes].concat()
}

fn unpack_corners(mut input: &[u8], corners: usize) -> Result<Vec<f32>, DecodeError> {
    let least_per_m = f32::from_le_bytes(take_array(&mut input)?);
    let greatest_per_m = f32::from_le_bytes(take_array(&mut input)?);
    let range = InverseDepthRange { least_per_m, greatest_per_m };
    range.validate()?;
    Ok(decode_depth(input, corners, range)?.1)
}

fn pack_surface_ids(ids: &[SurfaceId], out: &mut Vec<u8>) {
    let (instances, primitives): (Vec<_>, Vec<_>) = ids.iter().map(|id| (id.instance, id.primitive)).unzip();
    pack_words(&instances, WordLayout::Whole, out);
    pack_words(&primitives, WordLayout::Whole, out);
}

fn unpack_surface_ids(input: &mut &[u8], count: usize) -> Result<Vec<SurfaceId>, DecodeError> {
    let instances = unpack_words(input, count, WordLayout::Whole)?;
    let primitives = unpack_words(input, count, WordLayout::Whole)?;
    let pairs = instances.into_iter().zip(primitives);
    Ok(pairs.map(|(instance, primitive)| SurfaceId { instance, primitive }).collect())
}

#[cfg(test)]
#[path = "image_codec_tests.rs"]
mod tests;
