//! glTF cubes whose buffer views are compressed by meshoptimizer.

use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    ExpMode, IndexEncoding, VertexEncoding, encode_filter_exp, encode_filter_oct, encode_filter_quat,
    encode_index_buffer, encode_index_sequence, encode_vertex_buffer,
};

use super::{CUBE_CORNERS, GltfCube, cube, cube_triangles};

/// A stream with the JSON members that describe it.
pub struct Stream {
    pub bytes: Vec<u8>,
    pub count: usize,
    pub stride: usize,
    pub mode: &'static str,
    pub filter: &'static str,
}

impl Stream {
    /// Attributes in this version of the format.
    pub fn attributes(version: u8, decoded: &[u8], stride: usize, filter: &'static str) -> Self {
        let count = decoded.len() / stride;
        let encoding = VertexEncoding::new(version, 2).unwrap();
        let bytes = encode_vertex_buffer(decoded, count, stride, encoding, &mut Workspace::default()).unwrap();
        Self { bytes, count, stride, mode: "ATTRIBUTES", filter }
    }

    pub fn indices(indices: &[u32], stride: usize, mode: &'static str) -> Self {
        let encode = if mode == "TRIANGLES" { encode_index_buffer } else { encode_index_sequence };
        let bytes = encode(indices, IndexEncoding::DEFAULT, &mut Workspace::default()).unwrap();
        Self { bytes, count: indices.len(), stride, mode, filter: "NONE" }
    }
}

/// The cube's positions as they are, and by the exponential filter, exact with this many bits.
pub fn positions(version: u8, filter: &'static str) -> Stream {
    let floats: Vec<f32> = CUBE_CORNERS.iter().flatten().copied().collect();
    let decoded: Vec<u8> = match filter {
        "EXPONENTIAL" => encode_filter_exp(8, 12, 15, &floats, ExpMode::Separate, &mut Workspace::default()).unwrap(),
        _ => floats.iter().flat_map(|c| c.to_le_bytes()).collect(),
    };
    Stream::attributes(version, &decoded, 12, filter)
}

/// Unit vectors from the middle of the cube to its corners.
pub fn diagonals(stride: usize) -> Stream {
    let unit = |corner: &[f32; 3]| glam::Vec3::from(*corner).normalize_or(glam::Vec3::X).extend(0.0).to_array();
    let floats: Vec<f32> = CUBE_CORNERS.iter().flat_map(unit).collect();
    let bits = if stride == 4 { 8 } else { 16 };
    let decoded = encode_filter_oct(8, stride, bits, &floats, &mut Workspace::default()).unwrap();
    Stream::attributes(0, &decoded, stride, "OCTAHEDRAL")
}

/// The same quaternion eight times.
pub fn quaternions(quaternion: [f32; 4]) -> Stream {
    let decoded = encode_filter_quat(8, 8, 16, &quaternion.repeat(8), &mut Workspace::default()).unwrap();
    Stream::attributes(0, &decoded, 8, "QUATERNION")
}

/// The cube of positions and indices, whose views lie in a fallback buffer without data. Further streams become views 2
/// and on.
pub fn compressed_cube(extension: &str, streams: &[Stream]) -> GltfCube {
    let mut views = Vec::new();
    let mut binary = Vec::new();
    let mut decoded_bytes = 0;
    for Stream { bytes, count, stride, mode, filter } in streams {
        let length = count * stride;
        let of_attributes = if *mode == "ATTRIBUTES" { format!(r#""byteStride":{stride},"#) } else { String::new() };
        views.push(format!(
            r#"{{"buffer":1,"byteOffset":{decoded_bytes},"byteLength":{length},{of_attributes}"extensions":{{"{extension}":
            {{"buffer":0,"byteOffset":{},"byteLength":{},"byteStride":{stride},"count":{count},"mode":"{mode}","filter":"{filter}"}}}}}}"#,
            binary.len(),
            bytes.len(),
        ));
        binary.extend(bytes);
        decoded_bytes += length;
    }
    let index_type = if streams[1].stride == 2 { 5123 } else { 5125 };
    cube(|c| {
        c.accessors = c.accessors.replace("5123", &index_type.to_string());
        c.more = format!(r#""extensionsUsed":["{extension}"],"extensionsRequired":["{extension}"],"#);
        c.views = views.join(",");
        c.buffers = format!(
            r#"{{"byteLength":{}}},{{"byteLength":{decoded_bytes},"extensions":{{"{extension}":{{"fallback":true}}}}}}"#,
            binary.len()
        );
        c.binary = binary;
    })
}

/// A cube of every mode.
pub fn plain_streams() -> Vec<Stream> {
    vec![positions(0, "NONE"), Stream::indices(&cube_triangles(), 2, "TRIANGLES")]
}
