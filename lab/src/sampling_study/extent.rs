//! The size of the study.

/// The size of the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// The side of sample images.
    pub side_px: u32,
    /// The number of views between the sample cameras.
    pub views: usize,
    /// The number of samples an image whose visibility is traced.
    pub seeds: usize,
    /// The number of sides of images in Fig. 7.
    pub sides: usize,
    /// The number of views at each distance of the viewpoints.
    pub views_a_distance: usize,
}

impl Extent {
    /// The paper's size, or a smaller one.
    pub fn of(quick: bool) -> Self {
        if quick {
            Self { side_px: 256, views: 64, seeds: 512, sides: 2, views_a_distance: 8 }
        } else {
            Self { side_px: 1024, views: 1000, seeds: 4096, sides: 4, views_a_distance: 32 }
        }
    }
}
