//! glTF: what it holds comes out, and what it must not hold is refused.
#![allow(clippy::unwrap_used)]

mod samples;

use glam::Vec3;
use samples::{GltfCube, Sample, cube_buffer, load, refusal, signed_volume, world_triangles};
use scene::{Light, Limits, SceneErrorKind, load_file};

fn cube(change: impl FnOnce(&mut GltfCube)) -> GltfCube {
    let mut cube = GltfCube::default();
    change(&mut cube);
    cube
}

fn refused(change: impl FnOnce(&mut GltfCube)) -> String {
    refusal("bad.glb", &cube(change).glb())
}

#[test]
fn a_cube_has_twelve_flat_triangles_where_they_belong() {
    let scene = load("cube.glb", &GltfCube::default().glb()).unwrap();
    assert_eq!((scene.triangle_count(), scene.name.as_str()), (12, "cube"));
    assert_eq!((scene.bounds().min, scene.bounds().max), (Vec3::splat(-0.5), Vec3::splat(0.5)));
    assert!((signed_volume(&scene) - 1.0).abs() < 1e-6);
    // Flat: each side has four corners of its own, and each normal is its side's.
    assert_eq!(scene.meshes[0].vertices.len(), 24);
    for vertex in &scene.meshes[0].vertices {
        let along = Vec3::from(vertex.normal).dot(Vec3::from(vertex.position));
        assert!((along - 0.5).abs() < 1e-6, "{vertex:?}");
    }
}

