//! The size of the study.

/// The size of the study.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// The side of sample images.
    pub side_px: u32,
    /// The number of views between the sample cameras.
    pub views: usize,
    /// The number of samples an image whose visibility is traced.
    pub seeds: usize,
    /// The number of sides of images in Fig. 7.
    pub sides: usize,
    /// Distances of the viewpoints over those of Tables 1 and 2.
    pub distances: &'static [f32],
    /// The sides of frames at each distance.
    pub distance_frames_px: &'static [u32],
    /// The number of views at each distance.
    pub distance_views: usize,
}

impl Extent {
    /// The paper's size, or a smaller one.
    pub fn of(quick: bool) -> Self {
        if quick {
            Self {
                side_px: 256,
                views: 64,
                seeds: 512,
                sides: 2,
                distances: &[0.25, 1.0, 4.0],
                distance_frames_px: &[512],
                distance_views: 4,
            }
        } else {
            Self {
                side_px: 1024,
                views: 1000,
                seeds: 4096,
                sides: 4,
                distances: &[0.25, 0.5, 1.0, 2.0, 4.0],
                distance_frames_px: &[512, 1024],
                distance_views: 8,
            }
        }
    }
}
