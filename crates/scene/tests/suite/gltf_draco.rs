//! `KHR_draco_mesh_compression`: compressed primitives are those of their plain form, and invalid ones are refused.

use glam::Vec3;
use scene::{Limits, MissingTextures, SceneErrorKind, load_file};

use crate::samples::draco::{cube_stream, draco_cube};
use crate::samples::{Sample, cube_buffer, load, refusal, signed_volume, world_triangles};

#[test]
fn a_compressed_cube_is_the_plain_cube() {
    let mut plain = world_triangles(&load("plain.glb", &crate::samples::GltfCube::default().glb()).unwrap());
    let key = |triangle: &[Vec3; 3]| triangle.iter().sum::<Vec3>().to_array().map(|c| (c * 1000.0).round() as i32);
    plain.sort_by_key(key);
    for level in [None, Some(0), Some(5), Some(10)] {
        let scene = load("draco.glb", &draco_cube(&cube_stream(level, 16), |_| {}).glb()).unwrap();
        let mut found = world_triangles(&scene);
        found.sort_by_key(key);
        assert_eq!(found.len(), 12, "{level:?}");
        for (found, plain) in found.iter().zip(&plain) {
            let centre = |triangle: &[Vec3; 3]| triangle.iter().sum::<Vec3>() / 3.0;
            assert!(centre(found).distance(centre(plain)) < 1e-4, "{level:?}: {found:?}, not {plain:?}");
        }
        assert!((signed_volume(&scene) - 1.0).abs() < 1e-3, "{level:?}: triangles face out");
        // The colour of each corner says which one it is.
        for vertex in &scene.meshes[0].vertices {
            let corner = crate::samples::CUBE_CORNERS
                .iter()
                .position(|corner| Vec3::from(*corner).distance(Vec3::from(vertex.position)) < 1e-3);
            let red = depth_image::srgb8_from_linear(corner.unwrap() as f32 * 30.0 / 255.0);
            assert_eq!(vertex.color_srgba8, [red, 0, 255, 255], "{level:?}");
        }
    }
}

#[test]
fn uncompressed_accessors_count_before_the_stream() {
    let plain = draco_cube(b"no stream at all", |c| {
        c.accessors = crate::samples::GltfCube::default().accessors
            + r#",{"componentType":5121,"normalized":true,"count":8,"type":"VEC4"}"#;
        c.views = crate::samples::GltfCube::default().views;
        c.buffers = crate::samples::GltfCube::default().buffers;
        c.binary = cube_buffer();
    });
    assert_eq!(load("plain.glb", &plain.glb()).unwrap().triangle_count(), 12);
}

#[test]
fn compressed_points_are_left_out() {
    let stream = cube_stream(None, 12);
    let cube = draco_cube(&stream, |c| {
        let points = c.primitive.replacen('{', r#"{"mode":0,"#, 1).replace(r#""bufferView":0"#, r#""bufferView":1"#);
        c.primitive = format!("{},{points}", c.primitive);
        c.views += r#",{"buffer":0,"byteLength":9}"#;
    });
    assert_eq!(load("points.glb", &cube.glb()).unwrap().triangle_count(), 12);
}

#[test]
fn damaged_streams_and_descriptions_are_refused_by_primitive() {
    let stream = cube_stream(None, 12);
    for length in [0, 4, 11, stream.len() / 2, stream.len() - 1] {
        let message = refusal("cut.glb", &draco_cube(&stream[..length.max(1)], |_| {}).glb());
        assert!(message.contains("mesh 0, primitive 0, KHR_draco_mesh_compression"), "{length}: {message}");
    }
    let changed = |from: &str, to: &str| {
        let cube = draco_cube(&stream, |c| {
            assert!(c.primitive.contains(from), "{from}");
            c.primitive = c.primitive.replace(from, to);
        });
        refusal("bad.glb", &cube.glb())
    };
    assert!(changed(r#""COLOR_0":1}"#, r#""COLOR_0":7}"#).contains("has number 7, which its stream lacks"));
    assert!(changed(r#""POSITION":0,"COLOR_0":1}"#, r#""POSITION":1,"COLOR_0":0}"#).contains("components"));
    assert!(changed(r#""bufferView":0"#, r#""bufferView":9"#).contains("buffer view 9"));
    assert!(changed(r#""indices":1,"#, "").contains("its primitive has no indices"));
    assert!(changed(r#""bufferView":0,"#, "").contains("bufferView"));
}

#[test]
fn what_a_stream_decodes_to_is_limited() {
    let sample = Sample::new("draco.glb", &draco_cube(&cube_stream(None, 12), |_| {}).glb());
    let refused = |limits: Limits| load_file(&sample.path, &limits, MissingTextures::Refuse).unwrap_err();
    let vertices = refused(Limits { vertices: 7, ..Limits::default() });
    assert!(matches!(vertices.kind, SceneErrorKind::TooLarge { actual: 8, limit: 7 }), "{vertices}");
    let triangles = refused(Limits { triangles: 11, ..Limits::default() }).to_string();
    assert!(triangles.contains("KHR_draco_mesh_compression") && triangles.contains("11"), "{triangles}");
    // Each primitive decodes the stream for itself, and all count together.
    let stream = cube_stream(None, 12);
    let many = draco_cube(&stream, |c| {
        let primitives = (0..40).map(|i| {
            let [position, index, color] = [0, 1, 2].map(|part| i * 3 + part);
            c.primitive
                .replace(r#""POSITION":0,"COLOR_0":2}"#, &format!(r#""POSITION":{position},"COLOR_0":{color}}}"#))
                .replace(r#""indices":1"#, &format!(r#""indices":{index}"#))
        });
        c.primitive = primitives.collect::<Vec<_>>().join(",");
        c.accessors = vec![c.accessors.clone(); 40].join(",");
    });
    let sample = Sample::new("many.glb", &many.glb());
    assert_eq!(sample.load().unwrap().triangle_count(), 480);
    let limits = Limits { vertices: 300, ..Limits::default() };
    let error = load_file(&sample.path, &limits, MissingTextures::Refuse).unwrap_err().to_string();
    assert!(error.contains("primitive 37, KHR_draco_mesh_compression: decoded vertices"), "{error}");
}
