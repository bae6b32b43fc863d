//! Images that omit samples of those before them (Xie §3, Algorithm 1), by one of three tests.

use std::fmt;

use render::{Evidence, RedundancyTest};

/// When a sample is redundant with an image before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Redundancy {
    /// The image has a sample of the same triangle at the same pixel (Xie, Algorithm 3).
    Pixel,
    /// The sample is seen from that image's viewpoint (Xie, Algorithm 2).
    Visibility,
    /// The image has samples all around the sample, of the same surface and not much coarser: what views look up there, they find in
    /// that image. Nothing is shown in its place.
    Coverage,
}

pub(super) const FORM: &str = "TEST (pixel, visibility or coverage)";

/// Visibility: the share of its depth that a point may be off by.
pub const SAME_DEPTH: f32 = 2e-5;
/// Visibility: the share of the pixel's length on the surface that a point may be off by, besides.
pub const SAME_FOOTPRINTS: f32 = 0.0625;

pub(super) fn parse(text: &str) -> Option<Redundancy> {
    Redundancy::ALL.into_iter().find(|redundancy| redundancy.to_string() == text)
}

impl Redundancy {
    pub(super) const ALL: [Self; 3] = [Self::Pixel, Self::Visibility, Self::Coverage];

    /// The test of candidates on the way of a ray; `None` where images omit pixels of what they see first.
    pub(super) const fn test(self) -> Option<RedundancyTest> {
        let (shader, consults) = match self {
            Self::Pixel => ("non_redundant/pixel.wgsl", Evidence::SurfaceIds),
            Self::Visibility => ("non_redundant/visibility.wgsl", Evidence::Scene),
            Self::Coverage => return None,
        };
        Some(RedundancyTest { shader, consults, from_one_place: false })
    }
}

impl fmt::Display for Redundancy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pixel => "pixel",
            Self::Visibility => "visibility",
            Self::Coverage => "coverage",
        })
    }
}
