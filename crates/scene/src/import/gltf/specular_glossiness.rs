//! `KHR_materials_pbrSpecularGlossiness`.

use gltf::json::material::Material as JsonMaterial;
use gltf::json::texture::Info;
use serde::Deserialize;

use super::parsed;
use crate::Fault;

/// The JSON of `KHR_materials_pbrSpecularGlossiness`, the older description of a surface. Factors that are not there are 1.
///
/// A surface without metal has the same two parts in both descriptions: a diffuse colour, and a reflectance at normal
/// incidence of any colour. The texture of specular colour and glossiness counts by its mean.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct SpecularGlossiness {
    pub diffuse_factor: Option<[f32; 4]>,
    pub diffuse_texture: Option<Info>,
    pub specular_factor: Option<[f32; 3]>,
    pub glossiness_factor: Option<f32>,
    pub specular_glossiness_texture: Option<Info>,
}

impl SpecularGlossiness {
    /// The description of a material; `None` where it has none, or has the newer one with a texture of its own.
    pub(super) fn of(material: &JsonMaterial, element: &str) -> Result<Option<Self>, Fault> {
        const NAME: &str = "KHR_materials_pbrSpecularGlossiness";
        let extension = material.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
        let has_newer = material.pbr_metallic_roughness.metallic_roughness_texture.is_some();
        let Some(extension) = extension.filter(|_| !has_newer) else { return Ok(None) };
        parsed(extension, format_args!("{element}: {NAME}")).map(Some)
    }
}
