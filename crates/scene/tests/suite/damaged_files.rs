//! Files that are truncated at every length, or have bytes changed at random, give a scene or an error, and no panic.

use std::path::Path;

use fixtures::{checker_sphere, unit_cube};
use scene::{Limits, MissingTextures, load_file, pack, unpack};

use crate::samples::compressed::{compressed_cube, diagonals, plain_streams, positions};
use crate::samples::draco::{cube_stream, draco_cube};
use crate::samples::ktx2::{etc1s, uastc, uastc_of_encoder, zstandard};
use crate::samples::skinned::Tube;
use crate::samples::{self, GltfCube, cube_obj, cube_ply_ascii, cube_ply_binary, within_a_second};

/// Tight limits keep a changed size from making the test slow.
fn limits() -> Limits {
    Limits {
        vertices: 1_000_000,
        triangles: 1_000_000,
        file_bytes: 10_000_000,
        texture_bytes: 10_000_000,
        ..Limits::default()
    }
}

struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % bound
    }
}

/// Numbers at which counts, offsets and indices fail.
const EXTREMES: [&str; 16] = [
    "0",
    "1",
    "-1",
    "2",
    "7",
    "8",
    "255",
    "256",
    "65535",
    "2147483647",
    "2147483648",
    "4294967295",
    "9223372036854775807",
    "18446744073709551615",
    "1e39",
    "nan",
];

/// Replaces one to three whole numbers of a text. The syntax stays valid, so that the code behind the parser is tested;
/// a changed byte mostly ends in the parser.
fn with_other_numbers(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut copy = bytes.to_vec();
    for _ in 0..=random.below(3) {
        let starts = |i: &usize| copy[*i].is_ascii_digit() && (*i == 0 || !copy[*i - 1].is_ascii_alphanumeric());
        let numbers: Vec<usize> = (0..copy.len()).filter(starts).collect();
        if numbers.is_empty() {
            return copy;
        }
        let start = numbers[random.below(numbers.len())];
        let length = copy[start..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
        copy.splice(start..start + length, EXTREMES[random.below(EXTREMES.len())].bytes());
    }
    copy
}

/// Calls `take` with every cut of `bytes`, `changed` copies with one to eight bytes changed, and noise.
fn damaged(bytes: &[u8], changed: usize, mut take: impl FnMut(&[u8])) {
    let step = (bytes.len() / 600).max(1);
    (0..bytes.len()).step_by(step).for_each(|length| take(&bytes[..length]));
    let mut random = Random(7);
    for _ in 0..changed {
        let mut copy = bytes.to_vec();
        for _ in 0..=random.below(8) {
            let at = random.below(copy.len());
            // Extremes find more than noise does; digits keep text parsable.
            copy[at] = match random.below(4) {
                0 => 0,
                1 => 255,
                2 => b'0' + random.below(10) as u8,
                _ => random.below(256) as u8,
            };
        }
        take(&copy);
    }
    for _ in 0..changed {
        take(&with_other_numbers(bytes, &mut random));
    }
    let noise: Vec<u8> = (0..512).map(|_| random.below(256) as u8).collect();
    take(&noise);
    let headed: Vec<u8> = bytes.iter().take(12).chain(&noise).copied().collect();
    take(&headed);
}

fn load_damaged(name: &str, bytes: &[u8], changed: usize) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    let mut loaded = 0;
    let mut refused = 0;
    damaged(bytes, changed, |bytes| {
        rewrite(&path, bytes);
        match load(&path) {
            true => loaded += 1,
            false => refused += 1,
        }
    });
    assert!(refused > 100, "{name}: {loaded} loaded, {refused} refused");
}

/// Writes a new file: file systems flush one that is truncated and written again, which takes most of the time.
fn rewrite(path: &Path, bytes: &[u8]) {
    std::fs::remove_file(path).ok();
    std::fs::write(path, bytes).unwrap();
}

fn load(path: &Path) -> bool {
    let limits = limits();
    let loaded = within_a_second(|| load_file(path, &limits, MissingTextures::Refuse));
    loaded.map(|scene| scene.validate(&limits).unwrap()).is_ok()
}

#[test]
fn glb() {
    load_damaged("a.glb", &rich_gltf().glb(), 4000);
}

