//! Limits on the size of a scene.

/// Coordinates beyond this are refused: products of four edge lengths must stay finite in `f32`.
pub const MAX_COORDINATE_M: f32 = 1e9;

/// Bounds that are checked before memory is allocated. The defaults admit a scene of several gigabytes; a service for
/// untrusted scenes needs lower bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of a scene's file with all files that it refers to, and of a package.
    pub file_bytes: u64,
    /// Triangles, those of a mesh counted once for each of its instances.
    pub triangles: u64,
    /// Vertices of all meshes.
    pub vertices: u64,
    /// Columns and rows of a texture.
    pub texture_side_px: u32,
    /// Bytes of all decoded textures together.
    pub texture_bytes: u64,
    /// Nodes of a glTF scene; joints of all its skinned meshes.
    pub nodes: u64,
    /// Nodes between a glTF scene and a mesh.
    pub node_depth: u32,
    /// Placements of meshes.
    pub instances: u64,
    /// JSON objects of a glTF file: the parsed form is some hundred times larger than `{}`.
    pub json_objects: u64,
    /// Materials and cameras, each.
    pub attributes: u64,
    /// Keys of all channels of all clips.
    pub keys: u64,
    /// Light sources. Each has a byte of visibility in every sample.
    pub lights: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file_bytes: 2 << 30,
            triangles: 64_000_000,
            vertices: 64_000_000,
            texture_side_px: 16_384,
            texture_bytes: 2 << 30,
            nodes: 200_000,
            node_depth: 10_000,
            instances: 200_000,
            json_objects: 2_000_000,
            attributes: 65_536,
            keys: 16_000_000,
            lights: 255,
        }
    }
}