#[test]
fn the_json_form_reads_its_buffer_from_file_and_data_uri() {
    let by_file = cube(|c| c.buffers = r#"{"byteLength":168,"uri":"cube%20data.bin"}"#.into());
    let sample = Sample::new("cube.gltf", by_file.json().as_bytes()).with("cube data.bin", &cube_buffer());
    assert_eq!(sample.load().unwrap().triangle_count(), 12);
    let hex: String = cube_buffer().iter().map(|b| format!("%{b:02x}")).collect();
    let by_data = cube(|c| c.buffers = format!(r#"{{"byteLength":168,"uri":"data:application/octet-stream,{hex}"}}"#));
    assert_eq!(load("cube.gltf", by_data.json().as_bytes()).unwrap().triangle_count(), 12);
}

#[test]
fn one_mesh_in_two_nodes_is_two_instances() {
    let twice = cube(|c| {
        c.nodes = r#"{"children":[1,2],"translation":[10,0,0]},{"mesh":0},{"mesh":0,"scale":[2,2,2]}"#.into();
    });
    let scene = load("twice.glb", &twice.glb()).unwrap();
    assert_eq!((scene.meshes.len(), scene.instances.len(), scene.triangle_count()), (1, 2, 24));
    assert_eq!(scene.bounds().center(), Vec3::new(10.0, 0.0, 0.0));
    assert!((signed_volume(&scene) - 9.0).abs() < 1e-3);
}

#[test]
fn a_mirrored_node_still_faces_out() {
    let mirrored = cube(|c| {
        c.nodes = r#"{"mesh":0,"scale":[-1,1,1],"translation":[3,0,0]},{"mesh":0},{"mesh":0,"scale":[1,-2,1]}"#.into();
        c.roots = "0,1,2".into();
    });
    let scene = load("mirror.glb", &mirrored.glb()).unwrap();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (2, 3));
    assert!((signed_volume(&scene) - 4.0).abs() < 1e-4, "{}", signed_volume(&scene));
    assert!(scene.instances.iter().all(|i| i.world_from_mesh.matrix3.determinant() > 0.0));
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let outwards = |v: &scene::Vertex| Vec3::from(v.normal).dot(Vec3::from(v.position)) > 0.0;
        assert!(mesh.vertices.iter().all(outwards));
    }
}

#[test]
fn strips_fans_and_unindexed_triangles() {
    let quad = [[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]];
    let fan = [quad[0], quad[1], quad[3], quad[2]];
    for (mode, points, triangles) in [(5, quad, 2), (6, fan, 2), (1, quad, 0)] {
        let shape = cube(|c| {
            c.primitive = format!(r#"{{"attributes":{{"POSITION":0}},"mode":{mode}}}"#);
            c.accessors = r#"{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}"#.into();
            c.binary = points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
            c.binary.resize(168, 0);
        });
        if triangles == 0 {
            assert!(refusal("lines.glb", &shape.glb()).contains("no triangles"));
            continue;
        }
        let scene = load("shape.glb", &shape.glb()).unwrap();
        assert_eq!(scene.triangle_count(), triangles);
        let front = |[a, b, c]: &[Vec3; 3]| (*b - *a).cross(*c - *a).z > 0.0;
        assert!(world_triangles(&scene).iter().all(front));
    }
}

#[test]
fn materials_keep_what_the_model_has_room_for() {
    let scene = load(
        "m.glb",
        &cube(|c| {
            c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#.into();
            c.more = r#""extensionsRequired":["KHR_materials_unlit"],"materials":[{"name":"m","alphaMode":"MASK",
            "alphaCutoff":0.25,"doubleSided":true,"emissiveFactor":[0,1,0],"extensions":{"KHR_materials_unlit":{}},
            "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,1],"metallicFactor":0.5,"roughnessFactor":0.75}},
            {"alphaMode":"BLEND"}],"#
                .into();
        })
        .glb(),
    )
    .unwrap();
    let m = &scene.materials[0];
    assert_eq!((m.name.as_str(), m.base_color_linear), ("m", [0.5, 0.25, 1.0, 1.0]));
    assert_eq!((m.metallic, m.roughness, m.alpha_cutoff), (0.5, 0.75, 0.25));
    assert!(m.double_sided && m.unlit);
    assert_eq!(m.emissive_linear, Vec3::Y);
    assert_eq!(scene.materials[1].alpha_cutoff, 0.5);
}

#[test]
fn vertex_colours_are_encoded_and_texture_transforms_baked() {
    let scene = load("c.glb", &cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0,"COLOR_0":2,"TEXCOORD_0":3,"NORMAL":0},"indices":1,"material":0}"#.into();
        c.accessors += r#",{"bufferView":2,"componentType":5121,"normalized":true,"count":8,"type":"VEC4"},
            {"bufferView":3,"componentType":5126,"count":8,"type":"VEC2"}"#;
        c.views += r#",{"buffer":0,"byteOffset":168,"byteLength":32},{"buffer":0,"byteOffset":200,"byteLength":64}"#;
        c.buffers = r#"{"byteLength":264}"#.into();
        c.binary.extend([55, 0, 255, 128].repeat(8));
        c.binary.extend([0.5f32, 1.0].repeat(8).iter().flat_map(|v| v.to_le_bytes()));
        c.more = format!(r#""textures":[{{"source":0}}],"images":[{{"uri":"{}"}}],"materials":[{{"pbrMetallicRoughness":
            {{"baseColorTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"scale":[2,3],"offset":[1,0]}}}}}}}}}}],"#,
            png_data_uri());
    }).glb()).unwrap();
    let vertex = scene.meshes[0].vertices[0];
    assert_eq!(vertex.uv, [2.0, 3.0]);
    // 55/255 linear is 0.216, which sRGB encodes as 128.
    assert_eq!(vertex.color_srgba8, [128, 0, 255, 128]);
    assert_eq!((scene.textures[0].width_px, scene.textures[0].srgba8[..3].to_vec()), (1, vec![255, 0, 0]));
    assert!((Vec3::from(vertex.normal).length() - 1.0).abs() < 1e-6, "a normal of other length is normalised");
}

/// One red pixel.
fn png_data_uri() -> &'static str {
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC"
}

