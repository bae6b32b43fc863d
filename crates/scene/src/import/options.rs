//! Options of an import, and the state that the readers of all formats share.

use std::fmt;
use std::str::FromStr;

use super::folder::Folder;
use super::warnings::Warnings;
use crate::Limits;

/// What the readers of all formats share: where files are, how large they may be, and where warnings go.
pub(crate) struct Import<'a> {
    pub folder: Folder,
    pub limits: &'a Limits,
    pub options: &'a ImportOptions,
    pub warnings: Warnings,
}

/// Options of [`load_file`](super::load_file).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImportOptions {
    /// What is done about missing textures.
    pub missing_textures: MissingTextures,
    /// Names of glTF extensions that a file may require although they are not read.
    pub ignore_required: Vec<String>,
}

impl From<MissingTextures> for ImportOptions {
    fn from(missing_textures: MissingTextures) -> Self {
        Self { missing_textures, ..Self::default() }
    }
}

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
        let named = [Self::Refuse, Self::Grey].into_iter().find(|choice| choice.to_string() == text);
        named.ok_or_else(|| MissingTexturesError(text.to_owned()))
    }
}

impl fmt::Display for MissingTextures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::Refuse { "refuse" } else { "grey" })
    }
}
