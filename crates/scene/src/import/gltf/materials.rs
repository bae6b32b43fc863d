//! Materials, and the textures that they use.

use std::collections::HashMap;

use depth_image::linear_from_srgb8;
use glam::Vec3;
use gltf::json::image::Image;
use gltf::json::material::{AlphaMode, Material as JsonMaterial};
use gltf::json::texture::Info;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::super::folder::Folder;
use super::super::picture::{EncodedPicture, decode_all};
use super::super::source_scene::SourceScene;
use super::accessors::{Buffers, read_uri};
use crate::error::Fault;
use crate::{Limits, Material, Texture};

/// Where `alphaMode: BLEND` is cut: there is no blending, as a depth image holds one surface a texel.
const BLEND_CUTOFF: f32 = 0.5;

/// Fills the scene's materials, one more than the file's (its default), and its textures.
pub(super) fn read(
    root: &Root,
    buffers: &Buffers,
    folder: &Folder,
    limits: &Limits,
    scene: &mut SourceScene,
) -> Result<(), Fault> {
    let mut pictures = Pictures::default();
    let uses =
        root.materials.iter().enumerate().map(|(i, m)| Uses::of(root, m, &mut pictures, &format!("material {i}")));
    let uses: Vec<_> = uses.collect::<Result<_, _>>()?;
    let encoded = pictures.images.iter().map(|&image| encoded_picture(root, buffers, folder, image));
    let textures = decode_all(&encoded.collect::<Result<Vec<_>, _>>()?, limits)?;
    for (number, (material, uses)) in root.materials.iter().zip(&uses).enumerate() {
        scene.materials.push(converted(material, uses, &textures, number)?);
    }
    scene.materials.push(Material { name: "default".into(), ..Material::default() });
    scene.textures = keep_base_colours(textures, &mut scene.materials);
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

/// Which texture coordinates a material's base colour takes, and `KHR_texture_transform`.
pub(super) struct UvSource {
    pub set: u32,
    offset: [f32; 2],
    scale: [f32; 2],
    rotation_rad: f32,
}

pub(super) fn uv_source(root: &Root, material: Option<Index<JsonMaterial>>) -> UvSource {
    let mut source = UvSource { set: 0, offset: [0.0; 2], scale: [1.0; 2], rotation_rad: 0.0 };
    let info = material.and_then(|m| root.get(m)).and_then(|m| m.pbr_metallic_roughness.base_color_texture.as_ref());
    let Some(info) = info else { return source };
    source.set = info.tex_coord;
    if let Some(transform) = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref()) {
        source.set = transform.tex_coord.unwrap_or(source.set);
        source.offset = transform.offset.0;
        source.scale = transform.scale.0;
        source.rotation_rad = transform.rotation.0;
    }
    source
}

impl UvSource {
    /// Scale, then rotate counter-clockwise as seen with v downwards, then offset.
    pub(super) fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let (sin, cos) = self.rotation_rad.sin_cos();
        let (u, v) = (u * self.scale[0], v * self.scale[1]);
        [cos * u + sin * v + self.offset[0], cos * v - sin * u + self.offset[1]]
    }
}

/// The images that materials use, each once.
#[derive(Default)]
struct Pictures {
    images: Vec<Index<Image>>,
    place_of: HashMap<usize, usize>,
}

impl Pictures {
    fn place(&mut self, root: &Root, info: &Info, element: &str) -> Result<usize, Fault> {
        let missing =
            || Fault::malformed(element, format!("texture {} or its image does not exist", info.index.value()));
        let image = root.get(info.index).ok_or_else(missing)?.source;
        root.get(image).ok_or_else(missing)?;
        let next = self.images.len();
        let place = *self.place_of.entry(image.value()).or_insert(next);
        if place == next {
            self.images.push(image);
        }
        Ok(place)
    }
}

/// Places in [`Pictures`] of a material's textures.
struct Uses {
    base_color: Option<usize>,
    metallic_roughness: Option<usize>,
    emissive: Option<usize>,
}

impl Uses {
    fn of(root: &Root, material: &JsonMaterial, pictures: &mut Pictures, element: &str) -> Result<Self, Fault> {
        let mut place = |info: &Option<Info>| info.as_ref().map(|i| pictures.place(root, i, element)).transpose();
        let pbr = &material.pbr_metallic_roughness;
        Ok(Self {
            base_color: place(&pbr.base_color_texture)?,
            metallic_roughness: place(&pbr.metallic_roughness_texture)?,
            emissive: place(&material.emissive_texture)?,
        })
    }
}

