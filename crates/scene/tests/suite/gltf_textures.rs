//! Textures of glTF: their formats and uses, and those that are missing.

use scene::{Limits, MissingTextures, SceneErrorKind, TextureUse, load_file};

use crate::samples::warnings::with_one_warning;
use crate::samples::{Sample, cube, load};

/// An image of `texels`, as a data URI.
fn png_of(texels: &[[u8; 4]]) -> String {
    let image = image::RgbaImage::from_raw(texels.len() as u32, 1, texels.concat()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let hex: String = bytes.get_ref().iter().map(|b| format!("%{b:02x}")).collect();
    format!("data:image/png,{hex}")
}

/// A cube with one material, `pbr` its `pbrMetallicRoughness`, and the textures 0 and 1 of two images.
fn textured_cube(pbr: &str) -> Vec<u8> {
    let image = png_of(&[[10, 200, 255, 255], [20, 100, 0, 255]]);
    let other = png_of(&[[255; 4]]);
    cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,"material":0}"#.into();
        c.accessors += r#",{"bufferView":0,"componentType":5126,"count":8,"type":"VEC2"}"#;
        c.more = format!(
            r#""textures":[{{"source":0}},{{"source":1}}],"images":[{{"uri":"{image}"}},{{"uri":"{other}"}}],
            "materials":[{{"pbrMetallicRoughness":{{{pbr}}}}}],"#
        );
    })
    .glb()
}

#[test]
fn metallic_and_roughness_keep_their_texture() {
    let pbr = r#""metallicRoughnessTexture":{"index":0},"metallicFactor":0.5,"roughnessFactor":0.8"#;
    let scene = load("mr.glb", &textured_cube(pbr)).unwrap();
    let m = &scene.materials[0];
    assert_eq!((m.metallic, m.roughness, m.base_color_texture), (0.5, 0.8, None));
    let texture = &scene.textures[m.metallic_roughness_texture.unwrap().texture as usize];
    assert_eq!((texture.is_srgb, texture.width_px, scene.textures.len()), (false, 2, 1));
    assert_eq!(texture.srgba8[..3], [10, 200, 255], "as it is in the file");
    // Blinn-Phong has the mean: metallic 0.5 · 0.5 and roughness 0.8 · 150/255.
    let (specular, exponent) = scene::Material::phong_from_metallic_roughness(0.25, 0.8 * 150.0 / 255.0, 0.04);
    assert!((m.phong_specular - specular).abs() < 1e-5 && (m.phong_exponent / exponent - 1.0).abs() < 1e-4);
}

#[test]
fn an_image_of_colours_and_data_is_two_textures() {
    let both = r#""baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":0}"#;
    let scene = load("both.glb", &textured_cube(both)).unwrap();
    let of = |used: Option<TextureUse>| &scene.textures[used.unwrap().texture as usize];
    let m = &scene.materials[0];
    assert!(of(m.base_color_texture).is_srgb && !of(m.metallic_roughness_texture).is_srgb);
    assert_eq!((scene.textures.len(), &scene.textures[0].srgba8), (2, &scene.textures[1].srgba8));
}

