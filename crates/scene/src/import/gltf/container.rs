//! The parsed JSON and the binary chunk of a file.

use gltf::binary::Glb;
use gltf::json::Root;

use crate::Limits;
use crate::error::{Fault, at_most};

const GLB_MAGIC: &[u8] = b"glTF";
const GLB_HEADER_BYTES: u32 = 12;

pub(super) fn parse<'a>(bytes: &'a [u8], limits: &Limits) -> Result<(Root, Option<&'a [u8]>), Fault> {
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