#[test]
fn glb_with_other_numbers_in_its_json() {
    let cube = rich_gltf();
    load_with_other_numbers(&cube.json(), &cube.binary, 600);
}

/// Loads 6000 copies of a file with other numbers in its JSON. At least `least` must load, and at least `least` must be refused.
fn load_with_other_numbers(json: &str, binary: &[u8], least: u32) {
    let dir = tempfile::tempdir().unwrap();
    let mut random = Random(11);
    let path = dir.path().join("a.glb");
    let mut loaded = 0;
    for _ in 0..6000 {
        let json = with_other_numbers(json.as_bytes(), &mut random);
        rewrite(&path, &samples::glb(std::str::from_utf8(&json).unwrap(), binary));
        loaded += u32::from(load(&path));
    }
    assert!((least..6000 - least).contains(&loaded), "{loaded}: both outcomes must be common, or this tests little");
}

#[test]
fn compressed_glb() {
    load_damaged("a.glb", &compressed_gltf().glb(), 2000);
    damage_binary(&compressed_gltf(), 3000);
}

#[test]
fn draco_glb() {
    for level in [None, Some(0), Some(10)] {
        let cube = draco_cube(&cube_stream(level, 12), |_| {});
        damage_binary(&cube, 3000);
    }
}

/// Damage that meets the binary chunk alone, behind the JSON.
fn damage_binary(cube: &GltfCube, changed: usize) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.glb");
    let mut loaded = 0;
    damaged(&cube.binary, changed, |binary| {
        rewrite(&path, &samples::glb(&cube.json(), binary));
        loaded += u32::from(load(&path));
    });
    assert!(loaded > 100, "{loaded} loaded");
}