fn encoded_picture(
    root: &Root,
    buffers: &Buffers,
    folder: &Folder,
    index: Index<Image>,
) -> Result<EncodedPicture, Fault> {
    let element = format!("image {}", index.value());
    let image = root.get(index).ok_or_else(|| Fault::malformed(&element, "it does not exist"))?;
    let bytes = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => read_uri(&element, uri, folder)?,
        (None, Some(view)) => buffers.view(root, view, &element)?.bytes.to_vec(),
        (None, None) => {
            return Err(Fault::malformed(element, "it has neither a uri nor a buffer view"));
        }
    };
    Ok(EncodedPicture { element, bytes })
}

fn converted(material: &JsonMaterial, uses: &Uses, textures: &[Texture], number: usize) -> Result<Material, Fault> {
    let element = format!("material {number}");
    let Checked::Valid(alpha_mode) = material.alpha_mode else {
        return Err(Fault::malformed(element, "unknown alphaMode"));
    };
    let pbr = &material.pbr_metallic_roughness;
    let metal_rough =
        uses.metallic_roughness.map_or(Vec3::ONE, |place| mean(&textures[place], |byte| f32::from(byte) / 255.0));
    let glow = uses.emissive.map_or(Vec3::ONE, |place| mean(&textures[place], linear_from_srgb8));
    let metallic = (pbr.metallic_factor.0 * metal_rough.z).clamp(0.0, 1.0);
    let roughness = (pbr.roughness_factor.0 * metal_rough.y).clamp(0.0, 1.0);
    let extensions = material.extensions.as_ref();
    let strength = extensions.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |s| s.emissive_strength.0);
    let (phong_specular, phong_exponent) = Material::phong_from_metallic_roughness(metallic, roughness);
    Ok(Material {
        name: material.name.clone().unwrap_or(element),
        base_color_linear: pbr.base_color_factor.0,
        base_color_texture: uses.base_color.map(|place| place as u32),
        metallic,
        roughness,
        emissive_linear: Vec3::from(material.emissive_factor.0) * glow * strength,
        phong_specular,
        phong_exponent,
        alpha_cutoff: match alpha_mode {
            AlphaMode::Opaque => 0.0,
            AlphaMode::Mask => material.alpha_cutoff.map_or(0.5, |c| c.0),
            AlphaMode::Blend => BLEND_CUTOFF,
        },
        double_sided: material.double_sided,
        unlit: extensions.is_some_and(|e| e.unlit.is_some()),
    })
}

/// Mean of the colour channels of a texture whose texels the model has no place for.
fn mean(texture: &Texture, decode: impl Fn(u8) -> f32) -> Vec3 {
    let values: Vec<f32> = (0..=255).map(decode).collect();
    let mut sum = [0f64; 3];
    for texel in texture.srgba8.chunks_exact(4) {
        (0..3).for_each(|channel| sum[channel] += f64::from(values[texel[channel] as usize]));
    }
    let texels = f64::from(texture.width_px) * f64::from(texture.height_px);
    Vec3::from(sum.map(|s| (s / texels) as f32))
}

/// Drops the textures of which only the mean was needed, and renumbers the others.
fn keep_base_colours(textures: Vec<Texture>, materials: &mut [Material]) -> Vec<Texture> {
    let is_kept = |place: usize| materials.iter().any(|m| m.base_color_texture == Some(place as u32));
    let kept: Vec<bool> = (0..textures.len()).map(is_kept).collect();
    let number_of = |place: u32| kept[..place as usize].iter().filter(|&&k| k).count() as u32;
    materials.iter_mut().for_each(|m| m.base_color_texture = m.base_color_texture.map(number_of));
    textures.into_iter().zip(&kept).filter(|(_, kept)| **kept).map(|(texture, _)| texture).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_takes_u_to_minus_v() {
        let turn =
            UvSource { set: 0, offset: [1.0, 2.0], scale: [2.0, 1.0], rotation_rad: std::f32::consts::FRAC_PI_2 };
        let [u, v] = turn.apply([0.5, 0.0]);
        assert!((u - 1.0).abs() < 1e-6 && (v - 1.0).abs() < 1e-6, "{u} {v}");
    }
}
