//! Materials, and the textures that they use.

use std::cell::OnceCell;
use std::collections::HashMap;

use depth_image::linear_from_srgb8;
use glam::Vec3;
use gltf::json::image::Image;
use gltf::json::material::{AlphaMode, Material as JsonMaterial};
use gltf::json::texture::{Info, Texture as JsonTexture};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::super::clamped::{all_clamped, clamped};
use super::super::folder::existing;
use super::super::picture::{EncodedPicture, decode_all};
use super::super::source_scene::SourceScene;
use super::document::Document;
use crate::error::Fault;
use crate::{Material, Texture};

/// The cut-off of `alphaMode: BLEND`. There is no blending, since a depth image holds one surface a texel.
const BLEND_CUTOFF: f32 = 0.5;

/// Fills the scene's materials, one more than the file's (its default), and its textures.
pub(super) fn read(document: &Document, scene: &mut SourceScene) -> Result<(), Fault> {
    let root = document.root;
    let mut pictures = Pictures::default();
    let uses =
        root.materials.iter().enumerate().map(|(i, m)| Uses::of(root, m, &mut pictures, &format!("material {i}")));
    let uses: Vec<_> = uses.collect::<Result<_, _>>()?;
    let encoded = pictures.uses.iter().map(|&(image, is_srgb)| encoded_picture(document, image, is_srgb));
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

/// The texture coordinates of a texture, and `KHR_texture_transform`.
#[derive(PartialEq)]
pub(super) struct UvSource {
    pub set: u32,
    offset: [f32; 2],
    scale: [f32; 2],
    rotation_rad: f32,
}

/// A vertex has one pair of coordinates: those of the base colour, else those of metallic and roughness.
pub(super) fn uv_source(root: &Root, material: Option<Index<JsonMaterial>>) -> UvSource {
    let pbr = material.and_then(|m| root.get(m)).map(|m| &m.pbr_metallic_roughness);
    uv_of(pbr.and_then(|p| p.base_color_texture.as_ref().or(p.metallic_roughness_texture.as_ref())))
}

fn uv_of(info: Option<&Info>) -> UvSource {
    let mut source = UvSource { set: 0, offset: [0.0; 2], scale: [1.0; 2], rotation_rad: 0.0 };
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

/// The images that materials use. An image that holds colours here and data there occurs twice.
#[derive(Default)]
struct Pictures {
    uses: Vec<(Index<Image>, bool)>,
    place_of: HashMap<(usize, bool), usize>,
}

impl Pictures {
    fn place(&mut self, root: &Root, info: &Info, is_srgb: bool, element: &str) -> Result<usize, Fault> {
        let missing =
            || Fault::malformed(element, format!("texture {} or its image does not exist", info.index.value()));
        let image = image_of(root.get(info.index).ok_or_else(missing)?);
        root.get(image).ok_or_else(missing)?;
        let next = self.uses.len();
        let place = *self.place_of.entry((image.value(), is_srgb)).or_insert(next);
        if place == next {
            self.uses.push((image, is_srgb));
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

/// Places in [`Pictures`] of a material's textures.
struct Uses {
    base_color: Option<usize>,
    metallic_roughness: Option<usize>,
    emissive: Option<usize>,
}

impl Uses {
    fn of(root: &Root, material: &JsonMaterial, pictures: &mut Pictures, element: &str) -> Result<Self, Fault> {
        let mut place =
            |info: &Option<Info>, is_srgb| info.as_ref().map(|i| pictures.place(root, i, is_srgb, element)).transpose();
        let pbr = &material.pbr_metallic_roughness;
        Ok(Self {
            base_color: place(&pbr.base_color_texture, true)?,
            metallic_roughness: place(&pbr.metallic_roughness_texture, false)?,
            emissive: place(&material.emissive_texture, true)?,
        })
    }
}

fn encoded_picture(document: &Document, index: Index<Image>, is_srgb: bool) -> Result<EncodedPicture, Fault> {
    let element = format!("image {}", index.value());
    let image = document.root.get(index).ok_or_else(|| Fault::malformed(&element, "it does not exist"))?;
    let bytes = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => existing(document.read_uri(&element, uri))?,
        (None, Some(view)) => Some(document.view(view, &element)?.1.to_vec()),
        (None, None) => return Err(Fault::malformed(element, "it has neither a uri nor a buffer view")),
    };
    Ok(EncodedPicture { file: image.uri.clone().unwrap_or_default(), element, bytes, is_srgb })
}

fn converted(material: &JsonMaterial, uses: &Uses, means: &Means, number: usize) -> Result<Material, Fault> {
    let element = format!("material {number}");
    let Checked::Valid(alpha_mode) = material.alpha_mode else {
        return Err(Fault::malformed(element, "unknown alphaMode"));
    };
    let pbr = &material.pbr_metallic_roughness;
    let base_color = all_clamped(format_args!("{element}: base colour"), pbr.base_color_factor.0, 0.0..=1.0)?;
    let surface = MetallicRoughness::of(material, uses, means, &element)?;
    let [metallic, roughness] = surface.mean;
    let (phong_specular, phong_exponent) = Material::phong_from_metallic_roughness(metallic, roughness);
    Ok(Material {
        base_color_linear: base_color,
        base_color_texture: uses.base_color.map(|place| place as u32),
        metallic: surface.factors[0],
        roughness: surface.factors[1],
        metallic_roughness_texture: surface.texture,
        emissive_linear: emissive(material, uses, means, &element)?,
        phong_specular,
        phong_exponent,
        alpha_cutoff: match alpha_mode {
            AlphaMode::Opaque => 0.0,
            AlphaMode::Mask => {
                let cutoff = material.alpha_cutoff.map_or(0.5, |c| c.0);
                clamped(format_args!("{element}: alpha cutoff"), cutoff, 0.0..=f32::MAX)?
            }
            AlphaMode::Blend => BLEND_CUTOFF,
        },
        double_sided: material.double_sided,
        unlit: material.extensions.as_ref().is_some_and(|e| e.unlit.is_some()),
        name: material.name.clone().unwrap_or(element),
    })
}

/// Each pair is metallic, then roughness.
struct MetallicRoughness {
    factors: [f32; 2],
    texture: Option<u32>,
    /// Factors times the texture's mean.
    mean: [f32; 2],
}

impl MetallicRoughness {
    fn of(material: &JsonMaterial, uses: &Uses, means: &Means, element: &str) -> Result<Self, Fault> {
        let pbr = &material.pbr_metallic_roughness;
        let metallic = clamped(format_args!("{element}: metallic"), pbr.metallic_factor.0, 0.0..=1.0)?;
        let roughness = clamped(format_args!("{element}: roughness"), pbr.roughness_factor.0, 0.0..=1.0)?;
        let factors = [metallic, roughness];
        let Some(place) = uses.metallic_roughness else {
            return Ok(Self { factors, texture: None, mean: factors });
        };
        let of_texture = means.linear(place);
        let mean = [metallic * of_texture.z, roughness * of_texture.y];
        let base = pbr.base_color_texture.as_ref();
        let has_own_coordinates = base.is_some() && uv_of(base) != uv_of(pbr.metallic_roughness_texture.as_ref());
        let (factors, texture) = if has_own_coordinates { (mean, None) } else { (factors, Some(place as u32)) };
        Ok(Self { factors, texture, mean })
    }
}

fn emissive(material: &JsonMaterial, uses: &Uses, means: &Means, element: &str) -> Result<Vec3, Fault> {
    let element = format!("{element}: emissive colour");
    let extensions = material.extensions.as_ref();
    let strength = extensions.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |s| s.emissive_strength.0);
    let glow = uses.emissive.map_or(Vec3::ONE, |place| means.linear(place));
    let color = (Vec3::from(material.emissive_factor.0) * glow * strength).to_array();
    all_clamped(element, color, 0.0..=f32::MAX).map(Vec3::from)
}

/// Means of textures. Each is computed once, on first use: many materials may share a large texture.
struct Means<'a>(Vec<(&'a Texture, OnceCell<Vec3>)>);

impl<'a> Means<'a> {
    fn of(textures: &'a [Texture]) -> Self {
        Self(textures.iter().map(|texture| (texture, OnceCell::new())).collect())
    }

    /// Mean of the texture's colour channels, linear.
    fn linear(&self, place: usize) -> Vec3 {
        let (texture, mean) = &self.0[place];
        *mean.get_or_init(|| mean_linear(texture))
    }
}

fn mean_linear(texture: &Texture) -> Vec3 {
    let decode = |code: u8| if texture.is_srgb { linear_from_srgb8(code) } else { f32::from(code) / 255.0 };
    let values: Vec<f32> = (0..=255).map(decode).collect();
    let mut sum = [0f64; 3];
    for texel in texture.srgba8.chunks_exact(4) {
        (0..3).for_each(|channel| sum[channel] += f64::from(values[texel[channel] as usize]));
    }
    let texels = f64::from(texture.width_px) * f64::from(texture.height_px);
    Vec3::from(sum.map(|s| (s / texels) as f32))
}

/// Drops textures that served for their mean alone, and renumbers the others.
fn keep_referred_to(textures: Vec<Texture>, materials: &mut [Material]) -> Vec<Texture> {
    let mut kept = vec![false; textures.len()];
    let used = materials.iter().flat_map(|m| [m.base_color_texture, m.metallic_roughness_texture]).flatten();
    used.for_each(|place| kept[place as usize] = true);
    let number_of = |place: u32| kept[..place as usize].iter().filter(|&&k| k).count() as u32;
    for material in materials {
        material.base_color_texture = material.base_color_texture.map(number_of);
        material.metallic_roughness_texture = material.metallic_roughness_texture.map(number_of);
    }
    textures.into_iter().zip(&kept).filter(|(_, kept)| **kept).map(|(texture, _)| texture).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_maps_u_to_minus_v() {
        let turn =
            UvSource { set: 0, offset: [1.0, 2.0], scale: [2.0, 1.0], rotation_rad: std::f32::consts::FRAC_PI_2 };
        let [u, v] = turn.apply([0.5, 0.0]);
        assert!((u - 1.0).abs() < 1e-6 && (v - 1.0).abs() < 1e-6, "{u} {v}");
    }
}
