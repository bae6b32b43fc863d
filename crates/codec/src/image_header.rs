//! The header of an encoded depth image, and its checks.

use std::hash::Hasher;

use depth_image::{LightPlanes, MAX_LAYERS, MAX_LIGHTS, SpecularPlanes};

use crate::color_codec::{max_colors_bytes, pack_colors, unpack_colors};
use crate::depth_codec::max_unpacked_bytes;
use crate::error::check_limit;
use crate::tagged::max_packed_bytes;
use crate::words_codec::{WordLayout, max_words_bytes, pack_words, unpack_words};
use crate::{DecodeError, DecodeLimits, InverseDepthRange};

/// Planes of visibility of one sample image: one byte for the environment and each light.
pub const MAX_VISIBILITY_PLANES: usize = SpecularPlanes::visibility_planes(MAX_LIGHTS);

/// Planes of arriving shares of one sample image with light.
pub const MAX_LIGHT_SHARE_PLANES: usize = LightPlanes::share_planes(MAX_LIGHTS);

/// The content of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PlaneKind {
    /// 16-bit codes of inverse depth, with background and holes. Always the first plane.
    InverseDepth,
    /// RGB9E5, linear. Always the second plane of an image without light.
    ColorRgb9e5,
    /// Octahedral normals.
    NormalOct16,
    /// Instance and primitive.
    SurfaceId,
    /// Reflectance and roughness, 8 bits each. Needs normals.
    ReflectanceRoughness8,
    /// The shares of four lights that arrive. Needs reflectance; an image may have several planes of this kind alone.
    Visibility8,
    /// One bit for each ray: whether it passed surfaces that other images hold.
    Passed1,
    /// Inverse depth at texels' corners, with a range of its own.
    CornerInverseDepth,
    /// The number of samples of each line. Always the first plane of a layered image, and of no other.
    LayerCount8,
    /// 16-bit codes of planar depth, layer by layer. Always the second plane of a layered image.
    LayerDepth,
    /// Octahedral normals of triangles. Always the third plane of a layered image.
    PlaneNormalOct8,
    /// Octahedral normals of triangles. Always the second plane of an image with light; normals follow.
    TriangleNormalOct16,
    /// What a white surface reflects of lamps, RGB9E5, linear. Always the fourth plane of an image with light.
    LampsRgb9e5,
    /// What a white surface reflects of the environment, RGB9E5, linear. Always the fifth plane of an image with light.
    EnvironmentRgb9e5,
    /// The arriving shares of four lights. Only images with light have such planes, up to [`MAX_LIGHT_SHARE_PLANES`].
    LightShare8,
}

/// The planes with which an image with light begins.
const FIRST_LIGHT_PLANES: [PlaneKind; 5] = [
    PlaneKind::InverseDepth,
    PlaneKind::TriangleNormalOct16,
    PlaneKind::NormalOct16,
    PlaneKind::LampsRgb9e5,
    PlaneKind::EnvironmentRgb9e5,
];

/// How a plane is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PlaneEncoding {
    /// Runs, then codes predicted by value and slope, tagged by class, LZ4.
    SlopeTaggedLz4,
    /// Samples only, differences along the row, tagged by class, LZ4.
    DifferenceTaggedLz4,
    /// One bit a texel, LZ4.
    BitsLz4,
    /// Samples only, a bit for each that differs from the one before, differences of those, tagged by class, LZ4.
    ChangeTaggedLz4,
}

impl PlaneKind {
    /// The one encoding of this kind.
    #[must_use]
    pub const fn encoding(self) -> PlaneEncoding {
        match self {
            Self::InverseDepth | Self::CornerInverseDepth | Self::LayerDepth => PlaneEncoding::SlopeTaggedLz4,
            Self::Passed1 => PlaneEncoding::BitsLz4,
            _ if self.word_layout().is_none() => PlaneEncoding::ChangeTaggedLz4,
            _ => PlaneEncoding::DifferenceTaggedLz4,
        }
    }

    /// The parts of the words of a plane; `None` for words that are packed as colours.
    const fn word_layout(self) -> Option<WordLayout> {
        match self {
            // Normals of triangles change as seldom as unlit colours do.
            Self::ColorRgb9e5 | Self::TriangleNormalOct16 | Self::LampsRgb9e5 | Self::EnvironmentRgb9e5 => None,
            Self::NormalOct16 => Some(WordLayout::Halves),
            Self::PlaneNormalOct8 => Some(WordLayout::TwoBytes),
            Self::ReflectanceRoughness8 | Self::Visibility8 | Self::LightShare8 => Some(WordLayout::Bytes),
            _ => Some(WordLayout::Whole),
        }
    }

    /// Appends the words of a plane of this kind to `out`.
    pub(crate) fn pack_words(self, words: &[u32], out: &mut Vec<u8>) {
        match self.word_layout() {
            Some(layout) => pack_words(words, layout, out),
            None => pack_colors(words, out),
        }
    }

