//! Libraries of an OBJ file, and its materials with their textures.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use glam::UVec2;

use super::super::file_search::{Found, search};
use super::super::picture::{Content, TextureFiles, TextureReference};
use super::super::{Import, SourceScene, decoded};
use super::faces::MaterialUse;
use super::map::{Channel, TextureMap, UvTransform, spellings};
use super::mtl::{Entry, folded_name, parse};
use super::text::words;
use crate::{Fault, Limits, Material, Texture, TextureUse, Wrap, at_most};

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

/// A texture of a material: numbers of decoded files, at least one of which is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct MaskedTexture {
    color: Option<u32>,
    mask: Option<u32>,
    /// The mask's channel that is opacity.
    channel: Option<Channel>,
}

/// The textures of `used`, in that order.
fn masked(mut decoded: Vec<Texture>, used: &[MaskedTexture], limits: &Limits) -> Result<Vec<Texture>, Fault> {
    let mut bytes = 0u64;
    let mut textures: Vec<Option<Texture>> = Vec::new();
    for &MaskedTexture { color, mask, channel } in used {
        let color = color.map(|color| &decoded[color as usize]);
        let texture = mask.map(|mask| {
            let mask = &decoded[mask as usize];
            let size_px = color.map_or(UVec2::ONE, size_px).max(size_px(mask));
            bytes += u64::from(size_px.x) * u64::from(size_px.y) * 4;
            at_most("map_d, textures with opacity in bytes", bytes, limits.texture_bytes)?;
            Ok(combined(color, mask, channel, size_px))
        });
        textures.push(texture.transpose()?);
    }
    // Colours without a mask are needed once, and moved.
    for (texture, used) in textures.iter_mut().zip(used) {
        if let (None, Some(color)) = (&texture, used.color) {
            let empty = Texture { width_px: 0, height_px: 0, is_srgb: true, srgba8: Vec::new() };
            *texture = Some(std::mem::replace(&mut decoded[color as usize], empty));
        }
    }
    Ok(textures.into_iter().flatten().collect())
}

fn size_px(texture: &Texture) -> UVec2 {
    UVec2::new(texture.width_px, texture.height_px)
}

/// Colours, white without a texture, with the mask's channel as alpha. Each texel takes the nearest one of both.
fn combined(color: Option<&Texture>, mask: &Texture, channel: Option<Channel>, size_px: UVec2) -> Texture {
    let has_alpha = mask.srgba8.chunks_exact(4).any(|texel| texel[3] < 255);
    let channel = channel.unwrap_or(if has_alpha { Channel::Alpha } else { Channel::Luminance });
    let mut srgba8 = Vec::with_capacity(size_px.x as usize * size_px.y as usize * 4);
    for y in 0..size_px.y {
        for x in 0..size_px.x {
            let at_px = UVec2::new(x, y);
            let [r, g, b, _] = color.map_or([255; 4], |color| nearest(color, at_px, size_px));
            srgba8.extend([r, g, b, opacity(nearest(mask, at_px, size_px), channel)]);
        }
    }
    Texture { width_px: size_px.x, height_px: size_px.y, is_srgb: true, srgba8 }
}

/// The texel at a place among `of_px` columns and rows that stand for the whole texture.
fn nearest(texture: &Texture, at_px: UVec2, of_px: UVec2) -> [u8; 4] {
    let texel = at_px.as_u64vec2() * size_px(texture).as_u64vec2() / of_px.as_u64vec2();
    let first = (texel.y * u64::from(texture.width_px) + texel.x) as usize * 4;
    texture.srgba8.get(first..first + 4).and_then(|texel| texel.try_into().ok()).unwrap_or([255; 4])
}

fn opacity([r, g, b, a]: [u8; 4], channel: Channel) -> u8 {
    match channel {
        Channel::Red => r,
        Channel::Green => g,
        Channel::Blue => b,
        Channel::Alpha => a,
        // Rec. 709.
        Channel::Luminance => (0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b) + 0.5) as u8,
    }
}
