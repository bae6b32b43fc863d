//! `MYRIORAMA_scene`, an extension of a glTF scene for what glTF has no words for: lamps with a size, light from all around, the
//! background, and Phong's highlights. `myriorama-lab scene` writes it. Its lamps take the place of those of nodes.

use gltf::json::Root;
use serde::Deserialize;

use super::super::source_scene::{SourceLight, SourceScene};
use super::json::parsed;
use super::nodes::chosen_scene;
use crate::error::Fault;
use crate::light_rig::position_mut;
use crate::{Environment, Illumination};

pub(super) const NAME: &str = "MYRIORAMA_scene";

#[derive(Deserialize)]
struct SceneExtension {
    illumination: Illumination,
    background: Environment,
    /// Strength and exponent of each of the file's materials.
    phong: Vec<[f32; 2]>,
}

/// Returns whether the scene has the extension.
pub(super) fn read(root: &Root, scene: &mut SourceScene) -> Result<bool, Fault> {
    let json = chosen_scene(root).and_then(|number| root.get(number));
    let extensions = json.and_then(|json| json.extensions.as_ref());
    let Some(value) = extensions.and_then(|extensions| extensions.others.get(NAME)) else { return Ok(false) };
    let extension: SceneExtension = parsed(value, NAME)?;
    if extension.phong.len() != root.materials.len() {
        let reason = format!("phong is that of {} materials, of {}", extension.phong.len(), root.materials.len());
        return Err(Fault::malformed(NAME, reason));
    }
    scene.lights.clear();
    for mut light in extension.illumination.lights {
        let position_in_source = position_mut(&mut light).map_or_else(Default::default, |p| p.as_dvec3());
        scene.lights.push(SourceLight { light, position_in_source });
    }
    scene.environment = extension.illumination.environment;
    scene.background = Some(extension.background);
    for (material, [strength, exponent]) in scene.materials.iter_mut().zip(extension.phong) {
        material.phong_specular = strength;
        material.phong_exponent = exponent;
    }
    Ok(true)
}
