//! Extensions of glTF: which are read, which are named, and which are refused.

use glam::Vec3;
use scene::{ImportOptions, Limits, Scene, SceneErrorKind, load_file};

use crate::samples::warnings::{with_one_warning, with_warnings};
use crate::samples::{GltfCube, Sample, cube, load, refusal};

fn requiring(names: &str) -> GltfCube {
    cube(|c| c.more = format!(r#""extensionsUsed":[{names}],"extensionsRequired":[{names}],"#))
}

#[test]
fn extensions_that_leave_geometry_alone_are_named_in_one_warning() {
    let names = ["KHR_materials_clearcoat", "KHR_materials_sheen", "KHR_xmp_json_ld", "MSFT_lod"];
    let required = requiring(&names.map(|name| format!("{name:?}")).join(","));
    let (scene, warning) = with_one_warning(|| load("a.glb", &required.glb()).unwrap());
    assert_eq!(scene.triangle_count(), 12);
    assert!(
        warning.contains("a.glb") && warning.contains(&format!("extensions that are not read: {}", names.join(", "))),
        "{warning}"
    );
    let read = requiring(r#""KHR_node_visibility","KHR_draco_mesh_compression","KHR_texture_basisu""#);
    let (scene, warnings) = with_warnings(|| load("a.glb", &read.glb()).unwrap());
    assert!(scene.triangle_count() == 12 && warnings.is_empty(), "{warnings:?}");
}

#[test]
fn extensions_that_may_change_geometry_are_refused_unless_they_are_ignored() {
    let sample = Sample::new("a.glb", &requiring(r#""KHR_implicit_shapes","EXT_of_tomorrow""#).glb());
    let error = sample.load().unwrap_err();
    assert!(matches!(error.kind, SceneErrorKind::Unsupported(_)), "{error}");
    let error = error.to_string();
    assert!(
        error.contains("KHR_implicit_shapes") && error.contains("--ignore-required KHR_implicit_shapes"),
        "{error}"
    );
    let ignoring = |names: &[&str]| {
        let ignore_required = names.iter().map(|name| (*name).to_owned()).collect();
        load_file(&sample.path, &Limits::default(), ImportOptions { ignore_required, ..ImportOptions::default() })
    };
    let quantized = requiring(r#""WEB3D_quantized_attributes""#);
    assert!(refusal("q.glb", &quantized.glb()).contains("WEB3D_quantized_attributes"));
    assert!(ignoring(&["KHR_implicit_shapes"]).unwrap_err().to_string().contains("EXT_of_tomorrow"));
    let (scene, warning) = with_one_warning(|| ignoring(&["EXT_of_tomorrow", "KHR_implicit_shapes"]).unwrap());
    assert_eq!(scene.triangle_count(), 12);
    assert!(warning.contains("not read: EXT_of_tomorrow, KHR_implicit_shapes"), "{warning}");
}

/// A cube whose node has seven placements, three units apart, each turned and scaled by a half.
fn instanced(change: impl FnOnce(&mut GltfCube)) -> GltfCube {
    cube(|c| {
        c.nodes = r#"{"mesh":0,"translation":[0,10,0],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":
            {"TRANSLATION":2,"ROTATION":3,"SCALE":4,"_ID":2}}}}"#
            .into();
        c.accessors += r#",{"bufferView":2,"componentType":5126,"count":7,"type":"VEC3"},
            {"bufferView":3,"componentType":5120,"normalized":true,"count":7,"type":"VEC4"},
            {"bufferView":4,"componentType":5126,"count":7,"type":"VEC3"}"#;
        c.views += r#",{"buffer":0,"byteOffset":168,"byteLength":84},{"buffer":0,"byteOffset":252,"byteLength":28},
            {"buffer":0,"byteOffset":280,"byteLength":84}"#;
        c.buffers = r#"{"byteLength":364}"#.into();
        let places = (0..7u8).flat_map(|i| [f32::from(i) * 3.0, 0.0, 0.0]);
        c.binary.extend(places.flat_map(f32::to_le_bytes));
        c.binary.extend([0, 0, 127, 0].repeat(7));
        c.binary.extend([0.5f32; 21].iter().flat_map(|v| v.to_le_bytes()));
        change(c);
    })
}

#[test]
fn instances_are_placed_with_all_their_parts() {
    let scene = load("a.glb", &instanced(|_| {}).glb()).unwrap();
    assert_eq!((scene.meshes.len(), scene.instances.len(), scene.triangle_count()), (1, 7, 84));
    assert_eq!(
        (scene.bounds().min, scene.bounds().max),
        (Vec3::new(-0.25, 9.75, -0.25), Vec3::new(18.25, 10.25, 0.25))
    );
    for (number, instance) in scene.instances.iter().enumerate() {
        let corner = instance.world_from_mesh.transform_point3(Vec3::splat(0.5));
        let expected = Vec3::new(number as f32 * 3.0 - 0.25, 9.75, 0.25);
        assert!(corner.distance(expected) < 1e-5, "{number}: {corner}");
    }
}

#[test]
fn instances_move_with_their_node() {
    let moving = instanced(|c| {
        c.accessors += r#",{"bufferView":5,"componentType":5126,"count":2,"type":"SCALAR"},
            {"bufferView":6,"componentType":5126,"count":2,"type":"VEC3"}"#;
        c.views += r#",{"buffer":0,"byteOffset":364,"byteLength":8},{"buffer":0,"byteOffset":372,"byteLength":24}"#;
        c.buffers = r#"{"byteLength":396}"#.into();
        c.binary.extend([0f32, 1.0, 0.0, 10.0, 0.0, 0.0, 20.0, 0.0].iter().flat_map(|v| v.to_le_bytes()));
        c.more = r#""animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],
            "samplers":[{"input":5,"output":6}]}],"#
            .into();
    });
    let scene = load("a.glb", &moving.glb()).unwrap();
    let lowest = |time_s: f32| {
        let frozen = scene.frozen_at(time_s);
        (frozen.bounds().min, frozen.bounds().max)
    };
    assert_eq!(lowest(0.0), (Vec3::new(-0.25, 9.75, -0.25), Vec3::new(18.25, 10.25, 0.25)));
    let (min, max) = lowest(0.5);
    assert!(min.distance(Vec3::new(-0.25, 14.75, -0.25)) < 1e-4 && max.distance(Vec3::new(18.25, 15.25, 0.25)) < 1e-4);
}

#[test]
fn damaged_instances_are_refused_by_node() {
    let changed = |from: &str, to: &str| {
        let damaged = instanced(|c| {
            assert!(c.json().contains(from), "{from}");
            c.accessors = c.accessors.replacen(from, to, 1);
            c.nodes = c.nodes.replacen(from, to, 1);
        });
        refusal("bad.glb", &damaged.glb())
    };
    assert!(changed(r#""count":7"#, r#""count":6"#).contains("node 0, EXT_mesh_gpu_instancing: its attributes"));
    assert!(changed(r#""TRANSLATION":2"#, r#""TRANSLATION":77"#).contains("accessor 77"));
    assert!(changed(r#""TRANSLATION":2"#, r#""TRANSLATION":"x""#).contains("node 0, EXT_mesh_gpu_instancing"));
    let nan = instanced(|c| c.binary[168..172].copy_from_slice(&f32::NAN.to_le_bytes()));
    assert!(refusal("nan.glb", &nan.glb()).contains("instance 0 is not finite"));
    let sample = Sample::new("many.glb", &instanced(|_| {}).glb());
    let limits = Limits { instances: 6, ..Limits::default() };
    let error = load_file(&sample.path, &limits, ImportOptions::default()).unwrap_err();
    assert!(matches!(error.kind, SceneErrorKind::TooLarge { actual: 7, limit: 6 }), "{error}");
}

#[test]
fn invisible_nodes_hide_all_below_them_but_cameras() {
    let scene = load(
        "a.glb",
        &cube(|c| {
            c.nodes = r#"{"mesh":0,"extensions":{"KHR_node_visibility":{"visible":true}}},
                {"children":[2],"camera":0,"extensions":{"KHR_node_visibility":{"visible":false}}},
                {"mesh":0,"translation":[5,0,0],"extensions":{"KHR_lights_punctual":{"light":0}}}"#
                .into();
            c.roots = "0,1".into();
            c.more = r#""cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.1}}],
                "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point"}]}},"#
                .into();
        })
        .glb(),
    )
    .unwrap();
    assert_eq!((scene.instances.len(), scene.illumination.lights.len(), scene.cameras.len()), (1, 0, 1));
    assert_eq!(scene.bounds().max.x, 0.5);
}

/// The material of a square with a specular and glossy description.
fn specular_glossy(extension: &str, pbr: &str) -> Scene {
    let pixel = |rgba: [u8; 4]| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbaImage::from_pixel(1, 1, image::Rgba(rgba)).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let hex: String = bytes.get_ref().iter().map(|b| format!("%{b:02x}")).collect();
        format!(r#"{{"uri":"data:image/png,{hex}"}}"#)
    };
    let images = [pixel([10, 20, 30, 255]), pixel([255, 255, 255, 51])].join(",");
    let cube = cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#.into();
        c.more = format!(
            r#""textures":[{{"source":0}},{{"source":1}}],"images":[{images}],"materials":[{{{pbr}
            "extensions":{{"KHR_materials_pbrSpecularGlossiness":{{{extension}}}}}}}],"#
        );
    });
    load("a.glb", &cube.glb()).unwrap()
}