#[test]
fn lights_and_cameras_are_placed() {
    let scene = load("l.glb", &cube(|c| {
        c.more = r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional","intensity":3.1415927},
            {"type":"spot","color":[1,0,0],"spot":{}}]}},"cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.1}},
            {"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"zfar":2,"znear":1}}],"#.into();
        c.nodes += r#",{"extensions":{"KHR_lights_punctual":{"light":0}},"rotation":[-0.70710678,0,0,0.70710678]},
            {"extensions":{"KHR_lights_punctual":{"light":1}},"translation":[1,2,3]},
            {"camera":0,"name":"eye","translation":[0,0,5],"scale":[3,3,3]},{"camera":1}"#;
        c.roots = "0,1,2,3,4".into();
    }).glb()).unwrap();
    let (mut sun, mut lamp) = (None, None);
    for light in &scene.lights {
        match *light {
            Light::Directional { towards_light_in_world, irradiance_linear } => {
                sun = Some((towards_light_in_world, irradiance_linear))
            }
            Light::Point { position_in_world, intensity_linear } => lamp = Some((position_in_world, intensity_linear)),
        }
    }
    let (towards, irradiance) = sun.unwrap();
    assert!(towards.distance(Vec3::Y) < 1e-5 && irradiance.distance(Vec3::ONE) < 1e-5, "{towards} {irradiance}");
    assert_eq!((lamp.unwrap().0, lamp.unwrap().1.y), (Vec3::new(1.0, 2.0, 3.0), 0.0));
    assert_eq!((scene.cameras.len(), scene.cameras[0].name.as_str(), scene.cameras[0].fov_y_rad), (1, "eye", 1.0));
    let pose = scene.cameras[0].world_from_camera;
    assert_eq!((pose.translation.z, pose.matrix3.determinant()), (5.0, 1.0));
}