    /// Reads `count` words of a plane of this kind from the front of `input`.
    pub(crate) fn unpack_words(self, input: &mut &[u8], count: usize) -> Result<Vec<u32>, DecodeError> {
        match self.word_layout() {
            Some(layout) => unpack_words(input, count, layout),
            None => unpack_colors(input, count),
        }
    }

    /// The kind's name in errors.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::InverseDepth => "inverse_depth",
            Self::ColorRgb9e5 => "color_rgb9e5",
            Self::NormalOct16 => "normal_oct16",
            Self::SurfaceId => "surface_id",
            Self::ReflectanceRoughness8 => "reflectance_roughness8",
            Self::Visibility8 => "visibility8",
            Self::Passed1 => "passed1",
            Self::CornerInverseDepth => "corner_inverse_depth",
            Self::LayerCount8 => "layer_count8",
            Self::LayerDepth => "layer_depth",
            Self::PlaneNormalOct8 => "plane_normal_oct8",
            Self::TriangleNormalOct16 => "triangle_normal_oct16",
            Self::LampsRgb9e5 => "lamps_rgb9e5",
            Self::EnvironmentRgb9e5 => "environment_rgb9e5",
            Self::LightShare8 => "light_share8",
        }
    }

    /// Whether only images with light have planes of this kind.
    const fn belongs_to_light(self) -> bool {
        matches!(self, Self::TriangleNormalOct16 | Self::LampsRgb9e5 | Self::EnvironmentRgb9e5 | Self::LightShare8)
    }

    /// Bytes of one texel or sample before any packing; of a line for its number of samples.
    const fn texel_bytes(self) -> usize {
        match self {
            Self::InverseDepth | Self::CornerInverseDepth | Self::PlaneNormalOct8 => 2,
            Self::Passed1 => 1,
            Self::SurfaceId => 8,
            // Words; the first sample's number and the depth of a layered image, unpacked.
            _ => 4,
        }
    }

    /// The most bytes of a plane before LZ4, by its number of values.
    const fn max_raw_bytes(self, values: usize) -> usize {
        match self {
            Self::InverseDepth => max_unpacked_bytes(values),
            Self::CornerInverseDepth => CORNER_RANGE_BYTES + max_unpacked_bytes(values),
            Self::SurfaceId => 2 * max_words_bytes(values, WordLayout::Whole),
            Self::Passed1 => values.div_ceil(8),
            Self::LayerCount8 | Self::LayerDepth => max_packed_bytes(values),
            _ => match self.word_layout() {
                Some(layout) => max_words_bytes(values, layout),
                None => max_colors_bytes(values),
            },
        }
    }
}

/// The samples of a layered image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LayeredCounts {
    /// All samples of all lines.
    pub sample_count: u32,
    /// Some line of a layered depth image met more surfaces than it has samples. Light fields do not say.
    pub truncated: bool,
}

/// One plane of an image's payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PlaneHeader {
    /// The content of the plane.
    pub kind: PlaneKind,
    /// The packing of the plane.
    pub encoding: PlaneEncoding,
    /// Bytes before LZ4. Bounded by the image's size.
    pub raw_bytes: u32,
    /// Bytes in the payload.
    pub packed_bytes: u32,
}

/// Bytes of a plane of corners before its codes.
const CORNER_RANGE_BYTES: usize = 8;

/// Size, planes and range of an encoded sample image. The camera is sent apart.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageHeader {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The range that the 16-bit codes of inverse depth span; both 0 in a layered image, whose codes span its camera's range.
    pub inverse_depth_range: InverseDepthRange,
    /// The samples of a layered image; `None` for a depth image.
    pub layered: Option<LayeredCounts>,
    /// The planes, in the order of the payload.
    pub planes: Vec<PlaneHeader>,
}

impl ImageHeader {
    /// Checks everything that can be checked without the payload; gives the number of texels, or of lines.
    ///
    /// # Errors
    /// Names the field that is wrong or over a limit.
    pub fn validate(&self, limits: &DecodeLimits) -> Result<usize, DecodeError> {
        let texels = limits.texels(self.width, self.height)?;
        self.inverse_depth_range.validate()?;
        self.validate_kinds()?;
        if self.layered.is_some() && !self.inverse_depth_range.is_empty() {
            return Err(DecodeError::Header { field: "inverse_depth_range", reason: "not 0 in a layered image" });
        }
        let samples = self.layered.map_or(texels, |layered| layered.sample_count as usize);
        check_limit("sample_count", samples as u64, texels as u64 * u64::from(MAX_LAYERS))?;
        let mut image_bytes = 0;
        for plane in &self.planes {
            if plane.encoding != plane.kind.encoding() {
                return Err(DecodeError::Header { field: "planes.encoding", reason: "not the encoding of this kind" });
            }
            let values = match plane.kind {
                PlaneKind::CornerInverseDepth => self.corners(),
                PlaneKind::LayerCount8 => texels,
                _ => samples,
            };
            check_limit("planes.raw_bytes", u64::from(plane.raw_bytes), plane.kind.max_raw_bytes(values) as u64)?;
            image_bytes += values as u64 * plane.kind.texel_bytes() as u64;
        }
        check_limit("image_bytes", image_bytes, limits.max_image_bytes as u64)?;
        check_limit("payload_bytes", self.payload_bytes(), limits.max_payload_bytes as u64)?;
        Ok(texels)
    }

