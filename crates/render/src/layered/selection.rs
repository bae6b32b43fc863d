//! Which of the surfaces on a line a layered image holds.

/// The surfaces that a layered image holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LayerSelection {
    /// All that its lines meet (Lischinski §3.1).
    All,
    /// Those whose normal is largest along the lines, of the camera's three axes, or nearly so: images along all three axes hold
    /// each surface on one of them at least.
    Dominant,
}

/// A surface is kept along each axis in which its normal has at least this share of its largest component: neighbouring images
/// overlap.
const LEAST_DOMINANT_SHARE: f32 = 0.9;

impl LayerSelection {
    pub(super) fn least_share(self) -> f32 {
        match self {
            Self::All => 0.0,
            Self::Dominant => LEAST_DOMINANT_SHARE,
        }
    }
}
