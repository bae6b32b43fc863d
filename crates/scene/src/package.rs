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

use bytemuck::Pod;
use depth_image::{Environment, EnvironmentMap, Illumination, MAX_ENVIRONMENT_SIZE_PX, SourceSpace};
use glam::UVec2;
use serde::{Deserialize, Serialize};

use crate::error::{Fault, at_most};
use crate::{Animation, Instance, Limits, Material, Mesh, MeshPart, Scene, SceneError, SourceCamera, Texture, Wind};

#[cfg(target_endian = "big")]
compile_error!("packages hold arrays as they are in memory, which must be little-endian");

const MAGIC: &[u8; 8] = b"MYRSCENE";
const VERSION: u32 = 4;

/// A scene without its large arrays.
#[derive(Serialize, Deserialize)]
struct Header {
    name: String,
    meshes: Vec<MeshHeader>,
    instances: Vec<Instance>,
    materials: Vec<Material>,
    textures: Vec<TextureHeader>,
    illumination: Illumination,
    environment_size_px: Option<UVec2>,
    background: Environment,
    cameras: Vec<SourceCamera>,
    wind: Option<Wind>,
    animation: Option<Animation>,
    source_space: SourceSpace,
}

#[derive(Serialize, Deserialize)]
struct MeshHeader {
    vertex_count: u32,
    detail_count: u32,
    index_count: u32,
    parts: Vec<MeshPart>,
}

#[derive(Serialize, Deserialize)]
struct TextureHeader {
    width_px: u32,
    height_px: u32,
    is_srgb: bool,
}

/// Packs a scene. Equal scenes give equal bytes.
#[must_use]
pub fn pack(scene: &Scene) -> Vec<u8> {
    // Writing to a growing vector cannot fail, and postcard supports all fields.
    let header = postcard::to_stdvec(&header_of(scene)).unwrap_or_default();
    let mut bytes = Vec::with_capacity(16 + header.len() + array_bytes(scene));
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&header);
    for mesh in &scene.meshes {
        bytes.extend_from_slice(bytemuck::cast_slice(&mesh.vertices));
        bytes.extend_from_slice(bytemuck::cast_slice(&mesh.details));
        bytes.extend_from_slice(bytemuck::cast_slice(&mesh.indices));
    }
    scene.textures.iter().for_each(|texture| bytes.extend_from_slice(&texture.srgba8));
    scene.environment_map.iter().for_each(|map| bytes.extend_from_slice(bytemuck::cast_slice(map.texels_rgb9e5())));
    bytes
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
    let header = read_header(reader.take("header", u64::from(header_bytes))?)?;
    let scene = scene_from_header(header, &mut reader, limits)?;
    if reader.rest.is_empty() { Ok(scene) } else { Err(Fault::malformed("end", "bytes follow the last array")) }
}

fn header_of(scene: &Scene) -> Header {
    let mesh = |m: &Mesh| MeshHeader {
        vertex_count: m.vertices.len() as u32,
        detail_count: m.details.len() as u32,
        index_count: m.indices.len() as u32,
        parts: m.parts.clone(),
    };
    let texture = |t: &Texture| TextureHeader { width_px: t.width_px, height_px: t.height_px, is_srgb: t.is_srgb };
    Header {
        name: scene.name.clone(),
        meshes: scene.meshes.iter().map(mesh).collect(),
        instances: scene.instances.clone(),
        materials: scene.materials.clone(),
        textures: scene.textures.iter().map(texture).collect(),
        illumination: scene.illumination.clone(),
        environment_size_px: scene.environment_map.as_ref().map(EnvironmentMap::size_px),
        background: scene.background,
        cameras: scene.cameras.clone(),
        wind: scene.wind,
        animation: scene.animation.clone(),
        source_space: scene.source_space,
    }
}

fn array_bytes(scene: &Scene) -> usize {
    let mesh = |m: &Mesh| {
        size_of_val(m.vertices.as_slice()) + size_of_val(m.details.as_slice()) + size_of_val(m.indices.as_slice())
    };
    let environment = scene.environment_map.as_ref().map_or(0, |map| size_of_val(map.texels_rgb9e5()));
    let textures = scene.textures.iter().map(|t| t.srgba8.len()).sum::<usize>();
    scene.meshes.iter().map(mesh).sum::<usize>() + textures + environment
}

fn read_header(bytes: &[u8]) -> Result<Header, Fault> {
    match postcard::take_from_bytes(bytes) {
        Ok((header, [])) => Ok(header),
        Ok(_) => Err(Fault::malformed("header", "it is longer than its contents")),
        Err(e) => Err(Fault::malformed("header", e.to_string())),
    }
}

fn scene_from_header(header: Header, reader: &mut Reader, limits: &Limits) -> Result<Scene, Fault> {
    let mut meshes = Vec::new();
    for (number, mesh) in header.meshes.into_iter().enumerate() {
        let element = format!("mesh {number}");
        at_most(format!("{element}, vertices"), mesh.vertex_count.into(), limits.vertices)?;
        let vertices = reader.pods(&element, mesh.vertex_count.into())?;
        let details = reader.pods(&element, mesh.detail_count.into())?;
        let indices = reader.pods(&element, mesh.index_count.into())?;
        meshes.push(Mesh { vertices, details, indices, parts: mesh.parts });
    }
    let mut textures = Vec::new();
    for (number, TextureHeader { width_px, height_px, is_srgb }) in header.textures.into_iter().enumerate() {
        let bytes = u64::from(width_px) * u64::from(height_px) * 4;
        let srgba8 = reader.take(format!("texture {number}"), bytes)?.to_vec();
        textures.push(Texture { width_px, height_px, is_srgb, srgba8 });
    }
    let environment_map = header.environment_size_px.map(|size_px| read_environment(size_px, reader)).transpose()?;
    Ok(Scene {
        name: header.name,
        meshes,
        instances: header.instances,
        materials: header.materials,
        textures,
        illumination: header.illumination,
        environment_map,
        background: header.background,
        cameras: header.cameras,
        wind: header.wind,
        animation: header.animation,
        source_space: header.source_space,
    })
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
