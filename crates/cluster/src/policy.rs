//! How views come about.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// How views come about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Policy {
    /// Samplers sample, compositors reconstruct.
    Pipeline,
    /// Every node draws its views from the scene.
    Direct,
    /// Every node samples its share of the images and reconstructs its share of the views.
    TimeShare,
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pipeline => "pipeline",
            Self::Direct => "direct",
            Self::TimeShare => "time-share",
        })
    }
}

/// The policy that a session asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PolicyChoice {
    /// The policy that is predicted to be fastest.
    #[default]
    Auto,
    /// See [`Policy::Pipeline`].
    Pipeline,
    /// See [`Policy::Direct`].
    Direct,
    /// See [`Policy::TimeShare`].
    TimeShare,
}

/// A text that names no policy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown policy {0:?}, expected auto, pipeline, direct or time-share")]
pub struct UnknownPolicy(String);

impl fmt::Display for PolicyChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Pipeline => Policy::Pipeline.fmt(f),
            Self::Direct => Policy::Direct.fmt(f),
            Self::TimeShare => Policy::TimeShare.fmt(f),
        }
    }
}

impl FromStr for PolicyChoice {
    type Err = UnknownPolicy;

    fn from_str(name: &str) -> Result<Self, UnknownPolicy> {
        let all = [Self::Auto, Self::Pipeline, Self::Direct, Self::TimeShare];
        all.into_iter().find(|choice| choice.to_string() == name).ok_or_else(|| UnknownPolicy(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn policies_parse_from_their_names() {
        for choice in [PolicyChoice::Auto, PolicyChoice::Pipeline, PolicyChoice::Direct, PolicyChoice::TimeShare] {
            assert_eq!(choice.to_string().parse(), Ok(choice));
        }
        let unknown = "best".parse::<PolicyChoice>().unwrap_err().to_string();
        assert!(unknown.contains("\"best\"") && unknown.contains("time-share"), "{unknown}");
    }
}