#[test]
fn specular_and_glossy_surfaces_keep_their_diffuse_texture_reflectance_and_roughness() {
    let scene = specular_glossy(
        r#""diffuseFactor":[1,0.5,0.25,0.75],"diffuseTexture":{"index":0},"specularFactor":[0.5,0.25,0],
        "glossinessFactor":0.5,"specularGlossinessTexture":{"index":1}"#,
        r#""pbrMetallicRoughness":{"baseColorFactor":[1,0,1,1]},"#,
    );
    let material = &scene.materials[0];
    assert_eq!(material.base_color_linear, [0.5, 0.25, 0.125, 0.75]);
    let texture = &scene.textures[material.base_color_texture.unwrap().texture as usize];
    assert_eq!(texture.srgba8, [10, 20, 30, 255]);
    assert_eq!(material.dielectric_reflectance_linear, Vec3::new(0.5, 0.25, 0.0));
    assert_eq!(material.metallic, 0.0);
    assert!((material.roughness - 0.9).abs() < 1e-6, "{}", material.roughness);
}

#[test]
fn a_newer_description_with_textures_counts_before_the_specular_one() {
    let scene = specular_glossy(
        r#""diffuseTexture":{"index":0},"specularFactor":[1,1,1]"#,
        r#""pbrMetallicRoughness":{"metallicFactor":0.5,"metallicRoughnessTexture":{"index":1}},"#,
    );
    let material = &scene.materials[0];
    assert_eq!((material.metallic, material.base_color_texture), (0.5, None));
}
