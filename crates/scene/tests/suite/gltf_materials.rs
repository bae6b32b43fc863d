//! Materials of glTF: textures with coordinates and wrap modes of their own, tangents, reflectance and blending.

use glam::{Vec2, Vec3};
use scene::{Limits, Material, Mesh, Scene, TextureUse, Volume, Wrap};

use crate::samples::warnings::with_warnings;
use crate::samples::{GltfCube, cube, load, refusal};

/// A square that faces +Z, whose u runs along X and v along -Y; the second coordinates are twice the first.
fn square(material: &str, more: &str) -> GltfCube {
    let corners = [[-1f32, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let floats = |values: Vec<f32>| values.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let uv = |[x, y, _]: [f32; 3]| [x * 0.5 + 0.5, 0.5 - y * 0.5];
    let mut binary = floats(corners.concat());
    binary.extend(floats(corners.iter().flat_map(|c| uv(*c)).collect()));
    binary.extend(floats(corners.iter().flat_map(|c| uv(*c).map(|v| v * 2.0)).collect()));
    binary.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    binary.extend(floats([0.0, 1.0, 0.0, -1.0].repeat(4)));
    binary.extend(floats([0.0, 0.0, 1.0].repeat(4)));
    let png = |rgba: [u8; 4]| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbaImage::from_pixel(1, 1, image::Rgba(rgba)).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let hex: String = bytes.get_ref().iter().map(|b| format!("%{b:02x}")).collect();
        format!(r#"{{"uri":"data:image/png,{hex}"}}"#)
    };
    cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2},"indices":3,"material":0}"#.into();
        c.accessors = [
            (0, 5126, 4, "VEC3"),
            (1, 5126, 4, "VEC2"),
            (2, 5126, 4, "VEC2"),
            (3, 5123, 6, "SCALAR"),
            (4, 5126, 4, "VEC4"),
            (5, 5126, 4, "VEC3"),
        ]
        .map(|(view, ty, count, shape)| {
            format!(r#"{{"bufferView":{view},"componentType":{ty},"count":{count},"type":"{shape}"}}"#)
        })
        .join(",");
        c.views = [(0, 48), (48, 32), (80, 32), (112, 12), (124, 64), (188, 48)]
            .map(|(offset, length)| format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}}}"#))
            .join(",");
        c.buffers = r#"{"byteLength":236}"#.into();
        c.binary = binary;
        let images = [png([188, 255, 0, 51]), png([255, 51, 102, 255])].join(",");
        c.more = format!(
            r#"{more}"textures":[{{"source":0}},{{"source":1,"sampler":0}},{{"source":1,"sampler":1}}],"images":[{images}],
            "samplers":[{{"wrapS":33071,"wrapT":33648}},{{}}],"materials":[{{{material}}}],"#
        );
    })
}

fn loaded(material: &str) -> Scene {
    load("square.glb", &square(material, "").glb()).unwrap()
}

fn only(scene: &Scene) -> (&Material, &Mesh) {
    (&scene.materials[0], &scene.meshes[0])
}

#[test]
fn each_texture_has_its_coordinates_and_wrap_modes() {
    let scene = loaded(
        r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":1,"texCoord":1}},
        "occlusionTexture":{"index":2,"texCoord":1,"strength":0.75},"emissiveTexture":{"index":1},"emissiveFactor":[0.5,1,1]"#,
    );
    let (m, mesh) = only(&scene);
    let repeated = [Wrap::Repeat; 2];
    assert_eq!(m.base_color_texture, Some(TextureUse { texture: 0, second_uv: false, wrap: repeated }));
    let clamped = TextureUse { texture: 1, second_uv: true, wrap: [Wrap::Clamp, Wrap::Mirror] };
    assert_eq!(m.metallic_roughness_texture, Some(clamped));
    assert_eq!(m.occlusion_texture, Some(TextureUse { wrap: repeated, ..clamped }), "one image of data, two samplers");
    assert_eq!((m.occlusion_strength, m.normal_texture), (0.75, None));
    let colors = m.emissive_texture.unwrap();
    assert!(!colors.second_uv && scene.textures[colors.texture as usize].is_srgb);
    assert_eq!(m.emissive_linear, Vec3::new(0.5, 1.0, 1.0), "the texture is no part of the factor");
    for (vertex, detail) in mesh.vertices.iter().zip(&mesh.details) {
        assert_eq!(Vec2::from(detail.uv), Vec2::from(vertex.uv) * 2.0);
    }
    assert_eq!(mesh.details.len(), mesh.vertices.len());
}

