//! Materials.

use glam::{Vec3, Vec4};
use gltf::json::material::{AlphaMode, Material as JsonMaterial};
use gltf::json::validation::Checked;

use super::super::clamped::{all_clamped, clamped};
use super::super::picture::decode_all;
use super::super::source_scene::SourceScene;
use super::document::Document;
use super::specular_glossiness::{self, SpecularGlossiness};
use super::textures::{
    BASE_COLOR, EMISSIVE, METALLIC_ROUGHNESS, Means, NORMAL, OCCLUSION, Pictures, Uses, keep_referred_to,
};
use crate::error::Fault;
use crate::{DIELECTRIC_REFLECTANCE, Material};

/// Fills the scene's materials, one more than the file's (its default), and its textures.
pub(super) fn read(document: &Document, scene: &mut SourceScene) -> Result<(), Fault> {
    let materials = &document.root.materials;
    let mut pictures = Pictures::default();
    let mut uses = Vec::with_capacity(materials.len());
    for (number, material) in materials.iter().enumerate() {
        uses.push(Uses::of(document, material, &mut pictures, &format!("material {number}"))?);
    }
    let encoded = pictures.encoded(document)?;
    let textures = decode_all(&encoded, document.limits, document.missing_textures)?;
    let means = Means::of(&textures);
    for (number, (material, uses)) in materials.iter().zip(&uses).enumerate() {
        scene.materials.push(converted(material, uses, &means, number)?);
    }
    scene.materials.push(Material { name: "default".into(), ..Material::default() });
    scene.textures = keep_referred_to(textures, &mut scene.materials);
    Ok(())
}

fn converted(material: &JsonMaterial, uses: &Uses, means: &Means, number: usize) -> Result<Material, Fault> {
    let element = format!("material {number}");
    let Checked::Valid(alpha_mode) = material.alpha_mode else {
        return Err(Fault::malformed(element, "unknown alphaMode"));
    };
    let Surface { base_color, reflectance, metallic_roughness } = match specular_glossiness::of(material, &element)? {
        Some(json) => Surface::from_specular_glossiness(&json, uses, means, &element)?,
        None => Surface::from_metallic_roughness(material, uses, means, &element)?,
    };
    let [metallic, roughness] = metallic_roughness.mean;
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
        metallic: metallic_roughness.factors[0],
        roughness: metallic_roughness.factors[1],
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

/// What light a surface scatters and reflects.
struct Surface {
    base_color: [f32; 4],
    /// At normal incidence, where the surface is no metal.
    reflectance: Vec3,
    metallic_roughness: MetallicRoughness,
}

impl Surface {
    fn from_metallic_roughness(
        material: &JsonMaterial,
        uses: &Uses,
        means: &Means,
        element: &str,
    ) -> Result<Self, Fault> {
        let factor = material.pbr_metallic_roughness.base_color_factor.0;
        Ok(Self {
            base_color: all_clamped(format_args!("{element}: base colour"), factor, 0.0..=1.0)?,
            reflectance: dielectric_reflectance(material, uses, means, element)?,
            metallic_roughness: MetallicRoughness::of(material, uses, means, element)?,
        })
    }

    fn from_specular_glossiness(
        json: &SpecularGlossiness,
        uses: &Uses,
        means: &Means,
        element: &str,
    ) -> Result<Self, Fault> {
        let diffuse = all_clamped(format_args!("{element}: diffuse colour"), json.diffuse_factor, 0.0..=1.0)?;
        let specular = all_clamped(format_args!("{element}: specular colour"), json.specular_factor, 0.0..=1.0)?;
        let glossiness = clamped(format_args!("{element}: glossiness"), json.glossiness_factor, 0.0..=1.0)?;
        let of_texture = uses.specular_glossiness.map_or(Vec4::ONE, |place| means.linear(place));
        let reflectance = Vec3::from(specular) * of_texture.truncate();
        let roughness = 1.0 - glossiness * of_texture.w;
        // What is reflected is not scattered.
        let scattered = 1.0 - reflectance.max_element();
        let [r, g, b, alpha] = diffuse;
        let factors = [0.0, roughness];
        Ok(Self {
            base_color: [r * scattered, g * scattered, b * scattered, alpha],
            reflectance,
            metallic_roughness: MetallicRoughness { factors, mean: factors },
        })
    }
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
        let Some(place) = uses.place(METALLIC_ROUGHNESS) else {
            return Ok(Self { factors, mean: factors });
        };
        let of_texture = means.linear(place);
        let mean = [metallic * of_texture.z, roughness * of_texture.y];
        let has_texture = uses.texture(METALLIC_ROUGHNESS).is_some();
        Ok(Self { factors: if has_texture { factors } else { mean }, mean })
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
