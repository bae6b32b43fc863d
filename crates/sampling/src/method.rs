//! Which samples of the scene are taken.

use std::{fmt, str::FromStr};

use depth_image::PinholeCamera;
use render::LeaveOut;

use crate::{depth_peeling, non_redundant};

/// A closed set: each variant is one file pair, one docs page and one row in the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SamplingMethod {
    /// Every visible surface, whether another image holds it too or not (Lages §4.1).
    #[default]
    Conventional,
    /// Only what no image before holds; behind it rays go on (Xie §3).
    NonRedundant(Redundancy),
    /// The same, less what no viewpoint between the sample cameras can see past its blockers.
    Useful(Redundancy),
    /// Layer behind layer from one place: the middle of the sample cameras.
    DepthPeeling {
        /// Images, each of what lies behind the one before.
        layers: u32,
    },
}

/// When a sample is redundant with an image before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Redundancy {
    /// It has a sample of the same triangle at the same pixel (Xie, Algorithm 3).
    #[default]
    Pixel,
    /// It is seen from that image's viewpoint (Xie, Algorithm 2).
    Visibility,
    /// It has a sample nearby of the same surface, facing the same way and not much coarser.
    Tolerance,
}

impl Redundancy {
    const ALL: [Self; 3] = [Self::Pixel, Self::Visibility, Self::Tolerance];

    fn name(self) -> &'static str {
        match self {
            Self::Pixel => "pixel",
            Self::Visibility => "visibility",
            Self::Tolerance => "tolerance",
        }
    }

    /// The default without a name.
    fn named(name: Option<&str>) -> Option<Self> {
        match name {
            None => Some(Self::default()),
            Some(name) => Self::ALL.into_iter().find(|test| test.name() == name),
        }
    }
}

/// The most images of a set, as reconstruction takes them.
const MAX_LAYERS: u32 = 16;
const DEFAULT_LAYERS: u32 = 4;

/// Not the name of a sampling method.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown sampling method {0:?}, expected conventional, non_redundant or useful, each also with :pixel, :visibility or :tolerance, depth_peeling or depth_peeling:LAYERS (1 to 16)"
)]
pub struct UnknownSampling(String);

impl SamplingMethod {
    /// All of them, with the paper's numbers.
    pub const ALL: [Self; 6] = [
        Self::Conventional,
        Self::NonRedundant(Redundancy::Pixel),
        Self::NonRedundant(Redundancy::Visibility),
        Self::NonRedundant(Redundancy::Tolerance),
        Self::Useful(Redundancy::Pixel),
        Self::DepthPeeling { layers: DEFAULT_LAYERS },
    ];

    /// Where its images are taken from, where a rig has these cameras.
    #[must_use]
    pub fn cameras(self, rig: Vec<PinholeCamera>) -> Vec<PinholeCamera> {
        match self {
            Self::DepthPeeling { layers } => depth_peeling::cameras(&rig, layers as usize),
            Self::Conventional | Self::NonRedundant(_) | Self::Useful(_) => rig,
        }
    }

    /// Whether an image can only be taken after those before it: then a set's images are taken on one node.
    #[must_use]
    pub fn is_chained(self) -> bool {
        self.leave_out().is_some_and(|test| !test.traces_rays())
    }

    /// Whether what it keeps settles between the moments of a moving scene.
    #[must_use]
    pub fn settles(self) -> bool {
        matches!(self, Self::NonRedundant(Redundancy::Tolerance) | Self::Useful(Redundancy::Tolerance))
    }

    /// By which test an image leaves out what others hold.
    #[must_use]
    pub fn leave_out(self) -> Option<LeaveOut> {
        match self {
            Self::Conventional => None,
            Self::NonRedundant(redundancy) => Some(non_redundant::test(redundancy)),
            Self::Useful(redundancy) => Some(LeaveOut { only_useful: true, ..non_redundant::test(redundancy) }),
            Self::DepthPeeling { .. } => Some(depth_peeling::TEST),
        }
    }
}

impl FromStr for SamplingMethod {
    type Err = UnknownSampling;
    fn from_str(text: &str) -> Result<Self, UnknownSampling> {
        let unknown = || UnknownSampling(text.to_owned());
        let name = text.replace('-', "_");
        let (name, detail) = name.split_once(':').map_or((name.as_str(), None), |(name, detail)| (name, Some(detail)));
        match (name, detail) {
            ("conventional", None) => Ok(Self::Conventional),
            ("non_redundant", test) => Redundancy::named(test).map(Self::NonRedundant).ok_or_else(unknown),
            ("useful", test) => Redundancy::named(test).map(Self::Useful).ok_or_else(unknown),
            ("depth_peeling", layers) => {
                let layers = layers.map_or(Ok(DEFAULT_LAYERS), |layers| layers.parse().map_err(|_| unknown()))?;
                let allowed = (1..=MAX_LAYERS).contains(&layers);
                allowed.then_some(Self::DepthPeeling { layers }).ok_or_else(unknown)
            }
            _ => Err(unknown()),
        }
    }
}

impl fmt::Display for SamplingMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Conventional => f.write_str("conventional"),
            Self::NonRedundant(redundancy) => write!(f, "non_redundant:{}", redundancy.name()),
            Self::Useful(redundancy) => write!(f, "useful:{}", redundancy.name()),
            Self::DepthPeeling { layers } => write!(f, "depth_peeling:{layers}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_nonsense_is_refused() {
        for method in SamplingMethod::ALL {
            assert_eq!(method.to_string().parse(), Ok(method));
        }
        assert_eq!("non-redundant".parse(), Ok(SamplingMethod::NonRedundant(Redundancy::Pixel)));
        for name in
            ["", "non_redundant:", "non_redundant:id", "depth_peeling:0", "depth_peeling:17", "depth_peeling:-1"]
        {
            assert!(name.parse::<SamplingMethod>().is_err(), "{name}");
        }
    }
}