#[test]
fn a_sparse_accessor_overwrites_its_base() {
    let sparse = cube(|c| {
        c.accessors = c.accessors.replacen(r#""count":8"#,
            r#""sparse":{"count":1,"indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":3}},"count":8"#, 1);
        c.views += r#",{"buffer":0,"byteOffset":168,"byteLength":1},{"buffer":0,"byteOffset":172,"byteLength":12}"#;
        c.buffers = r#"{"byteLength":184}"#.into();
        c.binary.extend([6, 0, 0, 0]);
        c.binary.extend([0.5f32, 0.5, 2.5].iter().flat_map(|v| v.to_le_bytes()));
    });
    assert_eq!(load("sparse.glb", &sparse.glb()).unwrap().bounds().max, Vec3::new(0.5, 0.5, 2.5));
    let mut beyond = sparse;
    beyond.binary[168] = 8;
    assert!(refusal("sparse.glb", &beyond.glb()).contains("sparse index 8"));
}

#[test]
fn counts_beyond_the_data_are_refused_before_memory_is_taken() {
    let huge = |from: &str| cube(|c| c.accessors = c.accessors.replace(from, r#""count":2147483648"#));
    for from in [r#""count":8"#, r#""count":36"#] {
        assert!(refusal("bad.glb", &huge(from).glb()).contains("2147483648"));
    }
    assert!(refused(|c| c.accessors = c.accessors.replace(r#""count":8"#, r#""count":9"#)).contains("accessor 0"));
    assert!(refused(|c| c.accessors = c.accessors.replace(r#""count":36"#, r#""count":0"#)).contains("accessor 1"));
    assert!(refused(|c| c.views = c.views.replace("72", "18446744073709551615")).contains("buffer view 1"));
    assert!(refused(|c| c.buffers = r#"{"byteLength":4294967296}"#.into()).contains("buffer 0"));
    let zeros = refused(|c| {
        c.accessors = c.accessors.replacen(r#""bufferView":0,"#, "", 1).replace(r#""count":8"#, r#""count":60000000"#);
    });
    assert!(zeros.contains("without data"), "{zeros}");
}

#[test]
fn references_to_nothing_are_refused_by_name() {
    assert!(refused(|c| c.primitive = r#"{"attributes":{"POSITION":7},"indices":1}"#.into()).contains("accessor 7"));
    assert!(refused(|c| c.primitive = r#"{"attributes":{"POSITION":0},"indices":9}"#.into()).contains("accessor 9"));
    assert!(refused(|c| c.primitive = r#"{"attributes":{"POSITION":0},"material":5}"#.into()).contains("material 5"));
    assert!(refused(|c| c.primitive = r#"{"attributes":{"NORMAL":0}}"#.into()).contains("POSITION"));
    assert!(refused(|c| c.nodes = r#"{"mesh":3}"#.into()).contains("mesh 3"));
    assert!(refused(|c| c.roots = "4".into()).contains("node 4"));
    assert!(
        refused(|c| c.views = r#"{"buffer":2,"byteLength":96},{"buffer":0,"byteLength":72}"#.into())
            .contains("buffer 2")
    );
    assert!(refused(|c| c.binary[96 + 4] = 200).contains("index 200"));
    assert!(refused(|c| c.primitive = r#"{"attributes":{"POSITION":0},"mode":77}"#.into()).contains("mode"));
    assert!(refused(|c| c.accessors = c.accessors.replace("5126", "5999")).contains("accessor 0"));
}

#[test]
fn unknown_required_extensions_are_refused_by_name() {
    let message = refused(|c| c.more = r#""extensionsRequired":["KHR_draco_mesh_compression"],"#.into());
    assert!(message.contains("KHR_draco_mesh_compression") && message.contains("not supported"), "{message}");
    assert!(refusal("old.gltf", br#"{"asset":{"version":"1.0"}}"#).contains("version"));
}

#[test]
fn cyclic_shared_and_deep_nodes_are_refused() {
    assert!(refused(|c| c.nodes = r#"{"mesh":0,"children":[1]},{"children":[0]}"#.into()).contains("cycle"));
    assert!(refused(|c| c.nodes = r#"{"mesh":0,"children":[0]}"#.into()).contains("cycle"));
    assert!(refused(|c| c.nodes = r#"{"children":[1,1]},{"mesh":0}"#.into()).contains("two parents"));
    let chain: String = (1..100_000).map(|i| format!(r#"{{"children":[{i}]}},"#)).collect();
    assert!(refused(|c| c.nodes = chain + r#"{"mesh":0}"#).contains("depth"));
    let nested = "[".repeat(200_000);
    assert!(refusal("deep.gltf", format!(r#"{{"asset":{nested}"#).as_bytes()).contains("JSON"));
}

#[test]
fn nan_vertices_and_bad_matrices_are_refused() {
    let nan = refused(|c| c.binary[12..16].copy_from_slice(&f32::NAN.to_le_bytes()));
    assert!(nan.contains("mesh 0") && nan.contains("not finite"), "{nan}");
    assert!(refused(|c| c.binary[12..16].copy_from_slice(&f32::INFINITY.to_le_bytes())).contains("not finite"));
    assert!(refused(|c| c.binary[12..16].copy_from_slice(&3e38f32.to_le_bytes())).contains("mesh 0"));
    for singular in [
        r#""scale":[1,0,1]"#,
        r#""rotation":[0,0,0,0]"#,
        r#""matrix":[1,0,0,0,0,1,0,0,0,0,0,0,0,0,0,1]"#,
        r#""matrix":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]"#,
        r#""translation":[1e39,0,0]"#,
    ] {
        let message = refused(|c| c.nodes = format!(r#"{{"mesh":0,{singular}}}"#));
        assert!(message.contains("node 0") || message.contains("JSON"), "{singular}: {message}");
    }
}

#[test]
fn limits_hold_over_instances_and_objects() {
    let many: String = (0..50).map(|_| r#"{"mesh":0},"#).collect();
    let sample = Sample::new(
        "many.glb",
        &cube(|c| {
            c.nodes = many.trim_end_matches(',').into();
            c.roots = (0..50).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
        })
        .glb(),
    );
    assert_eq!(sample.load().unwrap().triangle_count(), 600);
    let tight = [
        Limits { triangles: 599, ..Limits::default() },
        Limits { instances: 49, ..Limits::default() },
        Limits { nodes: 49, ..Limits::default() },
        Limits { json_objects: 50, ..Limits::default() },
        Limits { file_bytes: 100, ..Limits::default() },
        Limits { vertices: 1, triangles: 1, ..Limits::default() },
    ];
    for limits in tight {
        let error = load_file(&sample.path, &limits).unwrap_err();
        assert!(matches!(error.kind, SceneErrorKind::TooLarge { .. }), "{error}");
    }
}

#[test]
fn files_outside_the_folder_are_refused() {
    for uri in [
        "../cube.bin",
        "%2e%2e/cube.bin",
        "/etc/hostname",
        "file:///etc/hostname",
        "http://localhost/cube.bin",
        "cube%00.bin",
    ] {
        let json = cube(|c| c.buffers = format!(r#"{{"byteLength":1,"uri":"{uri}"}}"#)).json();
        let error = load("out.gltf", json.as_bytes()).unwrap_err();
        assert!(matches!(error.kind, SceneErrorKind::Forbidden { .. }), "{uri}: {error}");
        assert_eq!(error.element, "buffer 0");
    }
}