#[test]
fn a_third_kind_of_coordinates_leaves_means() {
    let scaled = |scale: u32| format!(r#""extensions":{{"KHR_texture_transform":{{"scale":[{scale},{scale}]}}}}"#);
    let scene = loaded(&format!(
        r#""pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},"roughnessFactor":0.5,
        "metallicRoughnessTexture":{{"index":1,{}}}}},"emissiveFactor":[1,1,1],"emissiveTexture":{{"index":0,"texCoord":1}},
        "normalTexture":{{"index":1,{}}},"occlusionTexture":{{"index":1,{}}}"#,
        scaled(3),
        scaled(2),
        scaled(2)
    ));
    let (m, mesh) = only(&scene);
    assert!(m.base_color_texture.is_some() && m.metallic_roughness_texture.unwrap().second_uv);
    assert_eq!((m.normal_texture, m.occlusion_texture, m.emissive_texture), (None, None, None));
    assert!((m.emissive_linear.x - 0.5).abs() < 0.01 && m.emissive_linear.y == 1.0, "{}", m.emissive_linear);
    for (vertex, detail) in mesh.vertices.iter().zip(&mesh.details) {
        assert!(Vec2::from(detail.uv).distance(Vec2::from(vertex.uv) * 3.0) < 1e-6);
    }
    // Metallic and roughness do the same where they come third.
    let scene = loaded(&format!(
        r#""pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},"metallicRoughnessTexture":{{"index":1,"texCoord":1}}}},
        "normalTexture":{{"index":1,{}}}"#,
        scaled(2)
    ));
    assert!(scene.materials[0].normal_texture.is_none() && scene.materials[0].metallic_roughness_texture.is_some());
}

