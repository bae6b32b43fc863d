//! A scene as bytes, for the transfer between nodes. Its layout is little-endian throughout:
//!
//! ```text
//! magic "MYRSCENE" | version u32 | header length u32 | header (postcard)
//! then for each mesh: vertices (40 bytes each), details (24 bytes each), indices (4 bytes each); for each texture: texels;
//! the texels of the environment map (4 bytes each)
//! ```
//!
//! Arrays have their layout in memory, so that packing and unpacking are copies. The header has their lengths, which
//! are checked against the remaining bytes before memory is allocated.

use bytemuck::{Pod, cast_slice};
use depth_image::{EnvironmentMap, MAX_ENVIRONMENT_SIZE_PX};
use glam::UVec2;

use crate::{Fault, Limits, Scene, SceneError, at_most};

#[cfg(target_endian = "big")]
compile_error!("packages hold arrays as they are in memory, which must be little-endian");

const MAGIC: &[u8; 8] = b"MYRSCENE";
const VERSION: u32 = 6;

/// A scene without its large arrays, the lengths of each mesh's vertices, details and indices, and the size of the
/// environment map.
type Header<S> = (S, Vec<[u32; 3]>, Option<UVec2>);

/// Packs a scene. Equal scenes give equal bytes.
#[must_use]
pub fn pack(scene: &Scene) -> Vec<u8> {
    let meshes = scene.meshes.iter();
    let mesh_lengths = meshes.map(|m| [m.vertices.len(), m.details.len(), m.indices.len()].map(|n| n as u32));
    let header: Header<&Scene> =
        (scene, mesh_lengths.collect(), scene.environment_map.as_ref().map(EnvironmentMap::size_px));
    // Writing to a growing vector cannot fail, and postcard supports all fields.
    let header = postcard::to_stdvec(&header).unwrap_or_default();
    let arrays = arrays(scene);
    let mut bytes = Vec::with_capacity(16 + header.len() + arrays.iter().map(|array| array.len()).sum::<usize>());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&header);
    arrays.into_iter().for_each(|array| bytes.extend_from_slice(array));
    bytes
}

/// The large arrays in the order of the package.
fn arrays(scene: &Scene) -> Vec<&[u8]> {
    let meshes = scene
        .meshes
        .iter()
        .flat_map(|mesh| [cast_slice(&mesh.vertices), cast_slice(&mesh.details), cast_slice(&mesh.indices)]);
    let textures = scene.textures.iter().map(|texture| &texture.srgba8[..]);
    let environment = scene.environment_map.iter().map(|map| cast_slice(map.texels_rgb9e5()));
    meshes.chain(textures).chain(environment).collect()
}

/// Unpacks a scene and validates it, since the bytes are untrusted.
///
/// # Errors
/// The part of the package at fault. Memory is bounded by a few times the bytes' length.
pub fn unpack(bytes: &[u8], limits: &Limits) -> Result<Scene, SceneError> {
    let scene = scene_from_bytes(bytes, limits);
    let checked = scene.and_then(|scene| scene.check(limits).map(|()| scene));
    checked.map_err(|fault| fault.in_file("package"))
}

fn scene_from_bytes(bytes: &[u8], limits: &Limits) -> Result<Scene, Fault> {
    at_most("size in bytes", bytes.len() as u64, limits.file_bytes)?;
    let mut reader = Reader { rest: bytes };
    if reader.array::<8>("magic")? != *MAGIC {
        return Err(Fault::malformed("magic", "these bytes are not a scene package"));
    }
    let version = u32::from_le_bytes(reader.array("version")?);
    if version != VERSION {
        return Err(Fault::unsupported("version", format!("package version {version}")));
    }
    let header_bytes = u32::from_le_bytes(reader.array("header length")?);
    let header = match postcard::take_from_bytes(reader.take("header", u64::from(header_bytes))?) {
        Ok((header, [])) => header,
        Ok(_) => return Err(Fault::malformed("header", "it is longer than its contents")),
        Err(e) => return Err(Fault::malformed("header", e.to_string())),
    };
    let scene = read_arrays(header, &mut reader, limits)?;
    if reader.rest.is_empty() { Ok(scene) } else { Err(Fault::malformed("end", "bytes follow the last array")) }
}

fn read_arrays(header: Header<Scene>, reader: &mut Reader, limits: &Limits) -> Result<Scene, Fault> {
    let (mut scene, mesh_lengths, environment_size_px) = header;
    if mesh_lengths.len() != scene.meshes.len() {
        return Err(Fault::malformed("header", "it has lengths for another number of meshes"));
    }
    for (number, (mesh, [vertices, details, indices])) in scene.meshes.iter_mut().zip(mesh_lengths).enumerate() {
        let element = format!("mesh {number}");
        at_most(format!("{element}, vertices"), vertices.into(), limits.vertices)?;
        mesh.vertices = reader.pods(&element, vertices.into())?;
        mesh.details = reader.pods(&element, details.into())?;
        mesh.indices = reader.pods(&element, indices.into())?;
    }
    for (number, texture) in scene.textures.iter_mut().enumerate() {
        let texels = u64::from(texture.width_px) * u64::from(texture.height_px);
        let bytes = texels.saturating_mul(4);
        texture.srgba8 = reader.take(format!("texture {number}"), bytes)?.to_vec();
    }
    scene.environment_map = environment_size_px.map(|size_px| read_environment(size_px, reader)).transpose()?;
    Ok(scene)
}

fn read_environment(size_px: UVec2, reader: &mut Reader) -> Result<EnvironmentMap, Fault> {
    let size_px = size_px.min(MAX_ENVIRONMENT_SIZE_PX + 1);
    let texels = reader.pods("environment map", size_px.element_product().into())?;
    EnvironmentMap::from_texels(size_px, texels).map_err(|e| Fault::malformed("environment map", e.to_string()))
}

struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take(&mut self, element: impl std::fmt::Display, length: u64) -> Result<&'a [u8], Fault> {
        let split = usize::try_from(length).ok().and_then(|length| self.rest.split_at_checked(length));
        let (taken, rest) = split.ok_or_else(|| {
            Fault::malformed(element, format!("it needs {length} bytes where {} are left", self.rest.len()))
        })?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, element: &str) -> Result<[u8; N], Fault> {
        let taken = self.take(element, N as u64)?;
        taken.try_into().map_err(|_| Fault::malformed(element, "it is cut off"))
    }

    fn pods<T: Pod>(&mut self, element: &str, count: u64) -> Result<Vec<T>, Fault> {
        let length = count.saturating_mul(size_of::<T>() as u64);
        Ok(bytemuck::pod_collect_to_vec(self.take(element, length)?))
    }
}
