//! A skinned tube along the x axis, written as glTF, with parts to be replaced for a test.

use std::f32::consts::TAU;

use super::glb;

/// The JSON of a file whose accessors and buffer views grow with its data.
#[derive(Clone, Default)]
pub struct Tube {
    pub binary: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
    pub nodes: String,
    pub roots: String,
    pub attributes: String,
    pub skins: String,
    pub animations: String,
}

/// Component types of glTF.
const U8: u32 = 5121;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// Node, path, interpolation, times and values.
pub type ChannelOf<'a> = (u32, &'a str, &'a str, &'a [f32], &'a [f32]);

impl Tube {
    /// `joints` in a chain from x = 0 on, a metre apart; `rings` of `sides` corners around each metre and at the end.
    /// Node 0 holds the mesh, and nodes 1… are the joints. There are no animations yet.
    pub fn new(joints: u32, rings: u32, sides: u32) -> Self {
        let mut tube = Self::default();
        let ring_count = joints * rings + 1;
        let mut positions = vec![];
        let mut normals = vec![];
        let mut numbers = vec![];
        let mut weights = vec![];
        for (ring, side) in (0..ring_count).flat_map(|ring| (0..sides).map(move |side| (ring, side))) {
            let (sin, cos) = f32::sin_cos(TAU * side as f32 / sides as f32);
            let x = ring as f32 / rings as f32;
            positions.extend([x, cos * 0.2, sin * 0.2]);
            normals.extend([0.0, cos, sin]);
            // The last quarter of each metre blends into the next joint.
            let joint = (x.floor() as u32).min(joints - 1);
            let next = (joint + 1).min(joints - 1);
            let blend = if next > joint { ((x - joint as f32 - 0.75) * 4.0).clamp(0.0, 1.0) } else { 0.0 };
            numbers.extend([joint as u8, if blend > 0.0 { next as u8 } else { 0 }, 0, 0]);
            weights.extend([1.0 - blend, blend, 0.0, 0.0]);
        }
        let quads = (1..ring_count).flat_map(|ring| (0..sides).map(move |side| (ring, side)));
        let triangles = quads.flat_map(|(ring, side)| {
            let near = (ring - 1) * sides;
            let far = ring * sides;
            let next = (side + 1) % sides;
            [near + side, near + next, far + next, near + side, far + next, far + side]
        });
        let indices: Vec<u8> = triangles.flat_map(u32::to_le_bytes).collect();
        let vertices = (ring_count * sides) as usize;
        let attributes = [
            ("POSITION", tube.floats(&positions, "VEC3")),
            ("NORMAL", tube.floats(&normals, "VEC3")),
            ("JOINTS_0", tube.add(&numbers, U8, vertices, "VEC4")),
            ("WEIGHTS_0", tube.floats(&weights, "VEC4")),
        ];
        let attributes = attributes.map(|(name, accessor)| format!(r#""{name}":{accessor}"#)).join(",");
        let index = tube.add(&indices, U32, indices.len() / 4, "SCALAR");
        tube.attributes = format!(r#""attributes":{{{attributes}}},"indices":{index}"#);
        let bind = (0..joints).flat_map(|joint| {
            let mut matrix = glam::Mat4::IDENTITY;
            matrix.w_axis.x = -(joint as f32);
            matrix.to_cols_array()
        });
        let bind = tube.floats(&bind.collect::<Vec<_>>(), "MAT4");
        let numbers: Vec<String> = (1..=joints).map(|joint| joint.to_string()).collect();
        tube.skins = format!(r#"{{"inverseBindMatrices":{bind},"joints":[{}]}}"#, numbers.join(","));
        let bone = |joint: u32| {
            let child = if joint < joints { format!(r#","children":[{}]"#, joint + 1) } else { String::new() };
            format!(r#",{{"translation":[{},0,0]{child}}}"#, if joint == 1 { 0 } else { 1 })
        };
        tube.nodes = format!(r#"{{"mesh":0,"skin":0}}{}"#, (1..=joints).map(bone).collect::<String>());
        tube.roots = "0,1".into();
        tube
    }

    /// Two joints, of which the second turns by 90° about z from 0 s to 1 s, and back until 3 s.
    pub fn bending() -> Self {
        let mut tube = Self::new(2, 4, 6);
        let (sin, cos) = std::f32::consts::FRAC_PI_4.sin_cos();
        tube.animate(
            "bend",
            &[(2, "rotation", "LINEAR", &[0., 1., 3.], &[0., 0., 0., 1., 0., 0., sin, cos, 0., 0., 0., 1.])],
        );
        tube
    }

    /// Adds a clip.
    pub fn animate(&mut self, name: &str, channels: &[ChannelOf<'_>]) {
        let mut targets = Vec::new();
        let mut samplers = Vec::new();
        for (number, (node, path, curve, times_s, values)) in channels.iter().enumerate() {
            let input = self.floats(times_s, "SCALAR");
            let output = self.floats(values, if *path == "rotation" { "VEC4" } else { "VEC3" });
            targets.push(format!(r#"{{"sampler":{number},"target":{{"node":{node},"path":"{path}"}}}}"#));
            samplers.push(format!(r#"{{"input":{input},"output":{output},"interpolation":"{curve}"}}"#));
        }
        let comma = if self.animations.is_empty() { "" } else { "," };
        let targets = targets.join(",");
        let samplers = samplers.join(",");
        self.animations += &format!(r#"{comma}{{"name":"{name}","channels":[{targets}],"samplers":[{samplers}]}}"#);
    }

    pub fn floats(&mut self, values: &[f32], shape: &str) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.add(&bytes, F32, values.len() / width, shape)
    }

    pub fn shorts(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.add(&bytes, U16, values.len() / 4, "VEC4")
    }

    fn add(&mut self, bytes: &[u8], component: u32, count: usize, shape: &str) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let number = self.views.len();
        let offset = self.binary.len();
        let length = bytes.len();
        self.views.push(format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}}}"#));
        self.accessors
            .push(format!(r#"{{"bufferView":{number},"componentType":{component},"count":{count},"type":"{shape}"}}"#));
        self.binary.extend(bytes);
        number
    }

    /// Replaces an attribute's accessor.
    pub fn set_attribute(&mut self, name: &str, accessor: usize) {
        let start = self.attributes.find(name).unwrap() + name.len() + 2;
        let end = start + self.attributes[start..].find([',', '}']).unwrap();
        self.attributes.replace_range(start..end, &accessor.to_string());
    }

    pub fn json(&self) -> String {
        let Self { nodes, roots, attributes, skins, animations, .. } = self;
        let views = self.views.join(",");
        let accessors = self.accessors.join(",");
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{roots}]}}],"nodes":[{nodes}],
            "skins":[{skins}],"animations":[{animations}],"meshes":[{{"primitives":[{{{attributes}}}]}}],
            "accessors":[{accessors}],"bufferViews":[{views}],"buffers":[{{"byteLength":{}}}]}}"#,
            self.binary.len()
        )
    }

    pub fn glb(&self) -> Vec<u8> {
        glb(&self.json(), &self.binary)
    }
}
