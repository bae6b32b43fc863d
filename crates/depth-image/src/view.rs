//! What a client receives: a picture and, on request, its depth and where each pixel came from.

use glam::UVec2;

/// Where a pixel's colour came from, packed in 32 bits: the kind in the low byte, and above it one bit
/// for each sample camera that contributed.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Provenance(pub u32);

/// The kinds of [`Provenance`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ProvenanceKind {
    /// The ray meets nothing: background.
    Empty,
    /// A surface that at least one sample camera sees.
    Hit,
    /// No sample camera knows; filled from the farther side of the gap.
    Filled,
}

impl Provenance {
    /// Background.
    pub const EMPTY: Self = Self(0);

    /// A pixel of one kind, from the cameras whose bits are set.
    #[must_use]
    pub fn new(kind: ProvenanceKind, camera_mask: u32) -> Self {
        Self(kind as u32 | camera_mask << 8)
    }

    /// What the pixel is. Unknown codes, as from a newer peer, count as filled.
    #[must_use]
    pub fn kind(self) -> ProvenanceKind {
        match self.0 & 0xff {
            0 => ProvenanceKind::Empty,
            1 => ProvenanceKind::Hit,
            _ => ProvenanceKind::Filled,
        }
    }

    /// One bit a sample camera.
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
    /// Three bytes a pixel, sRGB.
    pub srgb8: Vec<u8>,
    /// Per metre of planar depth, 0 for background; on request.
    pub inverse_depth_per_m: Option<Vec<f32>>,
    /// On request.
    pub provenance: Option<Vec<Provenance>>,
}

/// Which planes a view shall have beside its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct ViewPlanes {
    /// [`View::inverse_depth_per_m`].
    pub inverse_depth: bool,
    /// [`View::provenance`].
    pub provenance: bool,
}
