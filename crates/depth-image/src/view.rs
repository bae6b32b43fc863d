//! A finished view: a picture and, on request, its depth and provenance.

use glam::UVec2;

use crate::{Antialias, ToneMapping};

/// The origin of a pixel's colour, packed in 32 bits. The low byte is the kind; above it is one bit for each sample
/// camera that contributed.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Provenance(pub u32);

/// The kinds of [`Provenance`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ProvenanceKind {
    /// The ray meets nothing: background.
    Empty,
    /// A surface visible to at least one sample camera. In views whose surfaces come from the scene, the surface's light is
    /// known from these cameras.
    Hit,
    /// A surface that no sample camera saw; its colour comes from the farther side of the gap.
    Filled,
    /// A surface that reflects what no sample camera sees and no base holds; there it shows lamps and the environment.
    Guessed,
    /// A surface that no sample camera saw, from the base: a layered depth cube of the whole scene. Or a surface that reflects what is
    /// found there.
    Base,
    /// A surface of the scene whose light no sample knows: it was lit in this view.
    LitHere,
}

impl Provenance {
    /// A pixel of the background.
    pub const EMPTY: Self = Self(0);

    /// Packs a kind and the contributing cameras, one bit each.
    #[must_use]
    pub fn new(kind: ProvenanceKind, camera_mask: u32) -> Self {
        Self(kind as u32 | camera_mask << 8)
    }

    /// The kind of the pixel. Unknown codes, as from a newer peer, count as filled.
    #[must_use]
    pub fn kind(self) -> ProvenanceKind {
        match self.0 & 0xff {
            0 => ProvenanceKind::Empty,
            1 => ProvenanceKind::Hit,
            3 => ProvenanceKind::Guessed,
            4 => ProvenanceKind::Base,
            5 => ProvenanceKind::LitHere,
            _ => ProvenanceKind::Filled,
        }
    }

    /// The contributing sample cameras, one bit each.
    #[must_use]
    pub fn camera_mask(self) -> u32 {
        self.0 >> 8
    }
}

/// A finished view; planes run top-down.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Columns and rows.
    pub size_px: UVec2,
    /// sRGB, three bytes a pixel.
    pub srgb8: Vec<u8>,
    /// One over planar depth, 0 for background; on request.
    pub inverse_depth_per_m: Option<Vec<f32>>,
    /// Origin of each pixel; on request.
    pub provenance: Option<Vec<Provenance>>,
}

impl View {
    /// A view of colour alone.
    #[must_use]
    pub fn from_srgb8(size_px: UVec2, srgb8: Vec<u8>) -> Self {
        Self { size_px, srgb8, inverse_depth_per_m: None, provenance: None }
    }
}

/// The requested planes of a view: how its colour is sampled, and what comes with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct ViewPlanes {
    /// Of [`View::srgb8`].
    pub antialias: Antialias,
    /// From the mean of its samples to [`View::srgb8`].
    pub tone: ToneMapping,
    /// [`View::inverse_depth_per_m`].
    pub inverse_depth: bool,
    /// [`View::provenance`].
    pub provenance: bool,
}

impl ViewPlanes {
    /// Colour alone, of one sample a pixel, as it is.
    pub const COLOR: Self =
        Self { antialias: Antialias::NONE, tone: ToneMapping::NONE, inverse_depth: false, provenance: false };
    /// Colour and depth.
    pub const WITH_DEPTH: Self = Self { inverse_depth: true, ..Self::COLOR };
    /// Colour and provenance.
    pub const WITH_PROVENANCE: Self = Self { provenance: true, ..Self::COLOR };
    /// Colour, depth and provenance.
    pub const ALL: Self = Self { inverse_depth: true, ..Self::WITH_PROVENANCE };

    /// Bytes of a decoded view for each pixel, with its colour.
    #[must_use]
    pub fn bytes_per_pixel(self) -> usize {
        3 + 4 * usize::from(self.inverse_depth) + 4 * usize::from(self.provenance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_survive_packing_and_unknown_codes_count_as_filled() {
        let kinds = [
            ProvenanceKind::Empty,
            ProvenanceKind::Hit,
            ProvenanceKind::Filled,
            ProvenanceKind::Guessed,
            ProvenanceKind::Base,
            ProvenanceKind::LitHere,
        ];
        for (code, kind) in kinds.into_iter().enumerate() {
            let packed = Provenance::new(kind, 5);
            assert_eq!((packed.0 & 0xff, packed.kind(), packed.camera_mask()), (code as u32, kind, 5));
        }
        assert_eq!(Provenance(6).kind(), ProvenanceKind::Filled);
    }
}