#[test]
fn textures_without_coordinates_are_warned_of() {
    let textured =
        r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"emissiveTexture":{"index":1,"texCoord":1}"#;
    let without = |material: &str, attributes: &str| {
        let mut square = square(material, "");
        square.primitive = square.primitive.replace(attributes, "");
        with_warnings(|| load("square.glb", &square.glb()).unwrap()).1
    };
    assert!(without(textured, "").is_empty());
    assert!(without("", r#","TEXCOORD_0":1,"TEXCOORD_1":2"#).is_empty(), "a material without textures needs none");
    let warnings = without(textured, r#","TEXCOORD_0":1,"TEXCOORD_1":2"#);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let expected = "textures without coordinates show one texel: 2, the first: mesh 0, primitive 0, TEXCOORD_0";
    assert!(warnings[0].contains(expected), "{warnings:?}");
    assert!(without(textured, r#","TEXCOORD_1":2"#)[0].contains("primitive 0, TEXCOORD_1"));
}

#[test]
fn tangents_run_along_u_and_bitangents_against_v() {
    for (more, along) in
        [("", 1.0), (r#","texCoord":1"#, 1.0), (r#","extensions":{"KHR_texture_transform":{"scale":[-1,1]}}"#, -1.0)]
    {
        let scene = loaded(&format!(r#""normalTexture":{{"index":1,"scale":0.5{more}}}"#));
        let (m, mesh) = only(&scene);
        assert!(m.normal_texture.is_some() && m.normal_scale == 0.5);
        for (vertex, detail) in mesh.vertices.iter().zip(&mesh.details) {
            let [x, y, z, sign] = detail.tangent;
            let tangent = Vec3::new(x, y, z);
            assert!(tangent.distance(Vec3::X * along) < 1e-5, "{more}: {detail:?}");
            let bitangent = sign * Vec3::from(vertex.normal).cross(tangent);
            assert!(bitangent.distance(Vec3::Y) < 1e-5, "{more}: {bitangent}");
        }
    }
}

#[test]
fn corners_of_one_vertex_with_other_tangents_get_vertices_of_their_own() {
    // The second triangle's u runs the other way: corner 3's is mirrored, which needs another bitangent's sign.
    let mut square = square(r#""normalTexture":{"index":1}"#, "");
    for (corner, uv) in [(0, [0f32, 0.0]), (1, [0.0, 1.0]), (2, [1.0, 1.0]), (3, [0.0, 1.0])] {
        let bytes: Vec<u8> = uv.iter().flat_map(|c| c.to_le_bytes()).collect();
        square.binary[48 + corner * 8..][..8].copy_from_slice(&bytes);
    }
    let scene = load("seam.glb", &square.glb()).unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.vertices.len(), mesh.details.len(), mesh.triangle_count()), (6, 6, 2));
    let sign = |corner: usize| mesh.details[mesh.indices[corner] as usize].tangent[3];
    assert!((0..3).all(|i| sign(i) == sign(0)) && (3..6).all(|i| sign(i) == -sign(0)));
}

#[test]
fn given_tangents_are_kept_where_normals_are_given_too() {
    let with = |attributes: &str| {
        let mut square = square(r#""normalTexture":{"index":1}"#, "");
        square.primitive = square.primitive.replace(r#""TEXCOORD_1":2"#, &format!(r#""TEXCOORD_1":2{attributes}"#));
        load("given.glb", &square.glb()).unwrap().meshes[0].details[0].tangent
    };
    assert_eq!(with(r#","TANGENT":4,"NORMAL":5"#), [0.0, 1.0, 0.0, -1.0]);
    // glTF 2.0, 3.7.2.1: without normals they do not count.
    assert_eq!(with(r#","TANGENT":4"#), [1.0, 0.0, 0.0, 1.0]);
}

#[test]
fn a_mirrored_placement_keeps_the_bitangent() {
    let mut mirrored = square(r#""normalTexture":{"index":1}"#, "");
    mirrored.nodes = r#"{"mesh":0,"scale":[-1,1,1]}"#.into();
    let scene = load("mirrored.glb", &mirrored.glb()).unwrap();
    let instance = &scene.instances[0];
    let mesh = &scene.meshes[instance.mesh as usize];
    for (vertex, detail) in mesh.vertices.iter().zip(&mesh.details) {
        let [x, y, z, sign] = detail.tangent;
        let tangent = instance.world_from_mesh.transform_vector3(Vec3::new(x, y, z));
        let normal = instance.world_from_mesh.transform_vector3(vertex.normal.into());
        assert!(tangent.distance(Vec3::NEG_X) < 1e-5 && (sign * normal.cross(tangent)).distance(Vec3::Y) < 1e-5);
    }
}

#[test]
fn reflectance_follows_ior_and_specular() {
    let reflectance = |extensions: &str| {
        loaded(&format!(r#""extensions":{{{extensions}}}"#)).materials[0].dielectric_reflectance_linear
    };
    let near = |extensions: &str, wanted: Vec3| {
        let got = reflectance(extensions);
        assert!(got.distance(wanted) < 2e-3, "{extensions}: {got}, not {wanted}");
    };
    near("", Vec3::splat(0.04));
    near(r#""KHR_materials_ior":{"ior":1.5}"#, Vec3::splat(0.04));
    near(r#""KHR_materials_ior":{"ior":2}"#, Vec3::splat(1.0 / 9.0));
    near(r#""KHR_materials_ior":{"ior":1}"#, Vec3::ZERO);
    near(r#""KHR_materials_ior":{"ior":0}"#, Vec3::ONE);
    near(r#""KHR_materials_specular":{"specularFactor":0.5}"#, Vec3::splat(0.02));
    near(r#""KHR_materials_specular":{"specularColorFactor":[1,0.5,100]}"#, Vec3::new(0.04, 0.02, 1.0));
    // The texture's alpha is 51/255, and its colour 0.5, 1 and 0.
    near(r#""KHR_materials_specular":{"specularTexture":{"index":0}}"#, Vec3::splat(0.008));
    near(r#""KHR_materials_specular":{"specularColorTexture":{"index":0}}"#, Vec3::new(0.02, 0.04, 0.0));
    let mirror = r#""KHR_materials_specular":{"specularFactor":0.5},"KHR_materials_ior":{"ior":2}"#;
    near(mirror, Vec3::splat(1.0 / 18.0));
    let scene = loaded(
        r#""extensions":{"KHR_materials_specular":{"specularFactor":0}},"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.1}"#,
    );
    assert!(!scene.materials[0].is_specular());
}

fn glass(extensions: &str) -> Scene {
    loaded(&format!(
        r#""pbrMetallicRoughness":{{"metallicFactor":0}},
        "extensions":{{"KHR_materials_transmission":{{"transmissionFactor":0.9}}{extensions}}}"#
    ))
}

#[test]
fn glass_has_its_transmission_index_and_volume() {
    let thin = &glass("").materials[0];
    assert_eq!((thin.transmission, thin.ior, thin.volume), (0.9, 1.5, None));
    assert!(thin.is_transmissive() && thin.is_specular() && !thin.has_two_sides());
    let ior = r#","KHR_materials_ior":{"ior":1.33}"#;
    assert_eq!(glass(ior).materials[0].ior, 1.33);
    let volume = |members: &str| glass(&format!(r#","KHR_materials_volume":{{{members}}}"#)).materials[0].volume;
    assert_eq!(volume(r#""attenuationDistance":2"#), None, "a thickness of 0 is a thin surface");
    assert_eq!(volume(r#""thicknessFactor":0.1"#), Some(Volume::CLEAR));
    let colored = volume(r#""thicknessFactor":0.1,"attenuationDistance":0.5,"attenuationColor":[1,0.5,0.25]"#).unwrap();
    let expected = Volume { attenuation_color_linear: Vec3::new(1.0, 0.5, 0.25), attenuation_distance_m: 0.5 };
    assert_eq!(colored, expected);
    let through_half_a_metre = (-colored.absorption_per_m() * 0.5).exp();
    assert!(through_half_a_metre.distance(expected.attenuation_color_linear) < 1e-6, "{through_half_a_metre}");
    assert!(glass(r#","KHR_materials_volume":{"thicknessFactor":0.1}"#).materials[0].has_two_sides());
    // Opaque surfaces have neither, and a metal transmits nothing.
    let opaque = loaded(r#""extensions":{"KHR_materials_volume":{"thicknessFactor":1},"KHR_materials_ior":{"ior":2}}"#);
    assert_eq!((opaque.materials[0].transmission, opaque.materials[0].volume), (0.0, None));
    assert!(!Material { metallic: 1.0, ..thin.clone() }.is_transmissive());
    assert!(!Material { unlit: true, ..thin.clone() }.is_transmissive());
}

#[test]
fn a_texture_of_transmission_counts_by_its_mean() {
    let material =
        r#""extensions":{"KHR_materials_transmission":{"transmissionFactor":0.5,"transmissionTexture":{"index":0}}}"#;
    let (scene, warnings) = with_warnings(|| loaded(material));
    let expected = 0.5 * 188.0 / 255.0;
    assert!((scene.materials[0].transmission - expected).abs() < 1e-4, "{}", scene.materials[0].transmission);
    assert!(warnings.iter().any(|w| w.contains("textures of transmission count by their mean")), "{warnings:?}");
    assert!(scene.textures.is_empty(), "no surface shows it");
}

#[test]
fn bad_glass_is_refused_by_material_field_and_reason() {
    let message = |extensions: &str| {
        let material =
            format!(r#""extensions":{{"KHR_materials_transmission":{{"transmissionFactor":0.9}}{extensions}}}"#);
        refusal("bad.glb", &square(&material, "").glb())
    };
    for (ior, reason) in [
        ("0.99", "material 0: ior: 0.99 is not from 1 to 4"),
        ("0", "material 0: ior: 0 is not from 1 to 4"),
        ("4.01", "material 0: ior: 4.01 is not from 1 to 4"),
        ("-1.5", "material 0: ior: -1.5 is not from 1 to 4"),
        ("1e39", "material 0: ior: not finite"),
    ] {
        let got = message(&format!(r#","KHR_materials_ior":{{"ior":{ior}}}"#));
        assert!(got.contains(&format!("bad.glb: {reason}")), "{ior}: {got}");
    }
    let volume = |members: &str| message(&format!(r#","KHR_materials_volume":{{{members}}}"#));
    assert!(volume(r#""thicknessFactor":-1"#).contains("material 0: thickness: -1 is negative"));
    let distance = volume(r#""thicknessFactor":1,"attenuationDistance":-0.5"#);
    assert!(distance.contains("material 0: attenuation distance: -0.5 is negative"), "{distance}");
    let color = volume(r#""thicknessFactor":1,"attenuationColor":[1e39,0,0]"#);
    assert!(color.contains("material 0: attenuation colour: not finite"), "{color}");
    let factor = r#""extensions":{"KHR_materials_transmission":{"transmissionFactor":1e39}}"#;
    assert!(refusal("bad.glb", &square(factor, "").glb()).contains("material 0: transmission: not finite"));
    let texture = r#""extensions":{"KHR_materials_transmission":{"transmissionTexture":{"index":9}}}"#;
    assert!(refusal("bad.glb", &square(texture, "").glb()).contains("material 0: texture 9"));
}

#[test]
fn glass_out_of_range_is_clamped_where_a_near_value_makes_sense() {
    let factor = |factor: &str| {
        let json = format!(r#""extensions":{{"KHR_materials_transmission":{{"transmissionFactor":{factor}}}}}"#);
        loaded(&json).materials[0].transmission
    };
    assert_eq!((factor("1.01"), factor("-0.01")), (1.0, 0.0));
    let clear = glass(r#","KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":0}"#);
    assert_eq!(clear.materials[0].volume, Some(Volume::CLEAR));
}

#[test]
fn a_scene_with_bad_glass_is_not_valid() {
    let scene = glass(r#","KHR_materials_volume":{"thicknessFactor":0.1}"#);
    assert_eq!(scene::unpack(&scene::pack(&scene), &Limits::default()).unwrap(), scene);
    let refused = |change: fn(&mut Material)| {
        let mut scene = scene.clone();
        change(&mut scene.materials[0]);
        let message = scene::unpack(&scene::pack(&scene), &Limits::default()).unwrap_err().to_string();
        assert!(message.contains("package: material 0: "), "{message}");
        message
    };
    assert!(refused(|m| m.transmission = -0.1).contains("transmission is not from 0 to 1"));
    assert!(refused(|m| m.transmission = f32::NAN).contains("transmission is not from 0 to 1"));
    assert!(refused(|m| m.ior = 0.5).contains("ior 0.5 is not from 1 to 4"));
    assert!(refused(|m| m.ior = f32::NAN).contains("ior NaN is not from 1 to 4"));
    assert!(
        refused(|m| m.volume = Some(Volume { attenuation_distance_m: 0.0, ..Volume::CLEAR })).contains("distance 0")
    );
    let nan = |m: &mut Material| m.volume = Some(Volume { attenuation_distance_m: f32::NAN, ..Volume::CLEAR });
    assert!(refused(nan).contains("distance NaN"));
    let bright = |m: &mut Material| {
        m.volume = Some(Volume { attenuation_color_linear: Vec3::splat(1.1), ..Volume::CLEAR });
    };
    assert!(refused(bright).contains("attenuation colour"));
}

#[test]
fn blending_is_hashed_alpha() {
    let m = &loaded(r#""alphaMode":"BLEND","alphaCutoff":0.7"#).materials[0];
    assert!(m.alpha_hashed && m.is_alpha_tested() && m.alpha_cutoff == 0.0);
}

#[test]
fn bad_textures_are_refused_by_material_or_sampler() {
    let message = |material: &str| refusal("bad.glb", &square(material, "").glb());
    assert!(message(r#""normalTexture":{"index":9}"#).contains("material 0: texture 9"));
    assert!(message(r#""occlusionTexture":{"index":9}"#).contains("material 0: texture 9"));
    let specular =
        |texture: &str| format!(r#""extensions":{{"KHR_materials_specular":{{"{texture}":{{"index":9}}}}}}"#);
    assert!(message(&specular("specularTexture")).contains("material 0: texture 9"));
    assert!(message(&specular("specularColorTexture")).contains("material 0: texture 9"));
    let transform = r#""normalTexture":{"index":1,"extensions":{"KHR_texture_transform":{"scale":"a"}}}"#;
    assert!(message(transform).contains("material 0: KHR_texture_transform"));
    assert!(message(r#""normalTexture":{"index":1,"scale":1e39}"#).contains("material 0: normal scale"));
    assert!(message(r#""occlusionTexture":{"index":1,"strength":1e39}"#).contains("material 0: occlusion strength"));
    assert!(message(r#""extensions":{"KHR_materials_ior":{"ior":1e39}}"#).contains("material 0: ior"));
    let change = |from: &str, to: &str| {
        let mut square = square(r#""normalTexture":{"index":1}"#, "");
        square.more = square.more.replace(from, to);
        refusal("bad.glb", &square.glb())
    };
    assert!(change("33071", "33072").contains("sampler 0: unknown wrap mode"));
    assert!(change(r#""sampler":0"#, r#""sampler":7"#).contains("material 0: sampler 7"));
    let nan = |at: usize, more: &str| {
        let mut square = square(r#""normalTexture":{"index":1}"#, "");
        square.primitive = square.primitive.replace(r#""TEXCOORD_1":2"#, &format!(r#""TEXCOORD_1":2{more}"#));
        square.binary[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        square.glb()
    };
    assert!(refusal("nan.glb", &nan(48, "")).contains("mesh 0, primitive 0: its tangents"));
    // A tangent that is not finite is replaced.
    assert!(load("nan.glb", &nan(124, r#","TANGENT":4,"NORMAL":5"#)).is_ok());
}
