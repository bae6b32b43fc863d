//! The header of an encoded depth image, and its checks.

use std::hash::Hasher;

use depth_image::{MAX_LIGHTS, SpecularPlanes};

use crate::color_codec::max_colors_bytes;
use crate::depth_codec::max_unpacked_bytes;
use crate::error::check_limit;
use crate::words_codec::{WordLayout, max_words_bytes};
use crate::{DecodeError, DecodeLimits, InverseDepthRange};

/// Planes of visibility of one sample image: one byte for the environment and each light.
pub const MAX_VISIBILITY_PLANES: usize = SpecularPlanes::visibility_planes(MAX_LIGHTS);

/// The content of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PlaneKind {
    /// 16-bit codes of inverse depth, with background and holes. Always the first plane.
    InverseDepth,
    /// RGB9E5, linear. Always the second plane.
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
}

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
            Self::InverseDepth | Self::CornerInverseDepth => PlaneEncoding::SlopeTaggedLz4,
            Self::Passed1 => PlaneEncoding::BitsLz4,
            Self::ColorRgb9e5 => PlaneEncoding::ChangeTaggedLz4,
            Self::NormalOct16 | Self::SurfaceId | Self::ReflectanceRoughness8 | Self::Visibility8 => {
                PlaneEncoding::DifferenceTaggedLz4
            }
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
        }
    }

    /// Bytes of one texel before any packing.
    const fn texel_bytes(self) -> usize {
        match self {
            Self::InverseDepth | Self::CornerInverseDepth => 2,
            Self::Passed1 => 1,
            Self::ColorRgb9e5 | Self::NormalOct16 | Self::ReflectanceRoughness8 | Self::Visibility8 => 4,
            Self::SurfaceId => 8,
        }
    }

    /// Most bytes that a plane of `texels` with `corners` has before LZ4.
    const fn max_raw_bytes(self, texels: usize, corners: usize) -> usize {
        match self {
            Self::InverseDepth => max_unpacked_bytes(texels),
            Self::ColorRgb9e5 => max_colors_bytes(texels),
            Self::NormalOct16 => max_words_bytes(texels, WordLayout::Halves),
            Self::SurfaceId => 2 * max_words_bytes(texels, WordLayout::Whole),
            Self::ReflectanceRoughness8 | Self::Visibility8 => max_words_bytes(texels, WordLayout::Bytes),
            Self::Passed1 => texels.div_ceil(8),
            Self::CornerInverseDepth => CORNER_RANGE_BYTES + max_unpacked_bytes(corners),
        }
    }
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

/// The planes that are encoded besides inverse depth and colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct PlaneSet {
    /// Octahedral normals, where the image has them.
    pub normal: bool,
    /// Surface keys, where the image has them.
    pub surface_id: bool,
    /// Planes of highlights, where the image has them. Normals are then encoded, too.
    pub specular: bool,
    /// Depths at texels' corners, where the image has them.
    pub corners: bool,
}

/// Bytes of a plane of corners before its codes.
pub(crate) const CORNER_RANGE_BYTES: usize = 8;

impl PlaneSet {
    /// Inverse depth and colour only, and the bits of passed surfaces, without which depths would be misread.
    pub const DEPTH_COLOR: Self = Self { normal: false, surface_id: false, specular: false, corners: false };
    /// All planes that the image has.
    pub const ALL: Self = Self { normal: true, surface_id: true, specular: true, corners: true };
}

/// Size, planes and range of an encoded depth image. The camera is sent apart.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageHeader {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The range that the 16-bit codes span.
    pub inverse_depth_range: InverseDepthRange,
    /// The planes, in the order of the payload.
    pub planes: Vec<PlaneHeader>,
}

impl ImageHeader {
    /// Checks everything that can be checked without the payload; gives the number of texels.
    ///
    /// # Errors
    /// Names the field that is wrong or over a limit.
    pub fn validate(&self, limits: &DecodeLimits) -> Result<usize, DecodeError> {
        let texels = limits.texels(self.width, self.height)?;
        self.inverse_depth_range.validate()?;
        self.validate_kinds()?;
        for plane in &self.planes {
            if plane.encoding != plane.kind.encoding() {
                return Err(DecodeError::Header { field: "planes.encoding", reason: "not the encoding of this kind" });
            }
            check_limit(
                "planes.raw_bytes",
                u64::from(plane.raw_bytes),
                plane.kind.max_raw_bytes(texels, self.corners()) as u64,
            )?;
        }
        let texel_bytes: usize = self.planes.iter().map(|plane| plane.kind.texel_bytes()).sum();
        check_limit("image_bytes", texels as u64 * texel_bytes as u64, limits.max_image_bytes as u64)?;
        check_limit("payload_bytes", self.payload_bytes(), limits.max_payload_bytes as u64)?;
        Ok(texels)
    }

    /// Depth, colour, \[normal\], \[surface id\], \[reflectance, visibility*\], \[passed\], \[corners\]; reflectance
    /// only with normals.
    fn validate_kinds(&self) -> Result<(), DecodeError> {
        let error = |reason| Err(DecodeError::Header { field: "planes.kind", reason });
        let kinds: Vec<_> = self.planes.iter().map(|plane| plane.kind).collect();
        let Some(rest) = kinds.strip_prefix(&[PlaneKind::InverseDepth, PlaneKind::ColorRgb9e5]) else {
            return error("must begin with inverse depth and colour");
        };
        let (normals, rest) = leading(rest, PlaneKind::NormalOct16);
        let (surface_ids, rest) = leading(rest, PlaneKind::SurfaceId);
        let (reflectances, rest) = leading(rest, PlaneKind::ReflectanceRoughness8);
        let (visibilities, rest) = leading(rest, PlaneKind::Visibility8);
        let (passed, rest) = leading(rest, PlaneKind::Passed1);
        let (corners, rest) = leading(rest, PlaneKind::CornerInverseDepth);
        if !rest.is_empty() || [normals, surface_ids, reflectances, passed, corners].iter().any(|&count| count > 1) {
            return error("repeated or out of order");
        }
        if reflectances > normals || (visibilities > 0 && reflectances == 0) {
            return error("reflectance without normals, or visibility without reflectance");
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
        for plane in &self.planes {
            hasher.write(&[plane.kind as u8, plane.encoding as u8]);
            hasher.update(&plane.raw_bytes.to_le_bytes());
            hasher.update(&plane.packed_bytes.to_le_bytes());
        }
        hasher.finalize()
    }
}

/// The count of planes of a kind at the front, and the planes that follow.
fn leading(kinds: &[PlaneKind], kind: PlaneKind) -> (usize, &[PlaneKind]) {
    let count = kinds.iter().take_while(|&&other| other == kind).count();
    (count, &kinds[count..])
}