#[test]
fn ktx2_textures() {
    let blocks = [[250, 10, 20, 255], [1, 2, 240, 128]];
    for picture in [uastc(6, 3, &blocks), zstandard(6, 3, &blocks, None), etc1s(), uastc_of_encoder()] {
        let cube = samples::cube(|c| {
            let length = picture.len();
            c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#.into();
            c.views += &format!(r#",{{"buffer":0,"byteOffset":168,"byteLength":{length}}}"#);
            c.buffers = format!(r#"{{"byteLength":{}}}"#, length + 168);
            c.binary.extend(&picture);
            c.more = r#""images":[{"bufferView":2,"mimeType":"image/ktx2"}],"textures":
                [{"extensions":{"KHR_texture_basisu":{"source":0}}}],
                "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"#
                .into();
        });
        damage_binary(&cube, 3000);
    }
}

#[test]
fn skinned_glb() {
    load_damaged("a.glb", &skinned().glb(), 4000);
}

#[test]
fn skinned_glb_with_other_numbers_in_its_json() {
    let tube = skinned();
    load_with_other_numbers(&tube.json(), &tube.binary, 200);
}

#[test]
fn gltf() {
    let mut cube = rich_gltf();
    let hex: String = cube.binary.iter().map(|b| format!("%{b:02x}")).collect();
    cube.buffers = format!(r#"{{"byteLength":{},"uri":"data:application/octet-stream,{hex}"}}"#, cube.binary.len());
    load_damaged("a.gltf", cube.json().as_bytes(), 4000);
}

#[test]
fn obj() {
    let text = format!(
        "mtllib a.mtl\nusemtl a\nvt 0.5 0.5\nvn 0 0 1\nvt 0 0\nvn 1 0 0\n{}f 1/1/1 2/2/2 -1/-1/-1\n",
        cube_obj()
    );
    load_damaged("a.obj", text.as_bytes(), 3000);
}

#[test]
fn mtl() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    std::fs::write(&path, format!("mtllib a.mtl\nusemtl a\n{}", cube_obj())).unwrap();
    let library = "newmtl a\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 10\nd 0.5\nTr 0.2\nmap_Kd -s 1 1 1 a.png\nmap_d -imfchan r \"a.png\" # x\nillum 2\nnewmtl b\nKe 1 1 1\n";
    damaged(library.as_bytes(), 2000, |bytes| {
        rewrite(&dir.path().join("a.mtl"), bytes);
        load(&path);
    });
}

#[test]
fn ply_ascii() {
    load_damaged("a.ply", &cube_ply_ascii(), 3000);
    let rich = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        property float s\nproperty float t\nelement face 2\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\n\
        property int texnumber\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0 0 0\n2 0 0 1 0\n2 2 0 1 1\n\
        0 2 0 0 1\n1 1 0 0 0\n5 0 1 2 3 4 10 0 0 1 0 1 1 0 1 0 0 0\n3 0 1 2 0 0\n5 0 1 3 2 -1\n";
    load_damaged("a.ply", rich.as_bytes(), 3000);
}

#[test]
fn ply_binary() {
    load_damaged("a.ply", &cube_ply_binary(false), 3000);
    load_damaged("a.ply", &cube_ply_binary(true), 3000);
}

#[test]
fn packages() {
    let mut textured = checker_sphere();
    textured.textures[0] = scene::Texture { width_px: 2, height_px: 2, is_srgb: true, srgba8: vec![9; 16] };
    let animated = samples::load("a.glb", &skinned().glb()).unwrap();
    for scene in [unit_cube().with_wind(), textured, animated] {
        damaged(&pack(&scene), 4000, |bytes| {
            if let Ok(scene) = unpack(bytes, &limits()) {
                scene.validate(&limits()).unwrap();
            }
        });
    }
}

/// A tube with two clips of all interpolations.
fn skinned() -> Tube {
    let mut tube = Tube::bending();
    let grow = [0., 0., 0., 1., 1., 1., 0., 0., 0., 0., 0., 0., 2., 2., 2., 0., 0., 0.];
    let slide = [0., 0., 0., 1., 0., 0.];
    tube.animate(
        "grow",
        &[(2, "scale", "CUBICSPLINE", &[0., 2.], &grow), (1, "translation", "STEP", &[0., 1.], &slide)],
    );
    tube
}

/// A cube with lights, cameras, colours, normals, a sparse accessor, and a material with a texture in every place.
fn rich_gltf() -> GltfCube {
    let mut cube = GltfCube::default();
    cube.primitive =
        r#"{"attributes":{"POSITION":0,"NORMAL":0,"COLOR_0":2,"TEXCOORD_0":3,"TEXCOORD_1":3},"indices":1,"material":0}"#.into();
    cube.accessors = cube.accessors.replacen(
        r#""count":8"#,
        r#""sparse":{"count":1,"indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":0}},"count":8"#,
        1,
    );
    cube.accessors += r#",{"bufferView":2,"componentType":5121,"normalized":true,"count":8,"type":"VEC4"},
        {"bufferView":0,"componentType":5126,"count":8,"type":"VEC2"}"#;
    cube.views += r#",{"buffer":0,"byteOffset":168,"byteLength":32,"byteStride":4}"#;
    cube.buffers = r#"{"byteLength":200}"#.into();
    cube.binary.extend([6, 0, 255, 128].repeat(8));
    cube.nodes = r#"{"mesh":0,"children":[1,2],"rotation":[0,0,0,1]},{"mesh":0,"scale":[-1,1,1],"extensions":{"KHR_lights_punctual":{"light":0}}},{"camera":0,
        "extensions":{"KHR_lights_punctual":{"light":1}},"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}"#
        .into();
    cube.more = r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3},
        {"type":"spot","intensity":900,"color":[1,0.5,0.25],"spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}}]}},
        "cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0.1}}],"textures":[{"source":0,"sampler":0}],
        "images":[{"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC"}],
        "samplers":[{"wrapS":33071,"wrapT":33648}],"materials":[{"emissiveTexture":{"index":0},"alphaMode":"BLEND",
        "pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":0}},
        "normalTexture":{"index":0,"texCoord":1,"scale":2},"occlusionTexture":{"index":0,"strength":0.5,
        "extensions":{"KHR_texture_transform":{"texCoord":1,"scale":[2,3]}}},"extensions":{"KHR_materials_ior":{"ior":1.4},
        "KHR_materials_specular":{"specularFactor":0.5,"specularTexture":{"index":0},"specularColorFactor":[1,2,3]}}}],"#
        .into();
    cube
}

/// A cube whose positions, triangles and normals are compressed, with two filters.
fn compressed_gltf() -> GltfCube {
    let streams = [positions(0, "EXPONENTIAL"), plain_streams().remove(1), diagonals(4)];
    let mut cube = compressed_cube("EXT_meshopt_compression", &streams);
    cube.primitive = r#"{"attributes":{"POSITION":0,"NORMAL":2},"indices":1}"#.into();
    cube.accessors += r#",{"bufferView":2,"componentType":5120,"normalized":true,"count":8,"type":"VEC3"}"#;
    cube
}

