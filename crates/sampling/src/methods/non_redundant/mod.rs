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
    /// The image has a sample nearby of the same surface, facing the same way and not much coarser.
    Tolerance,
}

pub(super) const FORM: &str = "TEST (pixel, visibility or tolerance)";

/// Visibility: the share of its depth that a point may be off by.
pub const SAME_DEPTH: f32 = 2e-5;
/// Visibility: the share of the pixel's length on the surface that a point may be off by, besides.
pub const SAME_FOOTPRINTS: f32 = 0.0625;
/// Tolerance: depths are the same within this many footprints.
pub const DEPTH_FOOTPRINTS: f32 = 2.0;
/// Tolerance: the pixels for which a surface may go on changing its depth at its own slope.
pub const SLOPE_PX: f32 = 1.0;
/// Tolerance: the cosine of 25 degrees.
pub const SAME_FACING: f32 = 0.906_307_8;
/// Tolerance: the greatest ratio of footprints.
pub const COARSER: f32 = 1.5;
/// Tolerance: the share of these limits that samples of the temporal reference are held to.
pub const CLEARLY: f32 = 0.8;
/// Tolerance: the cosine of 20 degrees, for samples of the temporal reference.
pub const CLEARLY_SAME_FACING: f32 = 0.939_692_6;

pub(super) fn parse(text: &str) -> Option<Redundancy> {
    Redundancy::ALL.into_iter().find(|redundancy| redundancy.to_string() == text)
}

impl Redundancy {
    pub(super) const ALL: [Self; 3] = [Self::Pixel, Self::Visibility, Self::Tolerance];

    pub(super) const fn test(self) -> RedundancyTest {
        let (shader, consults) = match self {
            Self::Pixel => ("non_redundant/pixel.wgsl", Evidence::SurfaceIds),
            Self::Visibility => ("non_redundant/visibility.wgsl", Evidence::Scene),
            Self::Tolerance => ("non_redundant/tolerance.wgsl", Evidence::Samples),
        };
        RedundancyTest { shader, consults, from_one_place: false, usefulness: None }
    }
}

impl fmt::Display for Redundancy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pixel => "pixel",
            Self::Visibility => "visibility",
            Self::Tolerance => "tolerance",
        })
    }
}
