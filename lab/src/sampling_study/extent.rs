//! The size of the study.

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Side of sample images.
    pub side_px: u32,
    /// Views between the sample cameras.
    pub views: usize,
    /// Samples an image whose visibility is asked for.
    pub seeds: usize,
}

impl Extent {
    /// The paper's, or a smaller form of it.
    #[must_use]
    pub fn of(quick: bool) -> Self {
        if quick {
            Self { side_px: 256, views: 64, seeds: 512 }
        } else {
            Self { side_px: 1024, views: 1000, seeds: 4096 }
        }
    }
}