    /// Depth and light, or depth and colour, or counts, depths, normals of triangles (but of a light field) and colour; then \[normal\], \[surface id\],
    /// \[reflectance, visibility*\], \[passed\], \[corners\]; reflectance only with normals.
    fn validate_kinds(&self) -> Result<(), DecodeError> {
        use PlaneKind::{ColorRgb9e5, InverseDepth, LayerCount8, LayerDepth, PlaneNormalOct8};
        let kinds: Vec<_> = self.planes.iter().map(|plane| plane.kind).collect();
        match kinds.iter().any(|kind| kind.belongs_to_light()) {
            true if self.layered.is_some() => return Err(wrong_kinds("of depth images alone")),
            true => return validate_light_kinds(&kinds),
            false => {}
        }
        let (first, reason): (&[PlaneKind], _) = match self.layered {
            None => (&[InverseDepth, ColorRgb9e5], "must begin with inverse depth and colour"),
            // A light field has its own direction for a normal.
            Some(_) if kinds.len() == 3 => (&[LayerCount8, LayerDepth, ColorRgb9e5], "must be those of a light field"),
            Some(_) => {
                (&[LayerCount8, LayerDepth, PlaneNormalOct8, ColorRgb9e5], "must begin with those of a layered image")
            }
        };
        let Some(rest) = kinds.strip_prefix(first) else {
            return Err(wrong_kinds(reason));
        };
        let (normals, rest) = leading(rest, PlaneKind::NormalOct16);
        let (surface_ids, rest) = leading(rest, PlaneKind::SurfaceId);
        let (reflectances, rest) = leading(rest, PlaneKind::ReflectanceRoughness8);
        let (visibilities, rest) = leading(rest, PlaneKind::Visibility8);
        let (passed, rest) = leading(rest, PlaneKind::Passed1);
        let (corners, rest) = leading(rest, PlaneKind::CornerInverseDepth);
        if !rest.is_empty() || [normals, surface_ids, reflectances, passed, corners].iter().any(|&count| count > 1) {
            return Err(wrong_kinds("repeated or out of order"));
        }
        if self.layered.is_some() && [surface_ids, passed, corners] != [0; 3] {
            return Err(wrong_kinds("of depth images alone"));
        }
        if reflectances > normals || (visibilities > 0 && reflectances == 0) {
            return Err(wrong_kinds("reflectance without normals, or visibility without reflectance"));
        }
        check_limit("planes.visibility8", visibilities as u64, MAX_VISIBILITY_PLANES as u64)
    }

    /// Corners of texels, for sides that have been checked.
    pub(crate) fn corners(&self) -> usize {
        (self.width as usize + 1) * (self.height as usize + 1)
    }

    /// Bytes of all planes in the payload.
    #[must_use]
    pub fn payload_bytes(&self) -> u64 {
        self.planes.iter().map(|plane| u64::from(plane.packed_bytes)).sum()
    }

    /// CRC-32 of every field, for the chunk that carries the header.
    #[must_use]
    pub fn crc32(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        let range = self.inverse_depth_range;
        for word in [self.width, self.height, range.least_per_m.to_bits(), range.greatest_per_m.to_bits()] {
            hasher.update(&word.to_le_bytes());
        }
        if let Some(LayeredCounts { sample_count, truncated }) = self.layered {
            hasher.update(&sample_count.to_le_bytes());
            hasher.update(&[u8::from(truncated)]);
        }
        for plane in &self.planes {
            hasher.write(&[plane.kind as u8, plane.encoding as u8]);
            hasher.update(&plane.raw_bytes.to_le_bytes());
            hasher.update(&plane.packed_bytes.to_le_bytes());
        }
        hasher.finalize()
    }
}

pub(crate) const fn wrong_kinds(reason: &'static str) -> DecodeError {
    DecodeError::Header { field: "planes.kind", reason }
}

/// The planes of [`FIRST_LIGHT_PLANES`], then \[share*\], \[passed\].
fn validate_light_kinds(kinds: &[PlaneKind]) -> Result<(), DecodeError> {
    let Some(rest) = kinds.strip_prefix(&FIRST_LIGHT_PLANES) else {
        let reason = "must begin with inverse depth, normals of triangles, normals, lamps and environment";
        return Err(wrong_kinds(reason));
    };
    let (shares, rest) = leading(rest, PlaneKind::LightShare8);
    let (passed, rest) = leading(rest, PlaneKind::Passed1);
    if !rest.is_empty() || passed > 1 {
        return Err(wrong_kinds("repeated or out of order, or not of an image with light"));
    }
    check_limit("planes.light_share8", shares as u64, MAX_LIGHT_SHARE_PLANES as u64)
}

/// The count of planes of a kind at the front, and the planes that follow.
fn leading(kinds: &[PlaneKind], kind: PlaneKind) -> (usize, &[PlaneKind]) {
    let count = kinds.iter().take_while(|&&other| other == kind).count();
    (count, &kinds[count..])
}
