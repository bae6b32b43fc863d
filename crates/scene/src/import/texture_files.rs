//! The texture files of OBJ and PLY models, each read once.

use std::collections::HashMap;
use std::path::Path;

use super::Import;
use super::file_search::{Found, search};
use super::listing::decoded;
use super::options::MissingTextures;
use super::picture::{Content, EncodedPicture, decode_all};
use crate::Texture;
use crate::error::{Fault, shortened};

#[derive(Default)]
pub(crate) struct TextureFiles {
    pictures: Vec<EncodedPicture>,
    number_of: HashMap<(String, Content), u32>,
}

/// A reference to a texture file.
pub(crate) struct TextureReference<'n> {
    /// The statement that refers to the file, in messages.
    pub element: String,
    /// Spellings of the file's name. The last one is that of messages.
    pub names: Vec<&'n [u8]>,
    /// A folder relative to the scene's folder, in which the file is looked for before that.
    pub base: &'n Path,
    pub content: Content,
}

impl TextureFiles {
    /// Reads the file unless it is known, and returns its number.
    pub(crate) fn number_of(&mut self, reference: TextureReference, import: &Import) -> Result<u32, Fault> {
        let TextureReference { element, names, base, content } = reference;
        let name = names.last().map(|name| decoded(name).into_owned()).unwrap_or_default();
        let (file, bytes) = match search(&import.folder, &[base, Path::new("")], &names, &import.warnings) {
            Found::File(path) => {
                let file = path.display().to_string();
                if let Some(&number) = self.number_of.get(&(file.clone(), content)) {
                    return Ok(number);
                }
                (file, Some(import.folder.read_relative(&element, &path)?))
            }
            Found::Outside(reason) if import.options.missing_textures == MissingTextures::Refuse => {
                return Err(Fault::forbidden(element, &name, reason));
            }
            Found::Outside(_) | Found::Missing => (name, None),
        };
        let next = self.pictures.len() as u32;
        let number = *self.number_of.entry((file.clone(), content)).or_insert(next);
        if number == next {
            self.pictures.push(EncodedPicture { element, file, bytes, content });
        }
        Ok(number)
    }

    /// Decodes all files, in the order of their numbers.
    pub(crate) fn decode(&self, import: &Import) -> Result<Vec<Texture>, Fault> {
        let missing = import.options.missing_textures;
        let missing_files = self.pictures.iter().filter(|picture| picture.bytes.is_none());
        let grey: Vec<&str> = missing_files.map(|picture| &*picture.file).collect();
        if !grey.is_empty() && missing == MissingTextures::Grey {
            let names = shortened(grey.join(", "));
            tracing::warn!("{} textures are missing, and grey takes their place: {names}", grey.len());
        }
        decode_all(&self.pictures, import.limits, missing)
    }
}
