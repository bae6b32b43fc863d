//! Materials, and the textures that they use.

use std::cell::OnceCell;
use std::collections::HashMap;

use depth_image::linear_from_srgb8;
use glam::{Vec3, Vec4};
use gltf::json::image::Image;
use gltf::json::material::{AlphaMode, Material as JsonMaterial};
use gltf::json::texture::{Info, Texture as JsonTexture, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::super::clamped::{all_clamped, clamped};
use super::super::folder::existing;
use super::super::picture::{Content, EncodedPicture, decode_all};
use super::super::source_scene::SourceScene;
use super::document::Document;
use super::texture_coordinates::{Coordinates, maps_of};
use crate::error::{Fault, at_most};
use crate::{DIELECTRIC_REFLECTANCE, Material, Texture, TextureUse, Wrap};

/// Fills the scene's materials, one more than the file's (its default), and its textures.
pub(super) fn read(document: &Document, scene: &mut SourceScene) -> Result<(), Fault> {
    let root = document.root;
    let mut pictures = Pictures::default();
    let of_material = |(i, m): (usize, &JsonMaterial)| Uses::of(root, m, &mut pictures, &format!("material {i}"));
    let uses: Vec<_> = root.materials.iter().enumerate().map(of_material).collect::<Result<_, _>>()?;
    let mut bytes_left = document.limits.file_bytes;
    let encoded =
        pictures.uses.iter().map(|&(image, content)| encoded_picture(document, image, content, &mut bytes_left));
    let encoded = encoded.collect::<Result<Vec<_>, _>>()?;
    let textures = decode_all(&encoded, document.limits, document.folder.missing_textures)?;
    let means = Means::of(&textures);
    for (number, (material, uses)) in root.materials.iter().zip(&uses).enumerate() {
        scene.materials.push(converted(material, uses, &means, number)?);
    }
    scene.materials.push(Material { name: "default".into(), ..Material::default() });
    scene.textures = keep_referred_to(textures, &mut scene.materials);
    Ok(())
}

/// The scene's number of a primitive's material.
pub(super) fn material_number(root: &Root, material: Option<Index<JsonMaterial>>, element: &str) -> Result<u32, Fault> {
    let number = material.map_or(root.materials.len(), |m| m.value());
    if number > root.materials.len() || (material.is_some() && number == root.materials.len()) {
        return Err(Fault::malformed(element, format!("material {number} does not exist")));
    }
    Ok(number as u32)
}

/// The images that materials use. An image that holds colours here and data there occurs twice.
#[derive(Default)]
struct Pictures {
    uses: Vec<(Index<Image>, Content)>,
    place_of: HashMap<(usize, Content), usize>,
}

impl Pictures {
    fn place(
        &mut self,
        root: &Root,
        texture: Index<JsonTexture>,
        content: Content,
        element: &str,
    ) -> Result<usize, Fault> {
        let missing = || Fault::malformed(element, format!("texture {} or its image does not exist", texture.value()));
        let image = image_of(root.get(texture).ok_or_else(missing)?);
        root.get(image).ok_or_else(missing)?;
        let next = self.uses.len();
        let place = *self.place_of.entry((image.value(), content)).or_insert(next);
        if place == next {
            self.uses.push((image, content));
        }
        Ok(place)
    }
}

/// The image of a texture: that of `EXT_texture_webp`, where the file has it in another format, too.
fn image_of(texture: &JsonTexture) -> Index<Image> {
    let webp = texture.extensions.as_ref().and_then(|extensions| extensions.others.get("EXT_texture_webp"));
    let source = webp.and_then(|webp| u32::try_from(webp.get("source")?.as_u64()?).ok());
    source.map_or(texture.source, Index::new)
}

/// A texture of a material: its place in [`Pictures`], and its use where vertices have its coordinates.
struct Used {
    place: usize,
    texture: Option<TextureUse>,
}

/// The textures of a material.
struct Uses {
    /// In the order of [`Material::textures`].
    maps: [Option<Used>; 5],
    /// Places of textures that count by their mean.
    specular: Option<usize>,
    specular_color: Option<usize>,
}

impl Uses {
    fn of(root: &Root, material: &JsonMaterial, pictures: &mut Pictures, element: &str) -> Result<Self, Fault> {
        use Content::{Colors, Data, Normals};
        let maps = maps_of(material, element)?;
        let coordinates = Coordinates::of(&maps);
        let contents = [Colors, Data, Normals, Colors, Data].into_iter();
        let mut uses = [const { None }; 5];
        for ((used, map), content) in uses.iter_mut().zip(&maps).zip(contents) {
            let Some(map) = map else { continue };
            let place = pictures.place(root, map.texture, content, element)?;
            let wrap = wrap_of(root, map.texture, element)?;
            let second_uv = coordinates.is_second(&map.source);
            let texture = second_uv.map(|second_uv| TextureUse { texture: place as u32, second_uv, wrap });
            *used = Some(Used { place, texture });
        }
        let specular = material.extensions.as_ref().and_then(|e| e.specular.as_ref());
        let mut place = |info: Option<&Info>, content| {
            info.map(|info| pictures.place(root, info.index, content, element)).transpose()
        };
        Ok(Self {
            maps: uses,
            specular: place(specular.and_then(|s| s.specular_texture.as_ref()), Data)?,
            specular_color: place(specular.and_then(|s| s.specular_color_texture.as_ref()), Colors)?,
        })
    }

    fn texture(&self, map: usize) -> Option<TextureUse> {
        self.maps[map].as_ref()?.texture
    }

    /// The place of a texture for whose coordinates vertices have no room.
    fn without_coordinates(&self, map: usize) -> Option<usize> {
        self.maps[map].as_ref().filter(|used| used.texture.is_none()).map(|used| used.place)
    }
}

/// Places in [`Uses::maps`].
const BASE_COLOR: usize = 0;
const METALLIC_ROUGHNESS: usize = 1;
const NORMAL: usize = 2;
const EMISSIVE: usize = 3;
const OCCLUSION: usize = 4;

/// The texture beyond its borders, along u and v.
fn wrap_of(root: &Root, texture: Index<JsonTexture>, element: &str) -> Result<[Wrap; 2], Fault> {
    let Some(index) = root.get(texture).and_then(|texture| texture.sampler) else {
        return Ok([Wrap::Repeat; 2]);
    };
    let missing = || Fault::malformed(element, format!("sampler {} does not exist", index.value()));
    let sampler = root.get(index).ok_or_else(missing)?;
    let wrap = |mode: Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
        Checked::Invalid => Err(Fault::malformed(format!("sampler {}", index.value()), "unknown wrap mode")),
    };
    Ok([wrap(sampler.wrap_s)?, wrap(sampler.wrap_t)?])
}

