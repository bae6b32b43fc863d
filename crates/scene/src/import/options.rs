//! What the reader of a scene file does where the file asks for something that is not there or not known.

use super::missing_textures::MissingTextures;

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
