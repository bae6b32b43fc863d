//! glTF meshes that are compressed by Draco.

use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, GeometryAttributeType, Mesh, MeshEncoder, PointAttribute, PointIndex,
};

use super::{CUBE_CORNERS, GltfCube, cube, cube_triangles};

/// The cube as a stream. `level` is the level of compression, from 0 (sequential) to 10, or `None` for the encoder's own.
pub fn cube_stream(level: Option<i32>, quantization_bits: i32) -> Vec<u8> {
    let mut mesh = Mesh::new();
    mesh.set_num_points(8);
    let mut attribute = |kind, components: u8, data_type, normalized, bytes: &[u8]| {
        let mut attribute = PointAttribute::new();
        attribute.init(kind, components, data_type, normalized, 8);
        attribute.buffer_mut().write(0, bytes);
        mesh.add_attribute(attribute)
    };
    let positions: Vec<u8> = CUBE_CORNERS.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    let position = attribute(GeometryAttributeType::Position, 3, DataType::Float32, false, &positions);
    let colors: Vec<u8> = (0..8).flat_map(|corner| [corner * 30, 0, 255, 255]).collect();
    attribute(GeometryAttributeType::Color, 4, DataType::Uint8, true, &colors);
    for triangle in cube_triangles().as_chunks::<3>().0 {
        mesh.add_face(triangle.map(PointIndex));
    }
    let mut options = EncoderOptions::new();
    options.set_attribute_quantization(position, quantization_bits);
    if let Some(level) = level {
        options.set_compression_level(level);
    }
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut buffer = EncoderBuffer::new();
    encoder.encode(&options, &mut buffer).unwrap();
    buffer.data().to_vec()
}

/// The cube with positions and colours of a stream.
pub fn draco_cube(stream: &[u8], change: impl FnOnce(&mut GltfCube)) -> GltfCube {
    cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0,"COLOR_0":2},"indices":1,"extensions":
            {"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0,"COLOR_0":1}}}}"#
            .into();
        c.accessors =
            r#"{"componentType":5126,"count":8,"type":"VEC3"},{"componentType":5123,"count":36,"type":"SCALAR"},
            {"componentType":5121,"normalized":true,"count":8,"type":"VEC4"}"#
                .into();
        c.views = format!(r#"{{"buffer":0,"byteLength":{}}}"#, stream.len());
        c.buffers = format!(r#"{{"byteLength":{}}}"#, stream.len());
        let name = r#"["KHR_draco_mesh_compression"]"#;
        c.more = format!(r#""extensionsUsed":{name},"extensionsRequired":{name},"#);
        c.binary = stream.to_vec();
        change(c);
    })
}
