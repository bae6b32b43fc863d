//! Images that leave out samples of those before them (Xie §3, Algorithm 1), by one of three tests.

pub(crate) mod tolerance;
pub(crate) mod visibility;

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

const PIXEL: &str = "non_redundant/pixel.wgsl";
const VISIBILITY: &str = "non_redundant/visibility.wgsl";
const TOLERANCE: &str = "non_redundant/tolerance.wgsl";

pub(super) const SHADERS: [(&str, &str); 3] = [
    (PIXEL, include_str!("pixel.wgsl")),
    (VISIBILITY, include_str!("visibility.wgsl")),
    (TOLERANCE, include_str!("tolerance.wgsl")),
];

pub(super) fn constants() -> impl Iterator<Item = (&'static str, String)> {
    visibility::constants().into_iter().chain(tolerance::constants())
}

pub(super) fn parse(text: &str) -> Option<Redundancy> {
    Redundancy::ALL.into_iter().find(|redundancy| redundancy.to_string() == text)
}

impl Redundancy {
    pub(super) const ALL: [Self; 3] = [Self::Pixel, Self::Visibility, Self::Tolerance];

    pub(super) const fn test(self) -> RedundancyTest {
        let (shader, consults) = match self {
            Self::Pixel => (PIXEL, Evidence::SurfaceIds),
            Self::Visibility => (VISIBILITY, Evidence::Scene),
            Self::Tolerance => (TOLERANCE, Evidence::Samples),
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
