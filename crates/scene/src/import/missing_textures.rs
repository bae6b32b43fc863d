//! What is done where a file refers to textures that are not there.

use std::fmt;
use std::str::FromStr;

/// What is done about missing textures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MissingTextures {
    /// The scene is refused, and all missing files are named.
    #[default]
    Refuse,
    /// A grey texel takes the place of each.
    Grey,
}

/// A text that names no choice.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is neither refuse nor grey")]
pub struct MissingTexturesError(String);

impl FromStr for MissingTextures {
    type Err = MissingTexturesError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "refuse" => Ok(Self::Refuse),
            "grey" => Ok(Self::Grey),
            other => Err(MissingTexturesError(other.to_owned())),
        }
    }
}

impl fmt::Display for MissingTextures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Refuse => "refuse",
            Self::Grey => "grey",
        })
    }
}
