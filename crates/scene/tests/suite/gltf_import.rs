//! Import of glTF: valid content is kept and invalid content is refused.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4};

use glam::Vec3;
use scene::{Light, LightSpec, Limits, MissingTextures, Scene, SceneErrorKind, load_file};

use crate::samples::warnings::with_warnings;
use crate::samples::{
    CUBE_CORNERS, GltfCube, Sample, cube, cube_buffer, cube_triangles, load, refusal, signed_volume, world_triangles,
};

fn refused(change: impl FnOnce(&mut GltfCube)) -> String {
    refusal("bad.glb", &cube(change).glb())
}

#[test]
fn a_cube_has_twelve_flat_triangles_in_place() {
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
fn materials_keep_the_factors_of_the_model() {
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
    assert!(scene.materials[1].alpha_hashed && !m.alpha_hashed);
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
    let scene = load(
        "l.glb",
        &cube(|c| {
            c.more = r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional","intensity":3.1415927},
            {"type":"spot","color":[1,0,0],"range":2,"spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}},
            {"type":"point"},{"type":"spot"}]}},"cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.1}},
            {"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"zfar":2,"znear":1}}],"#
                .into();
            c.nodes += r#",{"extensions":{"KHR_lights_punctual":{"light":0}},"rotation":[-0.70710678,0,0,0.70710678]},
            {"extensions":{"KHR_lights_punctual":{"light":1}},"translation":[1,2,3],"scale":[2,2,2]},
            {"camera":0,"name":"eye","translation":[0,0,5],"scale":[3,3,3]},{"camera":1},
            {"extensions":{"KHR_lights_punctual":{"light":2}},"translation":[0,4,0]},
            {"extensions":{"KHR_lights_punctual":{"light":3}},"translation":[0,-4,0]}"#;
            c.roots = "0,1,2,3,4,5,6".into();
        })
        .glb(),
    )
    .unwrap();
    let lights = &scene.illumination.lights;
    let find = |is_it: fn(&Light) -> bool| *lights.iter().find(|l| is_it(l)).unwrap();
    let Light::Directional { towards_light_in_world: towards, irradiance_linear, angular_radius_rad } =
        find(|l| matches!(l, Light::Directional { .. }))
    else {
        unreachable!()
    };
    assert!(towards.distance(Vec3::Y) < 1e-5 && irradiance_linear.distance(Vec3::ONE) < 1e-5, "{towards}");
    assert_eq!(angular_radius_rad, 0.0, "a file's lights have no extent");
    let spot = Light::Spot {
        position_in_world: Vec3::new(1.0, 2.0, 3.0),
        forward_in_world: Vec3::NEG_Z,
        intensity_linear: Vec3::X * FRAC_1_PI,
        inner_cone_rad: 0.25,
        outer_cone_rad: 0.5,
        radius_m: 0.0,
    };
    assert!(lights.contains(&spot), "{lights:?}");
    let point =
        Light::Point { position_in_world: Vec3::Y * 4.0, intensity_linear: Vec3::splat(FRAC_1_PI), radius_m: 0.0 };
    assert!(lights.contains(&point), "{lights:?}");
    let wide = |l: &Light| matches!(l, Light::Spot { outer_cone_rad, .. } if *outer_cone_rad == FRAC_PI_4);
    assert!(lights.iter().any(wide), "the extension's cones where the file gives none");
    assert_eq!((scene.cameras.len(), scene.cameras[0].name.as_str(), scene.cameras[0].fov_y_rad), (1, "eye", 1.0));
    let pose = scene.cameras[0].world_from_camera;
    assert_eq!((pose.translation.z, pose.matrix3.determinant()), (5.0, 1.0));
}

