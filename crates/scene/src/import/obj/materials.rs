//! Libraries of an OBJ file, and its materials with their textures.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::super::Import;
use super::super::file_search::{Found, search};
use super::super::listing::decoded;
use super::super::picture::Content;
use super::super::source_scene::SourceScene;
use super::super::texture_files::{TextureFiles, TextureReference};
use super::faces::MaterialUse;
use super::map::{TextureMap, UvTransform, spellings};
use super::masks::{MaskedTexture, masked};
use super::mtl::{Entry, folded_name, parse};
use super::text::words;
use crate::error::{Fault, at_most};
use crate::{Material, TextureUse, Wrap};

const UNKNOWN_MATERIALS: &str = "materials that no library has are white";
const MISSING_LIBRARIES: &str = "material libraries are missing";

/// Reads all libraries that are in the scene's folder. `mtllib` names one file, with spaces, or several.
pub(super) fn read_libraries(statements: &[Vec<u8>], import: &Import) -> Result<Vec<Entry>, Fault> {
    let Import { folder, warnings, .. } = import;
    let mut entries = Vec::new();
    // Some programs repeat the statement before each object.
    let mut known = HashSet::new();
    for statement in statements.iter().filter(|statement| known.insert(*statement)) {
        let names = several_names(statement);
        if names.iter().filter(|name| is_library_name(name)).count() < 2 {
            let whole = spellings(statement);
            let whole: Vec<&[u8]> = whole.iter().map(Vec::as_slice).collect();
            if let Found::File(path) = search(folder, &[Path::new("")], &whole, warnings) {
                read_library(&path, import, &mut entries)?;
                continue;
            }
        }
        for name in names {
            match search(folder, &[Path::new("")], &[&name], warnings) {
                Found::File(path) => read_library(&path, import, &mut entries)?,
                Found::Missing => warnings.list(MISSING_LIBRARIES, decoded(&name)),
                Found::Outside(why) => {
                    warnings.list(MISSING_LIBRARIES, format_args!("{} (it {why})", decoded(&name)));
                }
            }
        }
    }
    Ok(entries)
}

fn read_library(path: &Path, import: &Import, entries: &mut Vec<Entry>) -> Result<(), Fault> {
    let element = format!("mtllib {}", path.display());
    let bytes = import.folder.read_relative(&element, path)?;
    parse(&bytes, &element, path.parent().unwrap_or(Path::new("")), import, entries)
}

fn is_library_name(name: &[u8]) -> bool {
    name.to_ascii_lowercase().ends_with(b".mtl")
}

/// The names of a statement that names several files: each ends with `.mtl`, or is a word.
fn several_names(statement: &[u8]) -> Vec<Vec<u8>> {
    let mut names = Vec::new();
    let mut pending: Vec<&[u8]> = Vec::new();
    for word in words(statement) {
        let word = word.strip_prefix(b"\"").unwrap_or(word);
        let bare = word.strip_suffix(b"\"").unwrap_or(word);
        pending.push(bare);
        if is_library_name(bare) {
            names.push(pending.join(&b' '));
            pending.clear();
        }
    }
    names.extend(pending.into_iter().map(<[u8]>::to_vec));
    names
}

/// Fills the scene's materials and textures, and numbers them for `names`.
pub(super) fn read_materials(
    entries: &[Entry],
    names: &[Vec<u8>],
    import: &Import,
    scene: &mut SourceScene,
) -> Result<Vec<MaterialUse>, Fault> {
    let Import { limits, warnings, .. } = import;
    at_most("materials", names.len() as u64, limits.attributes)?;
    // The last of equal names counts.
    let by_name: HashMap<&[u8], &Entry> = entries.iter().map(|entry| (&*entry.name, entry)).collect();
    let by_folded_name: HashMap<_, _> = entries.iter().map(|entry| (folded_name(&entry.name), entry)).collect();
    let mut textures = Textures::default();
    let mut uses = Vec::new();
    let mut placement_numbers = HashMap::new();
    for name in names {
        let shown_name = decoded(name).into_owned();
        let exact = by_name.get(name.as_slice()).copied();
        let entry = exact.or_else(|| by_folded_name.get(&folded_name(name)).copied());
        if entry.is_none() && !name.is_empty() {
            warnings.list(UNKNOWN_MATERIALS, &shown_name);
        }
        let white = Material { name: shown_name.clone(), double_sided: true, ..Material::default() };
        let mut material = entry.map_or(white, |entry| entry.material(shown_name, warnings));
        let maps = entry.and_then(|entry| Some((entry, entry.color_map.as_ref().or(entry.alpha_map.as_ref())?)));
        let mut placement = UvTransform::IDENTITY;
        if let Some((entry, map)) = maps {
            let texture = textures.number_of(entry, import)?;
            let wrap = if map.clamps { Wrap::Clamp } else { Wrap::Repeat };
            material.base_color_texture = Some(TextureUse { wrap: [wrap; 2], ..TextureUse::from(texture) });
            material.alpha_hashed |= entry.alpha_map.is_some();
            placement = map.placement;
            if entry.alpha_map.as_ref().is_some_and(|alpha| alpha.placement != placement) {
                warnings.list("opacity maps are placed as the colours of their materials", &material.name);
            }
        }
        let UvTransform { scale, offset } = placement;
        let next = placement_numbers.len() as u32;
        let bits = [scale.x, scale.y, offset.x, offset.y].map(f64::to_bits);
        let placement_number = *placement_numbers.entry(bits).or_insert(next);
        let has_texture = material.base_color_texture.is_some();
        let number = scene.materials.len() as u32;
        uses.push(MaterialUse { number, placement, placement_number, has_texture });
        scene.materials.push(material);
    }
    if scene.materials.is_empty() {
        scene.materials.push(Material { double_sided: true, ..Material::default() });
    }
    let decoded = textures.files.decode(import)?;
    scene.textures = masked(decoded, &textures.used, limits)?;
    Ok(uses)
}

#[derive(Default)]
struct Textures {
    files: TextureFiles,
    used: Vec<MaskedTexture>,
    number_of: HashMap<MaskedTexture, u32>,
}

impl Textures {
    /// The number of the texture of colours and opacity.
    fn number_of(&mut self, entry: &Entry, import: &Import) -> Result<u32, Fault> {
        let mut file = |map: &TextureMap, content| {
            let names = map.names.iter().map(Vec::as_slice).collect();
            let reference = TextureReference { element: map.place.clone(), names, base: &entry.folder, content };
            self.files.number_of(reference, import)
        };
        let color = entry.color_map.as_ref().map(|map| file(map, Content::Colors)).transpose()?;
        let mask = entry.alpha_map.as_ref().map(|map| file(map, Content::Data)).transpose()?;
        let texture = MaskedTexture { color, mask, channel: entry.alpha_map.as_ref().and_then(|map| map.channel) };
        let next = self.used.len() as u32;
        let number = *self.number_of.entry(texture).or_insert(next);
        if number == next {
            self.used.push(texture);
        }
        Ok(number)
    }
}