#[test]
fn a_webp_texture_is_read_with_and_without_another_format() {
    let texels = [[10, 200, 255, 255], [20, 100, 0, 255]];
    let image = image::RgbaImage::from_raw(2, 1, texels.concat()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::WebP).unwrap();
    let hex: String = bytes.get_ref().iter().map(|b| format!("%{b:02x}")).collect();
    let other = png_of(&[[1, 2, 3, 255]]);
    let textured = |source: &str, webp: &str| {
        let of_webp = format!(r#"{source}"extensions":{{"EXT_texture_webp":{{"source":{webp}}}}}"#);
        let textured = cube(|c| {
            c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#.into();
            c.more = format!(
                r#""extensionsRequired":["EXT_texture_webp"],"textures":[{{{of_webp}}}],
                "images":[{{"uri":"{other}"}},{{"uri":"data:image/webp,{hex}"}}],
                "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],"#
            );
        });
        textured.glb()
    };
    for source in ["", r#""source":0,"#] {
        let scene = load("webp.glb", &textured(source, "1")).unwrap();
        assert_eq!((scene.textures.len(), &scene.textures[0].srgba8), (1, &texels.concat()), "{source:?}");
    }
    // A texture without a picture leaves the factors of its material.
    for webp in ["2", "4294967296", "-1", "\"one\"", "null"] {
        let (scene, warning) = with_one_warning(|| load("webp.glb", &textured("", webp)).unwrap());
        assert!(scene.textures.is_empty() && scene.materials[0].base_color_texture.is_none(), "{webp}");
        assert!(
            warning.contains("webp.glb")
                && warning.contains(
                    "textures without a picture: materials show their factors: material 0, texture 0 (no name)"
                ),
            "{warning}"
        );
    }
}

#[test]
fn all_missing_textures_are_named_and_grey_goes_on() {
    let pbr = r#""baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":1}"#;
    let normal = r#""normalTexture":{"index":2}"#;
    let bytes = cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#.into();
        c.more = format!(
            r#""textures":[{{"source":0}},{{"source":1}},{{"source":2}}],
            "images":[{{"uri":"a%20b.png"}},{{"uri":"c.jpg"}},{{"uri":"d.png"}}],
            "materials":[{{{normal},"pbrMetallicRoughness":{{{pbr},"roughnessFactor":0.7}}}}],"#
        );
    })
    .glb();
    let sample = Sample::new("lost.glb", &bytes);
    let error = sample.load().unwrap_err();
    assert_eq!(error.to_string().split_once("lost.glb: ").unwrap().1, "textures: missing: a%20b.png, c.jpg, d.png");
    let scene = load_file(&sample.path, &Limits::default(), MissingTextures::Grey).unwrap();
    let texels: Vec<&[u8]> = scene.textures.iter().map(|texture| texture.srgba8.as_slice()).collect();
    assert_eq!(texels, [[188, 188, 188, 255], [255; 4], [128, 128, 255, 255]], "data leave factors and normals alone");
    let outside = cube(|c| {
        c.more = r#""images":[{"uri":"../c.jpg"}],"textures":[{"source":0}],
            "materials":[{"emissiveTexture":{"index":0}}],"#
            .into();
    });
    let sample = Sample::new("out.glb", &outside.glb());
    let error = load_file(&sample.path, &Limits::default(), MissingTextures::Grey).unwrap_err();
    assert!(matches!(error.kind, SceneErrorKind::Forbidden { .. }), "{error}");
}

#[test]
fn a_texture_in_avif_alone_leaves_the_factor_with_one_warning() {
    let textured = |textures: &str| {
        cube(|c| {
            c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#.into();
            c.more = format!(
                r#""extensionsUsed":["EXT_texture_avif"],"textures":[{textures}],"images":[{{"uri":"a.avif"}},{{"uri":"{}"}}],
                "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},"baseColorFactor":[0.5,0,1,1]}},
                "emissiveTexture":{{"index":0}}}}],"#,
                png_of(&[[1, 2, 3, 255]])
            );
        })
        .glb()
    };
    let of_extension = r#"{"name":"wood","extensions":{"EXT_texture_avif":{"source":0}}}"#;
    for only in [of_extension, r#"{"source":0,"name":"wood"}"#] {
        let (scene, warning) = with_one_warning(|| load("a.glb", &textured(only)).unwrap());
        assert_eq!(scene.materials[0].base_color_linear, [0.5, 0.0, 1.0, 1.0]);
        assert!(scene.textures.is_empty(), "{only}");
        assert!(warning.contains("pictures in AVIF"), "{warning}");
        assert!(warning.contains("2, the first: material 0, texture 0 (wood)"), "{warning}");
        assert!(warning.contains("`npx @gltf-transform/cli png IN OUT`"), "{warning}");
    }
    let (_, warning) = with_one_warning(|| load("a.glb", &textured("{}")).unwrap());
    assert!(warning.contains("textures without a picture"), "{warning}");
    let both = r#"{"source":1,"extensions":{"EXT_texture_avif":{"source":0}}}"#;
    assert_eq!(load("a.glb", &textured(both)).unwrap().textures[0].srgba8, [1, 2, 3, 255]);
}
