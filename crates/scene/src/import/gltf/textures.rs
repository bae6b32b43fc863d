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
use super::Document;
use super::specular_glossiness::SpecularGlossiness;
use super::texture_coordinates::{Coordinates, maps_of};
use crate::{Fault, Texture, TextureUse, Wrap, at_most};

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
        let image = match image_of(self.document, json) {
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
    /// The textures that vertices have coordinates for, in the order of [`crate::Material::textures`].
    maps: [Option<Used>; 5],
    pub coordinates: Coordinates,
    pub specular_glossiness: Option<SpecularGlossiness>,
    /// Places of textures that count by their mean.
    pub specular: Option<usize>,
    pub specular_color: Option<usize>,
    pub specular_glossiness_texture: Option<usize>,
    pub transmission: Option<usize>,
}

impl Uses {
    pub(super) fn of(material: &JsonMaterial, pictures: &mut Pictures, element: &str) -> Result<Self, Fault> {
        use Content::{Colors, Data, Normals};
        let specular_glossiness = SpecularGlossiness::of(material, element)?;
        let maps = maps_of(material, specular_glossiness.as_ref(), element)?;
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
        let extensions = material.extensions.as_ref();
        let specular = extensions.and_then(|e| e.specular.as_ref());
        let transmission = extensions.and_then(|e| e.transmission.as_ref());
        let transmission = transmission.and_then(|t| t.transmission_texture.as_ref());
        if transmission.is_some() {
            pictures.document.warnings.count("textures of transmission count by their mean", element);
        }
        let glossiness = specular_glossiness.as_ref().and_then(|s| s.specular_glossiness_texture.as_ref());
        let mut place = |info: Option<&Info>, content| match info {
            Some(info) => pictures.place(info.index, content, element),
            None => Ok(None),
        };
        Ok(Self {
            maps: uses,
            coordinates,
            specular: place(specular.and_then(|s| s.specular_texture.as_ref()), Data)?,
            specular_color: place(specular.and_then(|s| s.specular_color_texture.as_ref()), Colors)?,
            specular_glossiness_texture: place(glossiness, Colors)?,
            transmission: place(transmission, Data)?,
            specular_glossiness,
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

/// Numbers the textures that materials show, and says which these are: the others served for their mean alone.
pub(super) fn number_shown(uses: &mut [Uses], textures: usize) -> Vec<bool> {
    let used = uses.iter_mut().flat_map(|uses| &mut uses.maps).flatten();
    let used: Vec<&mut TextureUse> = used.filter_map(|used| used.texture.as_mut()).collect();
    let mut is_shown = vec![false; textures];
    used.iter().for_each(|used| is_shown[used.texture as usize] = true);
    for used in used {
        used.texture = is_shown[..used.texture as usize].iter().filter(|&&is_shown| is_shown).count() as u32;
    }
    is_shown
}

/// A format of pictures that is not read.
struct UnreadFormat {
    name: &'static str,
    extension: &'static str,
    mime_type: &'static str,
    file_ending: &'static str,
    /// The command line that converts a file, as the end of a sentence.
    advice: &'static str,
}

const UNREAD: [UnreadFormat; 2] = [
    UnreadFormat {
        name: "AVIF",
        extension: "EXT_texture_avif",
        mime_type: "image/avif",
        file_ending: ".avif",
        advice: "; `npx @gltf-transform/cli png IN OUT` converts the file",
    },
    UnreadFormat {
        name: "DDS",
        extension: "MSFT_texture_dds",
        mime_type: "image/vnd-ms.dds",
        file_ending: ".dds",
        advice: "",
    },
];

/// The image of a texture: in WebP, where the file has it in another format, too; in KTX2 where it has no other. The error is
/// the reason for which there is none, with advice.
pub(super) fn image_of(document: &Document, texture: &JsonTexture) -> Result<Index<Image>, String> {
    let extensions = texture.extensions.as_ref().map(|extensions| &extensions.others);
    let of_extension = |name: &str| {
        let source = extensions?.get(name)?.get("source")?.as_u64()?;
        u32::try_from(source).ok().map(Index::new)
    };
    let sources = [of_extension("EXT_texture_webp"), Some(texture.source), of_extension("KHR_texture_basisu")];
    let mut by_content = None;
    for index in sources.into_iter().flatten() {
        let image = document.root.get(index);
        if image.is_some_and(|image| image.uri.is_some() || image.buffer_view.is_some()) {
            match unread_format(document, index) {
                None => return Ok(index),
                format => by_content = by_content.or(format),
            }
        }
    }
    let format = by_content.or_else(|| UNREAD.iter().find(|format| of_extension(format.extension).is_some()));
    let Some(UnreadFormat { name, extension, advice, .. }) = format else {
        return Err("textures without a picture: materials show their factors".into());
    };
    Err(format!("pictures in {name} ({extension}), which are not read: materials show their factors{advice}"))
}

/// The format of an image, by what the file says of it and by its first bytes.
fn unread_format(document: &Document, image: Index<Image>) -> Option<&'static UnreadFormat> {
    let json = document.root.get(image)?;
    let mime_type = json.mime_type.as_ref().map(|mime_type| mime_type.0.as_str());
    let uri = json.uri.as_ref().map(|uri| uri.to_ascii_lowercase());
    let start = json.buffer_view.and_then(|view| document.view(view, "image").ok()).map(|(_, bytes)| bytes);
    let is_avif = start.and_then(|bytes| bytes.get(4..12)) == Some(b"ftypavif");
    UNREAD.iter().find(|format| {
        let is_named = uri.as_ref().is_some_and(|uri| {
            let path = uri.split('?').next().unwrap_or(uri);
            path.ends_with(format.file_ending) || uri.starts_with(&format!("data:{}", format.mime_type))
        });
        mime_type == Some(format.mime_type) || is_named || (is_avif && format.name == "AVIF")
    })
}
