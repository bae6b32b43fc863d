//! Which samples of the scene are taken.

use std::{fmt, str::FromStr};

/// A closed set: each variant is one file pair, one docs page and one row in the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SamplingMethod {
    /// Every visible surface, whether another image holds it too or not (Lages §4.1).
    #[default]
    Conventional,
}

/// Not the name of a sampling method.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown sampling method {0:?}, expected conventional")]
pub struct UnknownSampling(String);

impl FromStr for SamplingMethod {
    type Err = UnknownSampling;
    fn from_str(text: &str) -> Result<Self, UnknownSampling> {
        match text {
            "conventional" => Ok(Self::Conventional),
            other => Err(UnknownSampling(other.to_owned())),
        }
    }
}

impl fmt::Display for SamplingMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Conventional => "conventional",
        })
    }
}