/// Many images may share a buffer view: `bytes_left` bounds their copies together.
fn encoded_picture(
    document: &Document,
    index: Index<Image>,
    content: Content,
    bytes_left: &mut u64,
) -> Result<EncodedPicture, Fault> {
    let element = format!("image {}", index.value());
    let image = document.root.get(index).ok_or_else(|| Fault::malformed(&element, "it does not exist"))?;
    let bytes = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => existing(document.read_uri(&element, uri))?,
        (None, Some(view)) => {
            let bytes = document.view(view, &element)?.1;
            at_most(format_args!("{element}, bytes of images"), bytes.len() as u64, *bytes_left)?;
            *bytes_left -= bytes.len() as u64;
            Some(bytes.to_vec())
        }
        (None, None) => return Err(Fault::malformed(element, "it has neither a uri nor a buffer view")),
    };
    Ok(EncodedPicture { file: image.uri.clone().unwrap_or_default(), element, bytes, content })
}

fn converted(material: &JsonMaterial, uses: &Uses, means: &Means, number: usize) -> Result<Material, Fault> {
    let element = format!("material {number}");
    let Checked::Valid(alpha_mode) = material.alpha_mode else {
        return Err(Fault::malformed(element, "unknown alphaMode"));
    };
    let pbr = &material.pbr_metallic_roughness;
    let base_color = all_clamped(format_args!("{element}: base colour"), pbr.base_color_factor.0, 0.0..=1.0)?;
    let reflectance = dielectric_reflectance(material, uses, means, &element)?;
    let surface = MetallicRoughness::of(material, uses, means, &element)?;
    let [metallic, roughness] = surface.mean;
    let mean_reflectance = reflectance.element_sum() / 3.0;
    let (phong_specular, phong_exponent) =
        Material::phong_from_metallic_roughness(metallic, roughness, mean_reflectance);
    let scale = material.normal_texture.as_ref().map_or(1.0, |t| t.scale);
    let strength = material.occlusion_texture.as_ref().map_or(1.0, |t| t.strength.0);
    for (map, name) in [(NORMAL, "normal map"), (OCCLUSION, "occlusion texture")] {
        if uses.without_coordinates(map).is_some() {
            tracing::warn!("{element}: its {name} needs a third pair of texture coordinates and is left out");
        }
    }
    Ok(Material {
        base_color_linear: base_color,
        base_color_texture: uses.texture(BASE_COLOR),
        metallic: surface.factors[0],
        roughness: surface.factors[1],
        metallic_roughness_texture: uses.texture(METALLIC_ROUGHNESS),
        dielectric_reflectance_linear: reflectance,
        normal_texture: uses.texture(NORMAL),
        normal_scale: clamped(format_args!("{element}: normal scale"), scale, f32::MIN..=f32::MAX)?,
        occlusion_texture: uses.texture(OCCLUSION),
        occlusion_strength: clamped(format_args!("{element}: occlusion strength"), strength, 0.0..=1.0)?,
        emissive_linear: emissive(material, uses, means, &element)?,
        emissive_texture: uses.texture(EMISSIVE),
        phong_specular,
        phong_exponent,
        alpha_cutoff: match alpha_mode {
            AlphaMode::Mask => {
                let cutoff = material.alpha_cutoff.map_or(0.5, |c| c.0);
                clamped(format_args!("{element}: alpha cutoff"), cutoff, 0.0..=f32::MAX)?
            }
            AlphaMode::Opaque | AlphaMode::Blend => 0.0,
        },
        alpha_hashed: alpha_mode == AlphaMode::Blend,
        double_sided: material.double_sided,
        unlit: material.extensions.as_ref().is_some_and(|e| e.unlit.is_some()),
        name: material.name.clone().unwrap_or(element),
    })
}

