//! glTF 2.0 and GLB.
//!
//! The JSON is parsed by the `gltf` crate; every index, range and type is then checked here, where it is
//! used. The crate's own validation and readers are not called: both index without checking
//! (`primitive_validate_hook`, `accessor::Iter`), which a malformed file turns into a panic.
//!
//! `docs/formats.md` lists what is read, what is not, and what happens then. Nodes that an animation moves and skins become the
//! scene's animation, whose first clip plays. Lamps and cameras stay at rest, and so do morph targets, with a warning.
//!
//! Factors of materials are clamped to their range. A factor that is not finite is refused, as is an invalid light.
//!
//! Lights have no extent, as in the file; their `range`, a hint for culling, is not read. Their intensities are lux and
//! candela, for a camera's exposure that a file lacks: sunlight of 100,000 lux and a sun of strength 3 both occur. The
//! importer therefore sums the unoccluded light of all lamps at the middle of the bounds, with spots aimed there. Where
//! the sum is within two stops of white, lights stay unchanged. Otherwise one factor makes the sum white, which keeps
//! the lights' ratios. Emissive surfaces are not exposed: in files they are relative to white already.

mod animation;
mod channels;
mod compressed;
mod document;
mod lights;
mod materials;
mod nodes;
mod primitives;
mod skins;
mod texture_coordinates;

use gltf::binary::Glb;
use gltf::json::Root;

use super::folder::Folder;
use super::source_scene::{SourceMesh, SourceScene};
use crate::Limits;
use crate::error::{Fault, at_most};
use document::Document;
use texture_coordinates::Coordinates;

/// Extensions that a file may require.
const SUPPORTED_EXTENSIONS: [&str; 10] = [
    compressed::NAMES[0],
    compressed::NAMES[1],
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Extensions that a file may be freed of, each with the command line that does it.
const CONVERSIONS: [(&str, &str); 2] = [
    // Writing drops the compression unless it is asked for.
    ("KHR_draco_mesh_compression", "npx @gltf-transform/cli copy IN OUT"),
    ("KHR_texture_basisu", "npx @gltf-transform/cli ktxdecompress IN OUT"),
];

const GLB_MAGIC: &[u8] = b"glTF";
const GLB_HEADER_BYTES: u32 = 12;

pub(super) fn read(bytes: &[u8], folder: &Folder, limits: &Limits) -> Result<SourceScene, Fault> {
    let (root, binary_chunk) = parsed(bytes, limits)?;
    refuse_unknown_requirements(&root)?;
    check_counts(&root, limits)?;
    let document = Document::open(&root, binary_chunk, folder, limits)?;
    let mut scene = SourceScene::default();
    materials::read(&document, &mut scene)?;
    read_meshes(&document, &mut scene)?;
    let tree = nodes::read(&root, limits, &mut scene)?;
    animation::read(&document, &tree, &mut scene)?;
    lights::expose(&mut scene);
    Ok(scene)
}

/// The JSON and the binary chunk of a file.
fn parsed<'a>(bytes: &'a [u8], limits: &Limits) -> Result<(Root, Option<&'a [u8]>), Fault> {
    let (json, binary_chunk) = if bytes.starts_with(GLB_MAGIC) { split(bytes)? } else { (bytes, None) };
    // Each object of the JSON, even `{}`, becomes a struct of some hundred bytes.
    let objects = json.iter().filter(|&&b| b == b'{').count();
    at_most("JSON objects", objects as u64, limits.json_objects)?;
    let root = Root::from_slice(json).map_err(|e| Fault::malformed("JSON", e.to_string()))?;
    if !root.asset.version.starts_with("2.") {
        return Err(Fault::unsupported("asset", format!("glTF version {}", root.asset.version)));
    }
    Ok((root, binary_chunk))
}

fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    let length = bytes.get(8..12).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    if length < GLB_HEADER_BYTES {
        // The crate subtracts the header's size unchecked.
        return Err(Fault::malformed("GLB header", "the length is smaller than the header"));
    }
    let glb = Glb::from_slice(bytes).map_err(|e| Fault::malformed("GLB header", e.to_string()))?;
    // A slice only gives the borrowed form; an owned one would not outlive this function.
    let borrowed = |chunk| match chunk {
        std::borrow::Cow::Borrowed(slice) => Some(slice),
        std::borrow::Cow::Owned(_) => None,
    };
    let json = borrowed(glb.json).ok_or_else(|| Fault::malformed("GLB", "no JSON chunk"))?;
    Ok((json, glb.bin.and_then(borrowed)))
}

fn refuse_unknown_requirements(root: &Root) -> Result<(), Fault> {
    let unknown = root.extensions_required.iter().find(|name| !SUPPORTED_EXTENSIONS.contains(&name.as_str()));
    let Some(name) = unknown else { return Ok(()) };
    let conversion = CONVERSIONS.iter().find(|(extension, _)| extension == name);
    let advice = conversion.map_or_else(String::new, |(_, command)| format!("; convert the file with `{command}`"));
    Err(Fault::unsupported("extensionsRequired", format!("{name}{advice}")))
}

fn check_counts(root: &Root, limits: &Limits) -> Result<(), Fault> {
    at_most("nodes", root.nodes.len() as u64, limits.nodes)?;
    at_most("meshes", root.meshes.len() as u64, limits.nodes)?;
    at_most("materials", root.materials.len() as u64, limits.attributes)?;
    at_most("images", root.images.len() as u64, limits.attributes)
}

/// Mesh `i` of the file becomes mesh `i` of the scene; a mesh of lines alone stays empty.
fn read_meshes(document: &Document, scene: &mut SourceScene) -> Result<(), Fault> {
    for (number, mesh) in document.root.meshes.iter().enumerate() {
        let mut merged = SourceMesh::default();
        for (part, primitive) in mesh.primitives.iter().enumerate() {
            let element = format!("mesh {number}, primitive {part}");
            let coordinates = Coordinates::of_material(document.root, primitive.material)?;
            let material = materials::material_number(document.root, primitive.material, &element)?;
            if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
                tracing::warn!("{element}: its morph targets are shown at rest");
            }
            if let Some(geometry) = primitives::read(document, primitive, &coordinates, &element)? {
                merged.append_part(geometry, material);
            }
        }
        scene.meshes.push(merged);
    }
    Ok(())
}
