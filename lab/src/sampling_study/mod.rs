//! How well methods sample a scene: the metrics of Xie §6.1.2 on the kinds of scene that the paper has.

mod availability;
pub mod command;
mod counts;
mod detection;
mod pictures;
mod reconstructions;
mod report;
mod sizes;
mod subject;
mod times;
mod visibility;

pub use detection::{detection, detection_report};
pub use reconstructions::{reconstructions, reconstructions_report};
pub use report::{SceneRow, scene_report, tables};
pub use sizes::{sizes, sizes_report};
pub use subject::{SCENES, Subject};
pub use times::{Times, times, times_report};

use sampling::{Redundancy, SamplingMethod};

/// Images of a set, as in the paper.
pub const IMAGES: usize = 3;
/// What is compared, conventional sampling first.
pub const METHODS: [SamplingMethod; 6] = [
    SamplingMethod::Conventional,
    SamplingMethod::NonRedundant(Redundancy::Pixel),
    SamplingMethod::NonRedundant(Redundancy::Visibility),
    SamplingMethod::NonRedundant(Redundancy::Tolerance),
    SamplingMethod::DepthPeeling { layers: IMAGES as u32 },
    SamplingMethod::Useful(Redundancy::Pixel),
];

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
