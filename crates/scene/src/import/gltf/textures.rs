//! The textures of materials: which images they use, and where a surface has them.

use std::cell::OnceCell;
use std::collections::HashMap;

use depth_image::linear_from_srgb8;
use glam::Vec4;
use gltf::json::image::Image;
use gltf::json::material::Material as JsonMaterial;
use gltf::json::texture::{Info, Texture as JsonTexture, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::super::picture::{Content, EncodedPicture};
use super::document::Document;
use super::texture_coordinates::{Coordinates, maps_of};
use super::{sources, specular_glossiness};
use crate::error::{Fault, at_most};
use crate::{Material, Texture, TextureUse, Wrap};

/// The scene's number of a primitive's material.
pub(super) fn material_number(root: &Root, material: Option<Index<JsonMaterial>>, element: &str) -> Result<u32, Fault> {
    let number = material.map_or(root.materials.len(), |m| m.value());
    if number > root.materials.len() || (material.is_some() && number == root.materials.len()) {
        return Err(Fault::malformed(element, format!("material {number} does not exist")));
    }
    Ok(number as u32)
}

/// The images that materials use. An image that holds colours here and data there occurs twice.
pub(super) struct Pictures<'a> {
    document: &'a Document<'a>,
    uses: Vec<(Index<Image>, Content)>,
    place_of: HashMap<(usize, Content), usize>,
}

impl<'a> Pictures<'a> {
    pub(super) fn new(document: &'a Document<'a>) -> Self {
        Self { document, uses: Vec::new(), place_of: HashMap::new() }
    }

    /// The place of a texture's image; `None` for a texture without one that is read, with a warning.
    fn place(&mut self, index: Index<JsonTexture>, content: Content, element: &str) -> Result<Option<usize>, Fault> {
        let number = index.value();
        let Some(json) = self.document.root.get(index) else {
            return Err(Fault::malformed(element, format!("texture {number} does not exist")));
        };
        let image = match sources::image_of(self.document, json) {
            Ok(image) => image,
            Err(reason) => {
                let name = json.name.as_deref().unwrap_or("no name");
                self.document.warnings.count(reason, format_args!("{element}, texture {number} ({name})"));
                return Ok(None);
            }
        };
        let next = self.uses.len();
        let place = *self.place_of.entry((image.value(), content)).or_insert(next);
        if place == next {
            self.uses.push((image, content));
        }
        Ok(Some(place))
    }

    /// The files of all images. Many images may share a buffer view: the limit of a file bounds their copies together.
    pub(super) fn encoded(&self) -> Result<Vec<EncodedPicture>, Fault> {
        let mut bytes_left = self.document.limits.file_bytes;
        let mut encoded = Vec::with_capacity(self.uses.len());
        for &(index, content) in &self.uses {
            let element = format!("image {}", index.value());
            let image = self.document.root.get(index);
            let image = image.ok_or_else(|| Fault::malformed(&element, "it does not exist"))?;
            let bytes = match (&image.uri, image.buffer_view) {
                (Some(uri), _) => self.document.read_uri(&element, uri)?,
                (None, Some(view)) => {
                    let (_, bytes) = self.document.view(view, &element)?;
                    at_most(format_args!("{element}, bytes of images"), bytes.len() as u64, bytes_left)?;
                    bytes_left -= bytes.len() as u64;
                    Some(bytes.to_vec())
                }
                (None, None) => return Err(Fault::malformed(element, "it has neither a uri nor a buffer view")),
            };
            encoded.push(EncodedPicture { file: image.uri.clone().unwrap_or_default(), element, bytes, content });
        }
        Ok(encoded)
    }
}

/// A texture of a material: its place in [`Pictures`], and its use where vertices have its coordinates.
struct Used {
    place: usize,
    texture: Option<TextureUse>,
}

/// The textures of a material.
pub(super) struct Uses {
    /// The textures that vertices have coordinates for, in the order of [`Material::textures`].
    maps: [Option<Used>; 5],
    /// Places of textures that count by their mean.
    pub specular: Option<usize>,
    pub specular_color: Option<usize>,
    pub specular_glossiness: Option<usize>,
}

