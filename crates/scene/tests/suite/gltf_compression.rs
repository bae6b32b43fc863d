//! `EXT_meshopt_compression`: compressed views are those of their plain form, and invalid ones are refused.

use glam::Vec3;
use scene::{Limits, MissingTextures, SceneErrorKind, load_file};

use crate::samples::compressed::{Stream, compressed_cube, diagonals, plain_streams, positions, quaternions};
use crate::samples::{CUBE_CORNERS, GltfCube, Sample, cube_triangles, load, refusal, world_triangles};

const EXT: &str = "EXT_meshopt_compression";

#[test]
fn a_compressed_cube_is_the_plain_cube() {
    let plain = world_triangles(&load("plain.glb", &GltfCube::default().glb()).unwrap());
    for extension in [EXT, "KHR_meshopt_compression"] {
        for (version, filter) in [(0, "NONE"), (1, "NONE"), (0, "EXPONENTIAL"), (1, "EXPONENTIAL")] {
            for (stride, mode) in [(2, "TRIANGLES"), (4, "TRIANGLES"), (2, "INDICES"), (4, "INDICES")] {
                let streams = [positions(version, filter), Stream::indices(&cube_triangles(), stride, mode)];
                let scene = load("packed.glb", &compressed_cube(extension, &streams).glb()).unwrap();
                let sorted = |mut triangles: Vec<[Vec3; 3]>| {
                    // The encoder may rotate a triangle's corners.
                    let least = |t: &[Vec3; 3]| (0..3).min_by_key(|&i| format!("{:?}", t[i])).unwrap();
                    for triangle in &mut triangles {
                        let first = least(triangle);
                        triangle.rotate_left(first);
                    }
                    triangles
                };
                let case = format!("{extension} {version} {filter} {stride} {mode}");
                assert_eq!(sorted(world_triangles(&scene)), sorted(plain.clone()), "{case}");
            }
        }
    }
}

