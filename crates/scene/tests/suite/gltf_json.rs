//! glTF whose JSON other programs take: the scene is shown, or the reason is a clear one.

use crate::samples::warnings::{with_one_warning, with_warnings};
use crate::samples::{GltfCube, Sample, cube, cube_buffer, glb, load, refusal};

fn assert_is_cube(json: &str) {
    let (scene, warnings) = with_warnings(|| load("cube.glb", &glb(json, &cube_buffer())).unwrap());
    assert_eq!(scene.triangle_count(), 12);
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn a_byte_order_mark_is_skipped() {
    let json = format!("\u{feff}{}", GltfCube::default().json());
    assert_is_cube(&json);
    let by_file = cube(|c| c.buffers = r#"{"byteLength":168,"uri":"a.bin"}"#.into());
    let sample = Sample::new("cube.gltf", format!("\u{feff}{}", by_file.json()).as_bytes());
    assert_eq!(sample.with("a.bin", &cube_buffer()).load().unwrap().triangle_count(), 12);
}

#[test]
fn whole_numbers_may_have_a_fraction_of_zero() {
    let json = GltfCube::default().json();
    assert_is_cube(&json.replace(r#""count":36"#, r#""count":36.0"#).replace(r#""mesh":0"#, r#""mesh":0.0"#));
    assert_is_cube(&json.replace("5126", "5.126e3").replace(r#""byteLength":72"#, r#""byteLength":72.0"#));
    let fraction = json.replace(r#""count":36"#, r#""count":35.5"#);
    assert!(refusal("half.glb", &glb(&fraction, &cube_buffer())).contains("JSON"));
}

#[test]
fn members_may_be_null_and_names_in_another_encoding() {
    assert_is_cube(&GltfCube::default().json().replace(r#""mesh":0"#, r#""mesh":0,"children":null,"camera":null"#));
    let named = cube(|c| c.nodes = r#"{"mesh":0,"name":"Wuerfel"}"#.into()).glb();
    let at = named.windows(2).position(|pair| pair == b"ue").unwrap();
    let mut latin1 = named;
    latin1[at..at + 2].copy_from_slice(b"\xfc ");
    assert_eq!(load("latin1.glb", &latin1).unwrap().triangle_count(), 12);
}

#[test]
fn scenes_may_lack_nodes_and_an_empty_one_is_named() {
    let json = GltfCube::default().json();
    let scenes = r#""scenes":[{"nodes":[0]}]"#;
    assert!(json.contains(scenes));
    assert_is_cube(&json.replace(scenes, r#""scenes":[{"nodes":[0]},{"name":"empty"}]"#));
    let empty = json.replace(scenes, r#""scenes":[{"name":"empty"},{"nodes":[0]}]"#);
    assert!(refusal("empty.glb", &glb(&empty, &cube_buffer())).contains("no triangles in scene 0"));
}

#[test]
fn channels_without_a_target_node_are_left_out() {
    let animated = |targets: [&str; 2]| {
        let channels = targets.map(|target| format!(r#"{{"sampler":0,"target":{{{target}}}}}"#)).join(",");
        cube(|c| {
            c.accessors += r#",{"bufferView":0,"componentType":5126,"count":1,"type":"SCALAR","sparse":{"count":1,
                "indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":2}}},
                {"bufferView":2,"componentType":5126,"count":1,"type":"VEC3"}"#;
            c.views += r#",{"buffer":0,"byteOffset":168,"byteLength":12}"#;
            c.binary.extend([0u8; 12]);
            c.buffers = r#"{"byteLength":180}"#.into();
            c.more = format!(
                r#""animations":[{{"channels":[{channels}],"samplers":[{{"input":2,"output":3}}]}},{{"name":"empty"}}],"#
            );
        })
    };
    let moved = r#""node":0,"path":"translation""#;
    let pointer = r#""path":"pointer","extensions":{"KHR_animation_pointer":{}}"#;
    for (without, reason) in [
        (r#""path":"translation""#.to_owned(), "channels without a target node"),
        (pointer.to_owned(), "channels of KHR_animation_pointer"),
        (format!(r#""node":0,{pointer}"#), "channels of KHR_animation_pointer"),
    ] {
        let without = without.as_str();
        let (scene, warning) = with_one_warning(|| load("a.glb", &animated([moved, without]).glb()).unwrap());
        assert_eq!(scene.animation.unwrap().clips[0].channels.len(), 1);
        assert!(
            warning.contains("a.glb") && warning.contains(&format!("{reason} are left out: animation 0")),
            "{warning}"
        );
        let (_, warning) = with_one_warning(|| load("a.glb", &animated([without; 2]).glb()).unwrap());
        assert!(warning.contains("2, the first"), "{warning}");
    }
}

#[test]
fn buffers_are_found_without_query_and_in_another_case_and_missing_ones_are_named() {
    let with_uri = |uri: &str| {
        let json = cube(|c| c.buffers = format!(r#"{{"byteLength":168,"uri":"{uri}"}}"#)).json();
        Sample::new("cube.gltf", json.as_bytes()).with("Data 1.bin", &cube_buffer())
    };
    for uri in ["Data%201.bin", "Data%201.bin?v=3", "DATA%201.BIN", "./data 1.bin?v=3#x"] {
        assert_eq!(with_uri(uri).load().unwrap().triangle_count(), 12, "{uri}");
    }
    for uri in ["other.bin", "?v=3"] {
        let error = with_uri(uri).load().unwrap_err().to_string();
        assert!(error.contains("buffer 0") && error.contains(uri), "{error}");
    }
    let outside = with_uri("../Data%201.bin?v=3").load().unwrap_err().to_string();
    assert!(outside.contains("climbs out"), "{outside}");
}

#[test]
fn more_values_than_the_limit_are_refused_before_they_are_parsed() {
    let json = format!(r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{}0]}}]}}"#, "0,".repeat(40_000_000));
    let error = load("long.gltf", json.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("JSON values: 40000001 is over"), "{error}");
}
