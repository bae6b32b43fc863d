//! glTF 2.0 and GLB.
//!
//! The JSON is parsed by the `gltf` crate; every index, range and type is then checked here, where it is
//! used. The crate's own validation and readers are not called: both index without checking
//! (`primitive_validate_hook`, `accessor::Iter`), which a malformed file turns into a panic.
//!
//! `docs/formats.md` lists what is read, what is not, and what happens then. Nodes that an animation moves and skins become the
//! scene's animation, whose first clip plays. Lamps and cameras stay at rest, and so do morph targets, with their default
//! weights and a warning.
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
mod draco;
mod extensions;
mod json;
mod lights;
mod materials;
mod meshes;
mod nodes;
mod primitives;
mod specular_glossiness;
mod texture_coordinates;
mod textures;

use std::borrow::Cow;

use gltf::binary::Glb;

use super::{Import, SourceScene};
use crate::{Fault, at_most};
use document::Document;
use json::parsed;

const GLB_MAGIC: &[u8] = b"glTF";
const GLB_HEADER_BYTES: u32 = 12;

pub(super) fn read(bytes: &[u8], import: &Import) -> Result<SourceScene, Fault> {
    let (json, binary_chunk) = if bytes.starts_with(GLB_MAGIC) { split(bytes)? } else { (bytes, None) };
    let root = json::parse(json, import.limits, &import.warnings)?;
    extensions::check(&root, import)?;
    at_most("nodes", root.nodes.len() as u64, import.limits.nodes)?;
    at_most("meshes", root.meshes.len() as u64, import.limits.nodes)?;
    at_most("materials", root.materials.len() as u64, import.limits.attributes)?;
    at_most("images", root.images.len() as u64, import.limits.attributes)?;
    let document = Document::open(&root, binary_chunk, import)?;
    let mut scene = SourceScene::default();
    let coordinates = materials::read(&document, &mut scene)?;
    let meshes = meshes::read(&document, &coordinates, &mut scene)?;
    let tree = nodes::read(&document, &meshes, &mut scene)?;
    animation::read(&document, &tree, &mut scene)?;
    if scene.instances.is_empty() {
        let number = json::chosen_scene(&root).map_or(0, |scene| scene.value());
        return Err(Fault::malformed("scene", format!("it has no triangles in scene {number}")));
    }
    if !lights::read_extension(&root, &mut scene)? {
        lights::expose(&mut scene);
    }
    Ok(scene)
}

fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    let length = bytes.get(8..12).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    if length < GLB_HEADER_BYTES {
        // The crate subtracts the header's size unchecked.
        return Err(Fault::malformed("GLB header", "the length is smaller than the header"));
    }
    if bytes.get(4..8) == Some(&1_u32.to_le_bytes()[..]) {
        return Err(json::other_version("1.0"));
    }
    let glb = Glb::from_slice(bytes).map_err(|e| Fault::malformed("GLB header", e.to_string()))?;
    let json = borrowed(glb.json).ok_or_else(|| Fault::malformed("GLB", "no JSON chunk"))?;
    Ok((json, glb.bin.and_then(borrowed)))
}

/// A chunk of a file that was read from a slice: the crate then gives the borrowed form alone.
fn borrowed(chunk: Cow<'_, [u8]>) -> Option<&[u8]> {
    match chunk {
        Cow::Borrowed(slice) => Some(slice),
        Cow::Owned(_) => None,
    }
}
