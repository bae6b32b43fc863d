//! How surfaces are lit.

use std::{fmt, str::FromStr};

/// The same for samples and for direct rendering, so that their pictures agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Lighting {
    /// Base colours as they are.
    Unlit,
    /// Ambient, Lambert and Blinn-Phong terms of every light, without shadows.
    #[default]
    Phong,
}

/// Not the name of a lighting.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown lighting {0:?}, expected unlit or phong")]
pub struct UnknownLighting(String);

impl FromStr for Lighting {
    type Err = UnknownLighting;
    fn from_str(text: &str) -> Result<Self, UnknownLighting> {
        match text {
            "unlit" => Ok(Self::Unlit),
            "phong" => Ok(Self::Phong),
            other => Err(UnknownLighting(other.to_owned())),
        }
    }
}

impl fmt::Display for Lighting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unlit => "unlit",
            Self::Phong => "phong",
        })
    }
}
