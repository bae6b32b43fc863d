//! Materials of MTL: opacity, highlights, opacity maps; colours and normals of OBJ.

use glam::Vec3;
use scene::{Material, Scene};

use crate::samples::Sample;
use crate::samples::warnings::loaded_with_warnings;

const SQUARE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

fn sample(library: &str) -> Sample {
    let text = format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/2 3/3 4/4\n");
    Sample::new("a.obj", text.as_bytes()).with("a.mtl", format!("newmtl m\n{library}").as_bytes())
}

fn material(library: &str) -> (Material, String) {
    let (mut scene, warnings) = loaded_with_warnings(&sample(library));
    (scene.materials.remove(0), warnings)
}

fn gray_png(width: u32, value: impl Fn(u32) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbaImage::from_fn(width, 1, |x, _| image::Rgba(value(x)));
    pixels.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn opacity_is_d_or_else_tr() {
    for (library, opacity, is_warned) in [
        ("d 0.25", 0.25, false),
        ("d 0.25\nTr 0.25", 0.25, false),
        ("Tr 1\nd 1", 1.0, false),
        ("Tr 0.25", 0.75, false),
        ("Tr 0", 1.0, false),
        ("Tr 1", 1.0, true),
        ("TR 1.000\nillum 2", 1.0, true),
        ("Tr 1\nillum 4", 0.0, true),
        ("d 0", 0.0, true),
        ("d -halo 0.5", 0.5, false),
        ("Kd 1 1 1", 1.0, false),
    ] {
        let (material, warnings) = material(library);
        assert_eq!((material.base_color_linear[3], material.alpha_hashed), (opacity, opacity < 1.0), "{library}");
        assert_eq!(!warnings.is_empty(), is_warned, "{library}: {warnings}");
    }
}

#[test]
fn a_highlight_needs_a_model_and_an_exponent() {
    for (library, specular) in [
        ("Ks 0.5 0.5 0.5\nNs 50\nillum 2", 0.5),
        ("Ks 0.5 0.5 0.5\nNs 50", 0.5),
        ("ks 0.5\nns 50", 0.5),
        ("Ks 0.5 0.5 0.5\nNs 50\nillum 1", 0.0),
        ("Ks 0.5 0.5 0.5\nNs 50\nillum 0", 0.0),
        ("Ks 0.5 0.5 0.5\nNs 0\nillum 2", 0.0),
    ] {
        let (material, _) = material(library);
        assert_eq!((material.phong_specular, material.is_specular()), (specular, specular > 0.0), "{library}");
        assert_eq!(material.roughness == 1.0, specular == 0.0, "{library}");
    }
}

#[test]
fn statements_that_are_not_shown_are_named() {
    let harmless = "Ka 1 1 1\nmap_Ka a.png\nNi 1.5\nillum 2\nsharpness 60\nmap_aat on\n";
    assert_eq!(material(harmless).1, "");
    let library = "map_refl r.png\nmap_Ps s.png\nPs 1\nmap_disp d.png\nanisor 0\nPcr 0\nTf 1 0 0\nglow 3\n";
    let (_, warnings) = material(&format!("{harmless}{library}"));
    let names = "map_refl, map_Ps, Ps, map_disp, anisor, Pcr, Tf, glow";
    assert!(warnings.contains(&format!("not shown: {names}")) && warnings.lines().count() == 1, "{warnings}");
}

#[test]
fn brightness_of_maps_is_warned_of() {
    let red = gray_png(1, |_| [255, 0, 0, 255]);
    for (option, is_warned) in
        [("-mm 0 1", false), ("-mm 0.0 1.0", false), ("-mm 0 0.5", true), ("-mm 0.2 1", true), ("", false)]
    {
        let sample = sample(&format!("map_Kd {option} t.png")).with("t.png", &red);
        let (_, warnings) = loaded_with_warnings(&sample);
        assert_eq!(warnings.contains("brightness (-mm)"), is_warned, "{option}: {warnings}");
        assert_eq!(warnings.is_empty(), !is_warned, "{option}: {warnings}");
    }
}

#[test]
fn opacity_maps_become_alpha() {
    let red = gray_png(1, |_| [255, 0, 0, 255]);
    let mask = gray_png(2, |x| [[0, 0, 0, 255], [255, 255, 255, 255]][x as usize]);
    let with_alpha = gray_png(2, |x| [9, 9, 9, [0, 200][x as usize]]);
    let texels = |library: &str, mask: &[u8]| {
        let scene = sample(library).with("c.png", &red).with("m.png", mask).load().unwrap();
        assert!(scene.materials[0].alpha_hashed && scene.textures.len() == 1, "{library}");
        scene.textures[0].srgba8.clone()
    };
    let luminance = [[255, 0, 0, 0], [255, 0, 0, 255]].concat();
    assert_eq!(texels("map_Kd c.png\nmap_d m.png", &mask), luminance);
    assert_eq!(texels("map_Kd c.png\nMAP_D -imfchan r m.png", &mask), luminance);
    assert_eq!(texels("map_Kd c.png\nmap_d m.png", &with_alpha), [[255, 0, 0, 0], [255, 0, 0, 200]].concat());
    assert_eq!(texels("map_d m.png", &mask), [[255, 255, 255, 0], [255; 4]].concat());
    assert_eq!(texels("map_d -imfchan g m.png", &with_alpha), [[255, 255, 255, 9]; 2].concat());
}

fn loaded(text: &str) -> Scene {
    Sample::new("a.obj", text.as_bytes()).load().unwrap()
}

fn colors(text: &str) -> Vec<[u8; 4]> {
    loaded(text).meshes[0].vertices.iter().map(|v| v.color_srgba8).collect()
}

#[test]
fn vertex_colors_of_all_ranges_are_bytes() {
    let colored = |rgb: &str| format!("v 0 0 0 {rgb}\nv 1 0 0 {rgb}\nv 0 1 0 {rgb}\nf 1 2 3\n");
    assert_eq!(colors(&colored("0.5 0 1"))[0], [128, 0, 255, 255]);
    assert_eq!(colors(&colored("128 0 255"))[0], [128, 0, 255, 255]);
    assert_eq!(colors(&colored("1.01 0 0"))[0], [255, 0, 0, 255], "rounded up");
    assert_eq!(colors(&colored("65535 0 257"))[0], [255, 0, 1, 255]);
    let mrgb = "#MRGB ff102030ff40506000708090\n";
    for text in [format!("{mrgb}{SQUARE}f 1 2 3\n"), format!("{SQUARE}{mrgb}f 1 2 3\n")] {
        assert_eq!(colors(&text), [[16, 32, 48, 255], [64, 80, 96, 255], [112, 128, 144, 255]]);
    }
}

#[test]
fn smoothing_ends_with_s_off() {
    // Two faces that meet at 30°.
    let text = |smoothing: &str| format!("v 0 0 0\nv 0 0 1\nv 1 0 0\nv -1 0.577 0\n{smoothing}\nf 1 2 3\nf 1 4 2\n");
    for smoothing in ["", "s 1", "s on", "s off\ns 2"] {
        assert_eq!(loaded(&text(smoothing)).meshes[0].vertices.len(), 4, "{smoothing}");
    }
    for flat in ["s off", "s 0", "S OFF", "s 1\ns off"] {
        let scene = loaded(&text(flat));
        let normals: Vec<Vec3> = scene.meshes[0].vertices.iter().map(|v| v.normal.into()).collect();
        assert_eq!(normals.len(), 6, "{flat}");
        assert!(normals.contains(&Vec3::Y) && normals.iter().any(|n| n.distance(Vec3::new(0.5, 0.866, 0.0)) < 1e-3));
    }
}

#[test]
fn surfaces_are_seen_from_both_sides() {
    let scene = loaded("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 3 2 1\n");
    assert!(scene.materials.iter().all(|material| material.double_sided));
    assert!(material("Kd 1 0 0").0.double_sided);
    // A file's normals say which side is in front, whatever the order of corners.
    let turned = loaded("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 3//1 2//1 1//1\n");
    let [a, b, c] = crate::samples::world_triangles(&turned)[0];
    assert!((b - a).cross(c - a).z > 0.0);
}

#[test]
fn normals_that_are_missing_are_computed_beside_given_ones() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn nan 0 0\nvn 0 0 4\nf 1//1 2//2 3\n";
    let scene = loaded(text);
    assert!(scene.meshes[0].vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0]));
}