/// The reflectance of `KHR_materials_ior` and `KHR_materials_specular` at normal incidence. Their textures count by
/// their mean.
fn dielectric_reflectance(material: &JsonMaterial, uses: &Uses, means: &Means, element: &str) -> Result<Vec3, Fault> {
    let extensions = material.extensions.as_ref();
    let ior = extensions.and_then(|e| e.ior.as_ref());
    let from_ior = match ior.map(|i| clamped(format_args!("{element}: ior"), i.ior.0, 0.0..=f32::MAX)).transpose()? {
        None => DIELECTRIC_REFLECTANCE,
        // The extension's text: 0 stands for an infinite index.
        Some(0.0) => 1.0,
        Some(ior) => ((ior.max(1.0) - 1.0) / (ior.max(1.0) + 1.0)).powi(2),
    };
    let Some(specular) = extensions.and_then(|e| e.specular.as_ref()) else { return Ok(Vec3::splat(from_ior)) };
    let factor = clamped(format_args!("{element}: specular"), specular.specular_factor.0, 0.0..=1.0)?;
    let color = specular.specular_color_factor.0;
    let color = Vec3::from(all_clamped(format_args!("{element}: specular colour"), color, 0.0..=f32::MAX)?);
    let factor = factor * uses.specular.map_or(1.0, |place| means.linear(place).w);
    let color = color * uses.specular_color.map_or(Vec3::ONE, |place| means.linear(place).truncate());
    Ok((color * from_ior).min(Vec3::ONE) * factor)
}

/// Each pair is metallic, then roughness.
struct MetallicRoughness {
    factors: [f32; 2],
    /// Factors times the texture's mean.
    mean: [f32; 2],
}

impl MetallicRoughness {
    fn of(material: &JsonMaterial, uses: &Uses, means: &Means, element: &str) -> Result<Self, Fault> {
        let pbr = &material.pbr_metallic_roughness;
        let metallic = clamped(format_args!("{element}: metallic"), pbr.metallic_factor.0, 0.0..=1.0)?;
        let roughness = clamped(format_args!("{element}: roughness"), pbr.roughness_factor.0, 0.0..=1.0)?;
        let factors = [metallic, roughness];
        let Some(used) = &uses.maps[METALLIC_ROUGHNESS] else {
            return Ok(Self { factors, mean: factors });
        };
        let of_texture = means.linear(used.place);
        let mean = [metallic * of_texture.z, roughness * of_texture.y];
        Ok(Self { factors: if used.texture.is_some() { factors } else { mean }, mean })
    }
}

fn emissive(material: &JsonMaterial, uses: &Uses, means: &Means, element: &str) -> Result<Vec3, Fault> {
    let element = format!("{element}: emissive colour");
    let extensions = material.extensions.as_ref();
    let strength = extensions.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |s| s.emissive_strength.0);
    let mean = uses.without_coordinates(EMISSIVE).map_or(Vec3::ONE, |place| means.linear(place).truncate());
    let color = (Vec3::from(material.emissive_factor.0) * mean * strength).to_array();
    all_clamped(element, color, 0.0..=f32::MAX).map(Vec3::from)
}

/// Means of textures. Each is computed once, on first use: many materials may share a large texture.
struct Means<'a>(Vec<(&'a Texture, OnceCell<Vec4>)>);

impl<'a> Means<'a> {
    fn of(textures: &'a [Texture]) -> Self {
        Self(textures.iter().map(|texture| (texture, OnceCell::new())).collect())
    }

    /// Mean of the texture's channels, linear.
    fn linear(&self, place: usize) -> Vec4 {
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
fn keep_referred_to(textures: Vec<Texture>, materials: &mut [Material]) -> Vec<Texture> {
    let mut kept = vec![false; textures.len()];
    let used = materials.iter().flat_map(Material::textures).flatten();
    used.for_each(|used| kept[used.texture as usize] = true);
    let number_of = |place: u32| kept[..place as usize].iter().filter(|&&k| k).count() as u32;
    for used in materials.iter_mut().flat_map(Material::textures_mut).flatten() {
        used.texture = number_of(used.texture);
    }
    textures.into_iter().zip(&kept).filter(|(_, kept)| **kept).map(|(texture, _)| texture).collect()
}