impl Uses {
    pub(super) fn of(material: &JsonMaterial, pictures: &mut Pictures, element: &str) -> Result<Self, Fault> {
        use Content::{Colors, Data, Normals};
        let maps = maps_of(material, element)?;
        let coordinates = Coordinates::of(&maps);
        let contents = [Colors, Data, Normals, Colors, Data].into_iter();
        let mut uses = [const { None }; 5];
        for ((used, map), content) in uses.iter_mut().zip(&maps).zip(contents) {
            let Some(map) = map else { continue };
            let Some(place) = pictures.place(map.texture, content, element)? else { continue };
            let wrap = wrap_of(pictures.document.root, map.texture, element)?;
            let second_uv = coordinates.is_second(&map.source);
            let texture = second_uv.map(|second_uv| TextureUse { texture: place as u32, second_uv, wrap });
            *used = Some(Used { place, texture });
        }
        let specular = material.extensions.as_ref().and_then(|e| e.specular.as_ref());
        let specular_glossiness = specular_glossiness::of(material, element)?;
        let specular_glossiness = specular_glossiness.as_ref().and_then(|s| s.specular_glossiness_texture.as_ref());
        let mut place = |info: Option<&Info>, content| match info {
            Some(info) => pictures.place(info.index, content, element),
            None => Ok(None),
        };
        Ok(Self {
            maps: uses,
            specular: place(specular.and_then(|s| s.specular_texture.as_ref()), Data)?,
            specular_color: place(specular.and_then(|s| s.specular_color_texture.as_ref()), Colors)?,
            specular_glossiness: place(specular_glossiness, Colors)?,
        })
    }

    pub(super) fn texture(&self, map: usize) -> Option<TextureUse> {
        self.maps[map].as_ref()?.texture
    }

    /// The place of a texture, with or without coordinates.
    pub(super) fn place(&self, map: usize) -> Option<usize> {
        self.maps[map].as_ref().map(|used| used.place)
    }

    /// The place of a texture for whose coordinates vertices have no room.
    pub(super) fn without_coordinates(&self, map: usize) -> Option<usize> {
        self.maps[map].as_ref().filter(|used| used.texture.is_none()).map(|used| used.place)
    }
}

/// Places in [`Uses::maps`].
pub(super) const BASE_COLOR: usize = 0;
pub(super) const METALLIC_ROUGHNESS: usize = 1;
pub(super) const NORMAL: usize = 2;
pub(super) const EMISSIVE: usize = 3;
pub(super) const OCCLUSION: usize = 4;

/// The texture beyond its borders, along u and v.
fn wrap_of(root: &Root, texture: Index<JsonTexture>, element: &str) -> Result<[Wrap; 2], Fault> {
    let Some(index) = root.get(texture).and_then(|texture| texture.sampler) else {
        return Ok([Wrap::Repeat; 2]);
    };
    let Some(sampler) = root.get(index) else {
        return Err(Fault::malformed(element, format!("sampler {} does not exist", index.value())));
    };
    let mut wraps = [Wrap::Repeat; 2];
    for (wrap, mode) in wraps.iter_mut().zip([sampler.wrap_s, sampler.wrap_t]) {
        *wrap = match mode {
            Checked::Valid(WrappingMode::Repeat) => Wrap::Repeat,
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
            Checked::Invalid => {
                return Err(Fault::malformed(format_args!("sampler {}", index.value()), "unknown wrap mode"));
            }
        };
    }
    Ok(wraps)
}

/// Means of textures. Each is computed once, on first use: many materials may share a large texture.
pub(super) struct Means<'a>(Vec<(&'a Texture, OnceCell<Vec4>)>);

impl<'a> Means<'a> {
    pub(super) fn of(textures: &'a [Texture]) -> Self {
        Self(textures.iter().map(|texture| (texture, OnceCell::new())).collect())
    }

    /// Mean of the texture's channels, linear.
    pub(super) fn linear(&self, place: usize) -> Vec4 {
        let (texture, mean) = &self.0[place];
        *mean.get_or_init(|| mean_linear(texture))
    }
}

fn mean_linear(texture: &Texture) -> Vec4 {
    let linear: Vec<f32> = (0..=255u8).map(|code| f32::from(code) / 255.0).collect();
    let colors = if texture.is_srgb { (0..=255).map(linear_from_srgb8).collect() } else { linear.clone() };
    let mut sum = [0f64; 4];
    for texel in texture.srgba8.as_chunks::<4>().0 {
        (0..3).for_each(|channel| sum[channel] += f64::from(colors[texel[channel] as usize]));
        sum[3] += f64::from(linear[texel[3] as usize]);
    }
    let texels = f64::from(texture.width_px) * f64::from(texture.height_px);
    Vec4::from(sum.map(|s| (s / texels) as f32))
}

/// Drops textures that served for their mean alone, and renumbers the others.
pub(super) fn keep_referred_to(textures: Vec<Texture>, materials: &mut [Material]) -> Vec<Texture> {
    let mut kept = vec![false; textures.len()];
    let used = materials.iter().flat_map(Material::textures).flatten();
    used.for_each(|used| kept[used.texture as usize] = true);
    for used in materials.iter_mut().flat_map(Material::textures_mut).flatten() {
        used.texture = kept[..used.texture as usize].iter().filter(|&&is_kept| is_kept).count() as u32;
    }
    textures.into_iter().zip(&kept).filter(|(_, kept)| **kept).map(|(texture, _)| texture).collect()
}
