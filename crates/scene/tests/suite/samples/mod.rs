//! Small files of every format for tests.

pub mod compressed;
pub mod draco;
pub mod ktx2;
pub mod skinned;
pub mod warnings;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use scene::{Limits, MissingTextures, Scene, SceneError, load_file};
use tempfile::TempDir;

/// Corners of the cube from -0.5 to 0.5, and its faces as quads that face out.
pub const CUBE_CORNERS: [[f32; 3]; 8] = [
    [-0.5, -0.5, -0.5],
    [0.5, -0.5, -0.5],
    [0.5, 0.5, -0.5],
    [-0.5, 0.5, -0.5],
    [-0.5, -0.5, 0.5],
    [0.5, -0.5, 0.5],
    [0.5, 0.5, 0.5],
    [-0.5, 0.5, 0.5],
];
pub const CUBE_QUADS: [[u32; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [3, 7, 6, 2], [0, 4, 7, 3], [1, 2, 6, 5]];

pub fn cube_triangles() -> Vec<u32> {
    CUBE_QUADS.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, *a, *c, *d]).collect()
}

/// A folder with one scene file in it.
pub struct Sample {
    pub dir: TempDir,
    pub path: PathBuf,
}

impl Sample {
    pub fn new(name: &str, bytes: &[u8]) -> Self {
        warnings::keep_all_callsites();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Self { dir, path }
    }

    pub fn with(self, name: &str, bytes: &[u8]) -> Self {
        std::fs::write(self.dir.path().join(name), bytes).unwrap();
        self
    }

    pub fn load(&self) -> Result<Scene, SceneError> {
        load_file(&self.path, &Limits::default(), MissingTextures::Refuse)
    }
}

pub fn load(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
    Sample::new(name, bytes).load()
}

/// Does work that must end within a second. Programs beside it may stop it for longer: it has three tries.
pub fn within_a_second<T>(mut work: impl FnMut() -> T) -> T {
    let mut done_in_time = || {
        let start = Instant::now();
        let done = work();
        (start.elapsed() < Duration::from_secs(1)).then_some(done)
    };
    (0..3).find_map(|_| done_in_time()).expect("three tries take a second and more")
}

/// The message of the error that loading must give within a second.
pub fn refusal(name: &str, bytes: &[u8]) -> String {
    let message = within_a_second(|| load(name, bytes).expect_err("it must be refused").to_string());
    assert!(message.contains(name), "the file is not named: {message}");
    message
}

/// Triangles in world space, as drawn.
pub fn world_triangles(scene: &Scene) -> Vec<[glam::Vec3; 3]> {
    let mut triangles = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let point = |i: u32| instance.world_from_mesh.transform_point3(mesh.vertices[i as usize].position.into());
        triangles.extend(mesh.indices.chunks_exact(3).map(|t| [point(t[0]), point(t[1]), point(t[2])]));
    }
    triangles
}

/// Volume enclosed: positive where triangles face out.
pub fn signed_volume(scene: &Scene) -> f32 {
    world_triangles(scene).iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum()
}

pub fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let mut bytes = b"glTF".to_vec();
    bytes.extend([2, total as u32, json.len() as u32].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(b"JSON");
    bytes.extend(&json);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(&binary);
    bytes
}

/// The cube's positions (96 bytes) and then its indices (72 bytes).
pub fn cube_buffer() -> Vec<u8> {
    let mut buffer: Vec<u8> = CUBE_CORNERS.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    buffer.extend(cube_triangles().iter().flat_map(|i| (*i as u16).to_le_bytes()));
    buffer
}

/// The parts of a glTF cube, each to be replaced for a test.
#[derive(Clone)]
pub struct GltfCube {
    pub nodes: String,
    pub roots: String,
    pub primitive: String,
    pub accessors: String,
    pub views: String,
    pub buffers: String,
    /// Further members of the root, each followed by a comma.
    pub more: String,
    pub binary: Vec<u8>,
}

impl Default for GltfCube {
    fn default() -> Self {
        Self {
            nodes: r#"{"mesh":0}"#.into(),
            roots: "0".into(),
            primitive: r#"{"attributes":{"POSITION":0},"indices":1}"#.into(),
            accessors: concat!(
                r#"{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"},"#,
                r#"{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}"#
            )
            .into(),
            views: r#"{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":72}"#.into(),
            buffers: r#"{"byteLength":168}"#.into(),
            more: String::new(),
            binary: cube_buffer(),
        }
    }
}

/// A glTF cube with a change.
pub fn cube(change: impl FnOnce(&mut GltfCube)) -> GltfCube {
    let mut cube = GltfCube::default();
    change(&mut cube);
    cube
}

impl GltfCube {
    pub fn json(&self) -> String {
        let Self { nodes, roots, primitive, accessors, views, buffers, more, .. } = self;
        format!(
            r#"{{"asset":{{"version":"2.0"}},{more}"scene":0,"scenes":[{{"nodes":[{roots}]}}],"nodes":[{nodes}],
            "meshes":[{{"primitives":[{primitive}]}}],"accessors":[{accessors}],"bufferViews":[{views}],"buffers":[{buffers}]}}"#
        )
    }

    pub fn glb(&self) -> Vec<u8> {
        glb(&self.json(), &self.binary)
    }
}

pub fn cube_obj() -> String {
    let vertices = CUBE_CORNERS.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = CUBE_QUADS.iter().map(|q| format!("f {} {} {} {}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1));
    vertices.chain(faces).collect()
}

pub fn ply_header(format: &str, vertices: usize, faces: usize) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment cube\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

pub fn cube_ply_ascii() -> Vec<u8> {
    let mut text = ply_header("ascii", 8, 6);
    CUBE_CORNERS.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z} 10 20 30\n"));
    CUBE_QUADS.iter().for_each(|[a, b, c, d]| text += &format!("4 {a} {b} {c} {d}\n"));
    text.trim_end().to_owned().into_bytes()
}

pub fn cube_ply_binary(is_big_endian: bool) -> Vec<u8> {
    let order = |bytes: [u8; 4]| {
        if is_big_endian { [bytes[3], bytes[2], bytes[1], bytes[0]] } else { bytes }
    };
    let mut bytes =
        ply_header(if is_big_endian { "binary_big_endian" } else { "binary_little_endian" }, 8, 6).into_bytes();
    for corner in CUBE_CORNERS {
        corner.iter().for_each(|c| bytes.extend(order(c.to_le_bytes())));
        bytes.extend([10, 20, 30]);
    }
    for quad in CUBE_QUADS {
        bytes.push(4);
        quad.iter().for_each(|i| bytes.extend(order(i.to_le_bytes())));
    }
    bytes
}