/// A cube lit by a sun and, three metres from its middle, a lamp.
fn sun_and_lamp(sun: &str, lamp: &str) -> GltfCube {
    cube(|c| {
        c.more = format!(r#""extensions":{{"KHR_lights_punctual":{{"lights":[{{{sun}}},{{{lamp}}}]}}}},"#);
        c.nodes += r#",{"extensions":{"KHR_lights_punctual":{"light":0}}},
            {"extensions":{"KHR_lights_punctual":{"light":1}},"translation":[0,3,0]}"#;
        c.roots = "0,1,2".into();
    })
}

/// Irradiance of the sun and intensity of the lamp.
fn colors(scene: &Scene) -> [Vec3; 2] {
    let mut colors = [Vec3::NAN; 2];
    for light in &scene.illumination.lights {
        match *light {
            Light::Directional { irradiance_linear, .. } => colors[0] = irradiance_linear,
            Light::Point { intensity_linear, .. } => colors[1] = intensity_linear,
            _ => panic!("{light:?}"),
        }
    }
    colors
}

#[test]
fn lights_of_any_unit_are_exposed_and_keep_their_ratios() {
    let read = |sun_lux: f64, lamp_candela: f64| {
        let sun = format!(r#""type":"directional","intensity":{sun_lux}"#);
        let lamp = format!(r#""type":"point","color":[1,0.5,0.25],"intensity":{lamp_candela}"#);
        colors(&load("lit.glb", &sun_and_lamp(&sun, &lamp).glb()).unwrap())
    };
    for (sun_lux, lamp_candela) in
        [(100_000.0, 2_718.0), (1e-3, 5e-3), (0.0, 54_351.4), (1e38, 1e30), (1e-38, 0.0), (3.0, 4_000.0)]
    {
        let [sun, lamp] = read(sun_lux, lamp_candela);
        let arriving = sun.x + lamp.x / 9.0;
        assert!((arriving - 1.0).abs() < 1e-4, "{sun_lux} {lamp_candela}: {arriving}");
        let cross = f64::from(sun.x) * lamp_candela - f64::from(lamp.x) * sun_lux;
        assert!(cross.abs() <= 1e-5 * sun_lux.max(lamp_candela), "{sun_lux} {lamp_candela}: {sun} {lamp}");
        assert!(lamp.x == 0.0 || lamp.distance(lamp.x * Vec3::new(1.0, 0.5, 0.25)) < 1e-5 * lamp.x);
    }
    // Lights within two stops of white, and a scene without light, stay unchanged.
    for (sun_lux, lamp_candela) in [(3.0, 1.0), (9.0, 9.0), (1.0, 0.0), (0.0, 0.0)] {
        let [sun, lamp] = read(sun_lux, lamp_candela);
        assert_eq!((sun.x, lamp.x), (sun_lux as f32 * FRAC_1_PI, lamp_candela as f32 * FRAC_1_PI));
    }
}

#[test]
fn a_lamp_in_the_middle_does_not_darken_the_rest() {
    let inside = cube(|c| {
        c.more = r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":1}]}},"#.into();
        c.nodes += r#",{"extensions":{"KHR_lights_punctual":{"light":0}}}"#;
        c.roots = "0,1".into();
    });
    let scene = load("inside.glb", &inside.glb()).unwrap();
    let Light::Point { intensity_linear, .. } = scene.illumination.lights[0] else { panic!() };
    assert_eq!(intensity_linear, Vec3::splat(FRAC_1_PI));
}

#[test]
fn lights_move_with_the_origin() {
    let far = cube(|c| {
        c.more = r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot"}]}},"#.into();
        c.nodes = r#"{"translation":[2684572,0,0],"children":[1,2]},{"mesh":0},
            {"extensions":{"KHR_lights_punctual":{"light":0}},"translation":[0,1.125,0]}"#
            .into();
    });
    let scene = load("far.glb", &far.glb()).unwrap();
    assert_eq!(scene.source_space.origin_in_source.x, 2_684_572.0);
    let place = |light: &Light| match *light {
        Light::Spot { position_in_world, .. } | Light::Point { position_in_world, .. } => position_in_world,
        _ => panic!("{light:?}"),
    };
    assert_eq!(place(&scene.illumination.lights[0]), Vec3::Y * 1.125);
    let spec: LightSpec = "point at=2684572,2.5,0".parse().unwrap();
    let relit = scene.lit_by(Some(vec![spec.0]), None);
    assert_eq!(place(&relit.illumination.lights[0]), Vec3::Y * 2.5);
}

#[test]
fn invalid_lights_are_refused_by_file_light_and_field() {
    let sun = r#""type":"directional""#;
    let cases = [
        (r#""type":"point","intensity":1e39"#, "light 1: intensity"),
        (r#""type":"point","color":[1,1e39,0]"#, "light 1: color"),
        (r#""type":"point","color":[1e30,1,1],"intensity":1e30"#, "light 1: intensity"),
        (r#""type":"spot","spot":{"outerConeAngle":1e39}"#, "light 1: spot.outerConeAngle"),
        (r#""type":"spot","spot":{"outerConeAngle":1.7}"#, "light 1: spot.outerConeAngle"),
        (r#""type":"spot","spot":{"outerConeAngle":-0.1}"#, "light 1: spot.outerConeAngle"),
        (r#""type":"spot","spot":{"innerConeAngle":0.6,"outerConeAngle":0.5}"#, "light 1: spot.innerConeAngle"),
        (r#""type":"spot","spot":{"innerConeAngle":-1}"#, "light 1: spot.innerConeAngle"),
        (r#""type":"area""#, "light 1"),
        (r#""type":"point","intensity":NaN"#, "JSON"),
        (r#""intensity":1"#, "JSON"),
    ];
    for (lamp, element) in cases {
        let error = load("bad.glb", &sun_and_lamp(sun, lamp).glb()).unwrap_err();
        assert_eq!(error.element, element, "{lamp}: {error}");
        assert!(error.to_string().contains("bad.glb"), "{error}");
    }
    assert!(
        refused(|c| c.nodes = r#"{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":3}}}"#.into())
            .contains("node 0")
    );
    // Ninety degrees, rounded up by its writer.
    assert!(load("wide.glb", &sun_and_lamp(sun, r#""type":"spot","spot":{"outerConeAngle":1.5708}"#).glb()).is_ok());
}

#[test]
fn more_lights_than_the_limit_are_refused() {
    let sample = Sample::new("lit.glb", &sun_and_lamp(r#""type":"directional""#, r#""type":"point""#).glb());
    assert_eq!(sample.load().unwrap().illumination.lights.len(), 2);
    let error =
        load_file(&sample.path, &Limits { lights: 1, ..Limits::default() }, MissingTextures::Refuse).unwrap_err();
    assert!(matches!(error.kind, SceneErrorKind::TooLarge { actual: 2, limit: 1 }), "{error}");
}

#[test]
fn factors_out_of_range_are_clamped_and_infinite_ones_refused() {
    let material = |members: &str| {
        let material = format!(r#""materials":[{{"alphaMode":"MASK",{members}}}],"#);
        load("m.glb", &cube(|c| c.more = material).glb())
    };
    let pbr = r#""metallicFactor":2,"roughnessFactor":-1,"baseColorFactor":[-0.5,0.5,1.5,2]"#;
    let scene =
        material(&format!(r#""pbrMetallicRoughness":{{{pbr}}},"emissiveFactor":[-1,0.5,3],"alphaCutoff":-0.25"#));
    let m = &scene.unwrap().materials[0];
    assert_eq!((m.metallic, m.roughness, m.base_color_linear), (1.0, 0.0, [0.0, 0.5, 1.0, 1.0]));
    assert_eq!((m.emissive_linear, m.alpha_cutoff), (Vec3::new(0.0, 0.5, 3.0), 0.0));
    for (members, element) in [
        (r#""pbrMetallicRoughness":{"metallicFactor":1e39}"#, "material 0: metallic"),
        (r#""pbrMetallicRoughness":{"roughnessFactor":-1e39}"#, "material 0: roughness"),
        (r#""pbrMetallicRoughness":{"baseColorFactor":[0,0,1e39,1]}"#, "material 0: base colour"),
        (r#""emissiveFactor":[1e39,0,0]"#, "material 0: emissive colour"),
        (r#""alphaCutoff":1e39"#, "material 0: alpha cutoff"),
        (r#""pbrMetallicRoughness":{"metallicFactor":NaN}"#, "JSON"),
    ] {
        let error = material(members).unwrap_err();
        assert_eq!(error.element, element, "{error}");
    }
}

#[test]
fn triangles_without_area_are_kept_with_unit_normals() {
    // Corner 0 thrice, an edge there and back, and the cube's own after them.
    let flat: Vec<u16> = [0, 0, 0, 1, 2, 1].into_iter().chain(cube_triangles().into_iter().map(|i| i as u16)).collect();
    let with = |attributes: &str| {
        cube(|c| {
            c.primitive = format!(r#"{{"attributes":{{"POSITION":0{attributes}}},"indices":1}}"#);
            c.accessors = c.accessors.replace(r#""count":36"#, r#""count":42"#)
                + r#",{"bufferView":2,"componentType":5126,"count":8,"type":"VEC3"}"#;
            c.views = r#"{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":84},
                {"buffer":0,"byteOffset":180,"byteLength":96}"#
                .into();
            c.buffers = r#"{"byteLength":276}"#.into();
            c.binary.truncate(96);
            c.binary.extend(flat.iter().flat_map(|i| i.to_le_bytes()));
            c.binary.resize(276, 0);
        })
    };
    // Without normals, and with normals that are all zero.
    for attributes in ["", r#","NORMAL":2"#] {
        let scene = load("flat.glb", &with(attributes).glb()).unwrap();
        assert_eq!(scene.triangle_count(), 14);
        let unit = |v: &scene::Vertex| (Vec3::from(v.normal).length() - 1.0).abs() < 1e-5;
        assert!(scene.meshes[0].vertices.iter().all(unit));
    }
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
fn counts_beyond_the_data_are_refused_before_allocation() {
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
fn dangling_references_are_refused_by_name() {
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
fn other_versions_are_refused() {
    let first = "glTF version 1.0; `npx gltf-pipeline -i IN -o OUT` converts";
    assert!(refusal("old.gltf", br#"{"asset":{"version":"1.0"}}"#).contains(first));
    assert!(refusal("old.gltf", br#"{"asset":{"generator":"x"},"meshes":{"a":{}}}"#).contains(first));
    let mut old = cube(|_| {}).glb();
    old[4] = 1;
    assert!(refusal("old.glb", &old).contains(first));
}

#[test]
fn cyclic_shared_and_deep_nodes_are_refused() {
    assert!(refused(|c| c.nodes = r#"{"mesh":0,"children":[1]},{"children":[0]}"#.into()).contains("cycle"));
    assert!(refused(|c| c.nodes = r#"{"mesh":0,"children":[0]}"#.into()).contains("cycle"));
    assert!(refused(|c| c.nodes = r#"{"children":[1,1]},{"mesh":0}"#.into()).contains("two parents"));
    let chain: String = (1..20_000).map(|i| format!(r#"{{"children":[{i}]}},"#)).collect();
    assert!(refused(|c| c.nodes = chain + r#"{"mesh":0}"#).contains("depth"));
    let nested = "[".repeat(200_000);
    assert!(refusal("deep.gltf", format!(r#"{{"asset":{nested}"#).as_bytes()).contains("JSON"));
}

#[test]
fn nan_vertices_and_bad_matrices_are_refused() {
    let nan = refused(|c| c.binary[12..16].copy_from_slice(&f32::NAN.to_le_bytes()));
    assert!(nan.contains("mesh 0") && nan.contains("not finite"), "{nan}");
    assert!(refused(|c| c.binary[12..16].copy_from_slice(&f32::INFINITY.to_le_bytes())).contains("not finite"));
    assert!(refused(|c| c.binary[12..16].copy_from_slice(&3e38f32.to_le_bytes())).contains("extent"));
    for singular in
        [r#""rotation":[0,0,0,0]"#, r#""matrix":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]"#, r#""translation":[1e39,0,0]"#]
    {
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
        let error = load_file(&sample.path, &limits, MissingTextures::Refuse).unwrap_err();
        assert!(matches!(error.kind, SceneErrorKind::TooLarge { .. }), "{error}");
    }
}

#[test]
fn a_large_mesh_in_many_flat_nodes_is_refused_before_it_is_copied() {
    const TRIANGLES: usize = 50_000;
    const NODES: usize = 4000;
    let flat = cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0,"NORMAL":0},"indices":1}"#.into();
        c.accessors = c.accessors.replace("5123", "5121").replace("36", &(3 * TRIANGLES).to_string());
        c.views = c.views.replace("72", &(3 * TRIANGLES).to_string());
        c.buffers = format!(r#"{{"byteLength":{}}}"#, 96 + 3 * TRIANGLES);
        c.binary.truncate(96);
        c.binary.extend([0, 1, 2].repeat(TRIANGLES));
        c.nodes = [r#"{"mesh":0,"scale":[1,1,0]}"#; NODES].join(",");
        c.roots = (0..NODES).map(|node| node.to_string()).collect::<Vec<_>>().join(",");
    });
    let message = refusal("flat.glb", &flat.glb());
    assert!(message.contains("triangles of flattened meshes: 64050000 is over"), "{message}");
}

#[test]
fn lines_and_orthographic_cameras_are_left_out_with_a_warning() {
    let with_lines = cube(|c| {
        c.primitive += r#",{"attributes":{"POSITION":0},"mode":1},{"attributes":{"POSITION":0},"mode":0}"#;
        c.more = r#""cameras":[{"type":"orthographic","name":"plan","orthographic":{"xmag":1,"ymag":1,"zfar":2,"znear":1}}],"#
            .into();
        c.nodes += r#",{"camera":0}"#;
        c.roots = "0,1".into();
    });
    let (scene, warnings) = with_warnings(|| load("a.glb", &with_lines.glb()).unwrap());
    assert_eq!((scene.triangle_count(), scene.cameras.len(), warnings.len()), (12, 0, 2), "{warnings:?}");
    let warnings = warnings.join("\n");
    assert!(warnings.contains("points and lines are left out: 2, the first: mesh 0, primitive 1"), "{warnings}");
    assert!(warnings.contains("orthographic cameras are left out: node 1, camera \"plan\""), "{warnings}");
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

#[test]
fn quantized_positions_and_coordinates_are_those_of_their_floats() {
    // Positions from -1 to 1 in 16 bits, padded to four each; a node scales them back.
    let code = |c: &f32| (c * 2.0 * 32767.0) as i16;
    let positions = CUBE_CORNERS.iter().flat_map(|corner| [code(&corner[0]), code(&corner[1]), code(&corner[2]), 0]);
    let mut binary: Vec<u8> = positions.flat_map(i16::to_le_bytes).collect();
    binary.extend(cube_triangles().iter().flat_map(|index| (*index as u16).to_le_bytes()));
    let quantized = cube(|c| {
        c.more = r#""extensionsRequired":["KHR_mesh_quantization"],"#.into();
        c.nodes = r#"{"mesh":0,"scale":[0.5,0.5,0.5]}"#.into();
        c.accessors = concat!(
            r#"{"bufferView":0,"componentType":5122,"normalized":true,"count":8,"type":"VEC3"},"#,
            r#"{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}"#
        )
        .into();
        c.views = r#"{"buffer":0,"byteLength":64,"byteStride":8},{"buffer":0,"byteOffset":64,"byteLength":72}"#.into();
        c.buffers = r#"{"byteLength":136}"#.into();
        c.binary = binary;
    });
    let scene = load("quantized.glb", &quantized.glb()).unwrap();
    assert_eq!((scene.bounds().min, scene.bounds().max), (Vec3::splat(-0.5), Vec3::splat(0.5)));
    assert!((signed_volume(&scene) - 1.0).abs() < 1e-6);
}