#[test]
fn the_undamaged_sample_loads() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("a.glb"), rich_gltf().glb()).unwrap();
    let scene = load_file(&dir.path().join("a.glb"), &limits(), MissingTextures::Refuse).unwrap();
    assert_eq!(
        (scene.triangle_count(), scene.illumination.lights.len(), scene.cameras.len(), scene.textures.len()),
        (24, 2, 1, 3)
    );
}

/// An `.hdr` file: rows of eight and more texels are run-length encoded.
fn hdr() -> Vec<u8> {
    let texels: Vec<image::Rgb<f32>> = (0..32 * 16).map(|i| image::Rgb([i as f32, 0.5, (i / 32) as f32])).collect();
    let mut bytes = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut bytes).encode(&texels, 32, 16).unwrap();
    bytes
}

#[test]
fn environment_maps() {
    let dir = tempfile::tempdir().unwrap();
    let bytes = hdr();
    let path = dir.path().join("a.hdr");
    let mut loaded = 0;
    let mut refused = 0;
    damaged(&bytes, 3000, |bytes| {
        rewrite(&path, bytes);
        match scene::load_environment(&path) {
            Ok(map) => loaded += usize::from(map.validate().is_ok()),
            Err(error) => refused += usize::from(error.to_string().contains("a.hdr")),
        }
    });
    println!("{loaded} loaded, {refused} refused");
    assert!(loaded > 100 && refused > 100, "{loaded} loaded, {refused} refused");
    rewrite(&path, &bytes[..bytes.len() - 1]);
    scene::load_environment(&path).expect_err("a file without its last byte");
}

#[test]
fn an_environment_map_is_refused_by_field() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.hdr");
    let file =
        |header: &str, size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n{header}\n{size}\n").into_bytes();
    let with_texel = |header: &str, texel: [u8; 4]| [&file(header, "-Y 1 +X 1")[..], &texel].concat();
    let white = [128, 128, 128, 129];
    for (bytes, field) in [
        (file("", "-Y 0 +X 0"), "size: 0×0"),
        (file("", "-Y 0 +X 8"), "size: 8×0"),
        (file("", "-Y 100000 +X 200000"), "size: "),
        (file("", "-Y 4294967295 +X 4294967295"), "header"),
        (file("", "-Y 2 +X 1"), "texels: "),
        (with_texel("EXPOSURE=nan\n", white), "EXPOSURE"),
        (with_texel("EXPOSURE=0\n", white), "EXPOSURE"),
        (with_texel("EXPOSURE=-1\n", white), "EXPOSURE"),
        (with_texel("EXPOSURE=1e-30\n", [255, 255, 255, 255]), "radiance: "),
        (b"P6 1 1 255 abc".to_vec(), "header"),
        (Vec::new(), "header"),
    ] {
        rewrite(&path, &bytes);
        let refused = scene::load_environment(&path).expect_err(field).to_string();
        assert!(refused.contains("a.hdr") && refused.contains(field), "{field}: {refused}");
    }
    rewrite(&path, &with_texel("EXPOSURE=2\n", white));
    let map = scene::load_environment(&path).unwrap();
    assert_eq!(map.texel_linear(0, 0), glam::Vec3::splat(0.5), "pixels are divided by the exposure");
    rewrite(&path, &with_texel("", [255, 255, 255, 255]));
    assert_eq!(scene::load_environment(&path).unwrap().texel_linear(0, 0), glam::Vec3::splat(65_408.0), "clamped");
    let windows = [&b"#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\nEXPOSURE=2\r\n\r\n-Y 1 +X 1\r\n"[..], &white].concat();
    rewrite(&path, &windows);
    let map = scene::load_environment(&path).unwrap();
    assert_eq!(map.texel_linear(0, 0), glam::Vec3::splat(0.5), "lines may end as on Windows");
    // Texels may hold the bytes of line ends.
    rewrite(&path, &with_texel("", [b'\r', b'\n', 0, 129]));
    assert_eq!(scene::load_environment(&path).unwrap().texel_linear(0, 0).z, 0.0);
    assert!(scene::load_environment(&dir.path().join("none.hdr")).unwrap_err().to_string().contains("none.hdr"));
}
