//! Extensions: those that are read, and those without which a scene can be shown all the same.

use std::collections::BTreeSet;

use gltf::json::Root;

use super::super::Import;
use super::{compressed, draco, lights};
use crate::Fault;

/// Extensions that are read. Textures in AVIF and DDS have a warning of their own where a file has them in no other format.
const READ: [&str; 20] = [
    compressed::NAMES[0],
    compressed::NAMES[1],
    draco::NAME,
    "EXT_mesh_gpu_instancing",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "MSFT_texture_dds",
    lights::SCENE_EXTENSION,
];

/// Beginnings of the names of extensions that leave all geometry in place: materials, textures, lights, motion, sound,
/// interaction, and data about the scene. A file may require them.
const WITHOUT_GEOMETRY: [&str; 34] = [
    "ADOBE_materials_",
    "AGI_stk_metadata",
    "CESIUM_primitive_outline",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_lights_",
    "EXT_materials_",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_structural_metadata",
    "EXT_texture_",
    "FB_geometry_metadata",
    "FB_ngon_encoding",
    "GODOT_",
    "KHR_animation_pointer",
    "KHR_audio",
    "KHR_interactivity",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_physics_",
    "KHR_techniques_webgl",
    "KHR_texture_",
    "KHR_xmp",
    "MOZ_lightmap",
    "MPEG_texture_",
    "MSFT_audio_emitter",
    "MSFT_lod",
    "MSFT_packing_",
    "NV_materials_",
    "OMI_",
    "SHAPEWAYS_materials_",
    "VRM",
];

/// Refuses a file that requires an extension that may change geometry, unless the options say to ignore it. Those that
/// the file uses and that are not read become one warning.
pub(super) fn check(root: &Root, import: &Import) -> Result<(), Fault> {
    let refused = root.extensions_required.iter().filter(is_unread).find(|name| {
        let is_ignored = import.options.ignore_required.contains(name);
        !is_ignored && !WITHOUT_GEOMETRY.iter().any(|start| name.starts_with(start))
    });
    if let Some(name) = refused {
        let advice = format!("{name}; `--ignore-required {name}` shows the scene without it");
        return Err(Fault::unsupported("extensionsRequired", advice));
    }
    let named = root.extensions_used.iter().chain(&root.extensions_required);
    let unread: BTreeSet<&str> = named.filter(is_unread).map(String::as_str).collect();
    for name in unread {
        import.warnings.list("extensions that are not read", name);
    }
    Ok(())
}

fn is_unread(name: &&String) -> bool {
    !READ.contains(&name.as_str())
}