/// The compressed cube with its diagonals as normals.
fn with_normals(normals: Stream) -> GltfCube {
    let component = if normals.stride == 4 { 5120 } else { 5122 };
    let mut cube = compressed_cube(EXT, &[positions(0, "NONE"), plain_streams().remove(1), normals]);
    cube.primitive = r#"{"attributes":{"POSITION":0,"NORMAL":2},"indices":1}"#.into();
    cube.accessors +=
        &format!(r#",{{"bufferView":2,"componentType":{component},"normalized":true,"count":8,"type":"VEC3"}}"#);
    cube
}

#[test]
fn octahedral_normals_are_decoded() {
    for (stride, within) in [(4, 0.02), (8, 1e-4)] {
        let scene = load("octahedral.glb", &with_normals(diagonals(stride)).glb()).unwrap();
        let vertices = &scene.meshes[0].vertices;
        assert_eq!(vertices.len(), CUBE_CORNERS.len());
        for vertex in vertices {
            let wanted = Vec3::from(vertex.position).normalize_or(Vec3::X);
            assert!(Vec3::from(vertex.normal).distance(wanted) < within, "{stride}: {vertex:?}");
        }
    }
}

#[test]
fn quaternions_are_decoded() {
    // As colours, which keep four components: from 0.6 linear comes code 203.
    let mut cube =
        compressed_cube(EXT, &[positions(0, "NONE"), plain_streams().remove(1), quaternions([0.0, 0.6, 0.0, 0.8])]);
    cube.primitive = r#"{"attributes":{"POSITION":0,"COLOR_0":2},"indices":1}"#.into();
    cube.accessors += r#",{"bufferView":2,"componentType":5122,"normalized":true,"count":8,"type":"VEC4"}"#;
    let scene = load("quaternion.glb", &cube.glb()).unwrap();
    assert_eq!(scene.meshes[0].vertices[0].color_srgba8, [0, 203, 0, 204]);
}

/// The message about the compressed cube with a change in its JSON.
fn changed(from: &str, to: &str) -> String {
    let mut cube = compressed_cube(EXT, &plain_streams());
    let before = cube.views.clone();
    cube.views = cube.views.replacen(from, to, 1);
    assert_ne!(cube.views, before, "{from} is not there");
    refusal("bad.glb", &cube.glb())
}

#[test]
fn bad_descriptions_are_refused_by_view_and_reason() {
    for (from, to, reason) in [
        (r#""count":8"#, r#""count":0"#, "count is 0"),
        (r#""count":8"#, r#""count":9"#, "where the view has 96 bytes"),
        (r#""count":8"#, r#""count":18446744073709551615"#, "where the view has 96 bytes"),
        (r#""byteStride":12,"count""#, r#""byteStride":10,"count""#, "byteStride 10"),
        (r#""byteStride":12,"count""#, r#""byteStride":512,"count""#, "byteStride 512"),
        (r#""byteStride":12,"count":8"#, r#""byteStride":24,"count":4"#, "is not the view's"),
        (r#""NONE""#, r#""OCTAHEDRAL""#, "filter"),
        (r#""NONE""#, r#""QUATERNION""#, "filter"),
        (r#""NONE""#, r#""ZIP""#, "ZIP"),
        (r#""ATTRIBUTES""#, r#""TRIANGLES""#, "byteStride 12"),
        (r#""ATTRIBUTES""#, r#""POINTS""#, "POINTS"),
        (r#""buffer":0"#, r#""buffer":7"#, "leave buffer 7"),
        (r#""buffer":0"#, r#""buffer":1"#, "leave buffer 1"),
        (r#""buffer":0"#, r#""buffer":"a""#, "string"),
    ] {
        let message = changed(from, to);
        assert!(message.contains(&format!("buffer view 0, {EXT}: ")), "{message}");
        assert!(message.contains(reason), "{to}: {message}");
    }
    let message = changed(r#""count":36,"#, r#""count":35,"#);
    assert!(message.contains("buffer view 1, ") && message.contains("whole triangles"), "{message}");
}

#[test]
fn a_stream_of_another_length_is_refused() {
    for (view, stream) in plain_streams().iter().enumerate() {
        for length in 0..stream.bytes.len() {
            let mut streams = plain_streams();
            streams[view].bytes.truncate(length);
            let message = refusal("cut.glb", &compressed_cube(EXT, &streams).glb());
            assert!(message.contains(&format!("buffer view {view}, {EXT}: its stream")), "{length}: {message}");
        }
        let mut streams = plain_streams();
        streams[view].bytes.push(0);
        assert!(refusal("long.glb", &compressed_cube(EXT, &streams).glb()).contains(EXT));
        streams[view].bytes[0] ^= 0xf0;
        assert!(refusal("other.glb", &compressed_cube(EXT, &streams).glb()).contains(EXT));
    }
}

#[test]
fn a_normal_of_no_direction_is_refused() {
    let zeros = with_normals(Stream::attributes(0, &[0; 32], 4, "OCTAHEDRAL"));
    assert!(refusal("zero.glb", &zeros.glb()).contains("buffer view 2, EXT_meshopt_compression: its filter"));
}

#[test]
fn decoded_bytes_are_limited_before_allocation() {
    let claim = compressed_cube(EXT, &plain_streams());
    // Equal elements take an eighth of a byte each.
    let huge = Stream::attributes(0, &vec![0; 64 << 20], 256, "NONE");
    let bytes = compressed_cube(EXT, &[huge, claim_indices()]).glb();
    assert!(bytes.len() < 3 << 20, "{}", bytes.len());
    let sample = Sample::new("bomb.glb", &bytes);
    let limits = Limits { file_bytes: 8 << 20, ..Limits::default() };
    let error = load_file(&sample.path, &limits, MissingTextures::Refuse).unwrap_err();
    assert!(matches!(error.kind, SceneErrorKind::TooLarge { actual: 67_108_864, .. }), "{error}");
    assert!(error.element.starts_with("buffer view 0"), "{error}");
    assert!(Sample::new("cube.glb", &claim.glb()).load().is_ok());
}

fn claim_indices() -> Stream {
    plain_streams().remove(1)
}

#[test]
fn a_fallback_buffer_is_not_read_and_other_views_may_not_use_it() {
    let mut cube = compressed_cube(EXT, &plain_streams());
    cube.buffers = cube.buffers.replace(r#""extensions""#, r#""uri":"../no such file.bin","extensions""#);
    assert!(load("fallback.glb", &cube.glb()).is_ok());
    cube.views += r#",{"buffer":1,"byteLength":72}"#;
    cube.accessors = cube.accessors.replace(r#""bufferView":1"#, r#""bufferView":2"#);
    let message = refusal("fallback.glb", &cube.glb());
    assert!(message.contains("leaves the 0 bytes of buffer 1"), "{message}");
}
