//! OBJ files as many programs write them: encodings, names, libraries, faces of any shape.

use scene::{Limits, MissingTextures, Scene, SceneErrorKind, Wrap, load_file};

use crate::samples::warnings::loaded_with_warnings;
use crate::samples::{Sample, load, world_triangles};

/// A square of side 2 with texture coordinates 0…1, in one face.
const SQUARE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
const FACE: &str = "f 1/1 2/2 3/3 4/4\n";

fn area(scene: &Scene) -> f32 {
    world_triangles(scene).iter().map(|[a, b, c]| (b - a).cross(c - a).length() * 0.5).sum()
}

fn colors(scene: &Scene) -> Vec<[f32; 4]> {
    scene.meshes[0].parts.iter().map(|part| scene.materials[part.material as usize].base_color_linear).collect()
}

/// A picture of one texel.
fn png(srgba8: [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbaImage::from_pixel(1, 1, image::Rgba(srgba8));
    pixels.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn textured(library: &[u8]) -> Sample {
    let text = format!("mtllib a.mtl\n{SQUARE}usemtl m\n{FACE}");
    let mut with_material = b"newmtl m\n".to_vec();
    with_material.extend_from_slice(library);
    Sample::new("a.obj", text.as_bytes()).with("a.mtl", &with_material)
}

const ORANGE: [u8; 4] = [250, 120, 10, 255];

#[test]
fn every_encoding_and_line_end_gives_the_same_square() {
    let text = format!("mtllib a.mtl\nusemtl blue\n{SQUARE}# comment\nf 1/1 2/2 \\\n 3/3 4/4");
    let library = "newmtl blue\nKd 0 0 1";
    let utf_16 = |text: &str, bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
        format!("\u{feff}{text}").encode_utf16().flat_map(bytes).collect()
    };
    let forms: [fn(&str) -> Vec<u8>; 4] = [
        |text| text.as_bytes().to_vec(),
        |text| format!("\u{feff}{text}").into_bytes(),
        |text| text.replace('\n', "\r\n").into_bytes(),
        |text| text.replace('\n', "\r").into_bytes(),
    ];
    let mut encoded: Vec<[Vec<u8>; 2]> = forms.iter().map(|form| [form(&text), form(library)]).collect();
    encoded.push([utf_16(&text, u16::to_le_bytes), utf_16(library, u16::to_le_bytes)]);
    encoded.push([utf_16(&text, u16::to_be_bytes), utf_16(library, u16::to_be_bytes)]);
    for [text, library] in encoded {
        let scene = Sample::new("a.obj", &text).with("a.mtl", &library).load().unwrap();
        assert_eq!((area(&scene), colors(&scene)), (4.0, vec![[0.0, 0.0, 1.0, 1.0]]), "{:?}", &text[..4]);
    }
}

#[test]
fn a_line_may_continue_at_the_end_of_the_file() {
    assert_eq!(area(&load("a.obj", format!("{SQUARE}f 1 2 3 \\\n4\\").as_bytes()).unwrap()), 4.0);
}

#[test]
fn concave_faces_keep_their_outline() {
    let points = "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nv 1 1 1\n";
    for face in ["f 1 2 3 4 5 6 7 8", "f 4 5 6 7 8 1 2 3", "f 8 7 6 5 4 3 2 1"] {
        let scene = load("u.obj", format!("{points}{face}\n").as_bytes()).unwrap();
        assert_eq!((scene.triangle_count(), area(&scene)), (6, 7.0), "{face}");
    }
    // A corner of this quad that is not plane points inwards: seen from above, its area is 1.5.
    let scene = load("q.obj", b"v 0 0 0\nv 3 0 0\nv 0.5 0.5 0.4\nv 0 3 0\nf 2 3 4 1\n").unwrap();
    let seen: f32 = world_triangles(&scene).iter().map(|[a, b, c]| (b - a).cross(c - a).z * 0.5).sum();
    let unsigned: f32 = world_triangles(&scene).iter().map(|[a, b, c]| ((b - a).cross(c - a).z * 0.5).abs()).sum();
    assert!((seen.abs() - 1.5).abs() < 1e-6 && (unsigned - 1.5).abs() < 1e-6, "{seen} {unsigned}");
}

#[test]
fn faces_may_stand_before_their_vertices() {
    let scene = load("a.obj", format!("{FACE}{SQUARE}f -4 -3 -2\n").as_bytes()).unwrap();
    assert_eq!((scene.triangle_count(), area(&scene)), (3, 6.0));
}

#[test]
fn several_libraries_and_names_with_spaces_are_found() {
    let faces = "usemtl red\nf 1 2 3\nusemtl green\nf 1 3 4\n";
    let files: [(&str, &[&str]); 6] = [
        ("one.mtl two.mtl", &["one.mtl", "two.mtl"]),
        ("one.mtl\nmtllib two.mtl", &["one.mtl", "two.mtl"]),
        ("my one.mtl  two.mtl # old", &["my one.mtl", "two.mtl"]),
        ("\"my one.mtl\" \"two.mtl\"", &["my one.mtl", "two.mtl"]),
        ("ONE.MTL Two.mtl", &["one.mtl", "two.MTL"]),
        ("C:\\work\\one.mtl /home/me/two.mtl", &["one.mtl", "two.mtl"]),
    ];
    for (statement, [one, two]) in files.map(|(statement, names)| (statement, [names[0], names[1]])) {
        let sample = Sample::new("a.obj", format!("mtllib {statement}\n{SQUARE}{faces}").as_bytes())
            .with(one, b"newmtl red\nKd 1 0 0\n")
            .with(two, b"newmtl green\nKd 0 1 0\n");
        let scene = sample.load().unwrap();
        assert_eq!(colors(&scene), [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]], "{statement}");
    }
}

#[test]
fn missing_libraries_and_unknown_materials_are_named() {
    let text = format!("mtllib gone.mtl a.mtl\n{SQUARE}usemtl Red # x\nf 1 2 3\nusemtl blue\nf 1 3 4\n");
    let sample = Sample::new("a.obj", text.as_bytes()).with("a.mtl", b"newmtl red\nKd 1 0 0\n");
    let (scene, warnings) = loaded_with_warnings(&sample);
    assert_eq!(colors(&scene), [[1.0, 0.0, 0.0, 1.0], [1.0; 4]]);
    assert!(warnings.contains("missing: gone.mtl") && warnings.contains("white: blue"), "{warnings}");
    assert_eq!(warnings.lines().count(), 2, "{warnings}");
}

#[test]
fn names_of_materials_are_compared_as_bytes() {
    let latin_1 =
        [b"mtllib a.mtl\n".as_slice(), SQUARE.as_bytes(), b"usemtl gr\xfcn\nf 1 2 3\nusemtl gr\xf6n\nf 1 3 4\n"];
    let sample =
        Sample::new("a.obj", &latin_1.concat()).with("a.mtl", b"newmtl gr\xfcn\nKd 0 1 0\nnewmtl gr\xf6n\nKd 1 0 0\n");
    let scene = sample.load().unwrap();
    assert_eq!(colors(&scene), [[0.0, 1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]]);
    assert_eq!(scene.materials[0].name, "grün");
}

#[test]
fn textures_are_found_by_any_spelling() {
    let spellings: [(&[u8], &str); 9] = [
        (b"map_Kd t.png", "t.png"),
        (b"map_Kd t.png # colours", "t.png"),
        (b"map_Kd \"t x.png\"", "t x.png"),
        (b"  map_kd\tT.PNG", "t.png"),
        (b"map_Kd -s 1 1 1 -mm 0 1 my t.png", "my t.png"),
        (b"map_Kd K:\\maps\\t.png", "t.png"),
        (b"map_Kd /home/me/t.png", "t.png"),
        (b"map_Kd ma\xdf.png", "maß.png"),
        (b"map_Kd t #1.png", "t #1.png"),
    ];
    for (statement, file) in spellings {
        let scene = textured(statement).with(file, &png(ORANGE)).load().unwrap();
        assert_eq!(scene.textures[0].srgba8, ORANGE, "{}", String::from_utf8_lossy(statement));
    }
}

#[test]
fn textures_are_relative_to_the_library_and_then_to_the_scene() {
    let text = format!("mtllib mats/a.mtl\n{SQUARE}usemtl m\n{FACE}");
    for (name, file) in
        [("t.png", "mats/t.png"), ("t.png", "t.png"), ("../maps/t.png", "maps/t.png"), ("maps/t.png", "maps/t.png")]
    {
        let sample = Sample::new("a.obj", text.as_bytes());
        ["mats", "maps"].iter().for_each(|folder| std::fs::create_dir(sample.dir.path().join(folder)).unwrap());
        let library = format!("newmtl m\nmap_Kd {name}");
        let sample = sample.with("mats/a.mtl", library.as_bytes()).with(file, &png(ORANGE));
        assert_eq!(sample.load().unwrap().textures[0].srgba8, ORANGE, "{name} as {file}");
    }
}

#[test]
fn a_texture_outside_the_folder_is_refused_or_grey() {
    let sample = textured(b"map_Kd ../t.png");
    let refused = sample.load().unwrap_err();
    assert!(matches!(refused.kind, SceneErrorKind::Forbidden { .. }), "{refused}");
    assert!(refused.to_string().contains("a.mtl, line 2"), "{refused}");
    let grey = load_file(&sample.path, &Limits::default(), MissingTextures::Grey).unwrap();
    assert_eq!(grey.textures[0].srgba8, [188, 188, 188, 255]);
}

#[test]
fn an_empty_map_is_no_texture() {
    let (scene, warnings) = loaded_with_warnings(&textured(b"Kd 0 0 1\nmap_Kd \nmap_Kd # none"));
    assert_eq!((colors(&scene), scene.textures.len()), (vec![[0.0, 0.0, 1.0, 1.0]], 0));
    assert!(warnings.contains("without a file name") && warnings.contains("a.mtl, line 3"), "{warnings}");
}

#[test]
fn map_options_place_the_texture() {
    let placed = |options: &str| {
        let library = format!("map_Kd {options} t.png");
        let scene = textured(library.as_bytes()).with("t.png", &png(ORANGE)).load().unwrap();
        let corner = scene.meshes[0].vertices.iter().find(|v| v.position == [2.0, 2.0, 0.0]).unwrap().uv;
        (corner, scene.materials[0].base_color_texture.unwrap().wrap)
    };
    assert_eq!(placed(""), ([1.0, 0.0], [Wrap::Repeat; 2]));
    // v runs upwards in the file: 1 · 3 + 0.25 is 3.25.
    assert_eq!(placed("-s 2 3 1 -o 0.5 0.25"), ([2.5, -2.25], [Wrap::Repeat; 2]));
    assert_eq!(placed("-clamp on"), ([1.0, 0.0], [Wrap::Clamp; 2]));
    let sample = textured(b"map_Kd -wobble 3 t.png\nmap_Bump b.png\nPr 0.5").with("t.png", &png(ORANGE));
    let (_, warnings) = loaded_with_warnings(&sample);
    assert!(warnings.contains("unknown options") && warnings.contains("not shown: map_Bump, Pr"), "{warnings}");
}

#[test]
fn textured_faces_without_coordinates_are_warned_of() {
    let faces = "usemtl m\nf 1/1 2/2 3/3\nf 1 3 4\nf 1 2 4\nusemtl plain\nf 1 2 3\n";
    let sample = Sample::new("a.obj", format!("mtllib a.mtl\n{SQUARE}{faces}").as_bytes())
        .with("a.mtl", b"newmtl m\nmap_Kd t.png\nnewmtl plain\n")
        .with("t.png", &png(ORANGE));
    let (_, warnings) = loaded_with_warnings(&sample);
    assert!(warnings.contains("textures without coordinates show one texel: 2, the first: line 12"), "{warnings}");
    assert_eq!(warnings.lines().count(), 1, "{warnings}");
    assert!(loaded_with_warnings(&textured(b"map_Kd t.png").with("t.png", &png(ORANGE))).1.is_empty());
}

#[test]
fn shapes_other_than_faces_are_warned_of() {
    let others = "p 1\nl 1 2\nL 2 3\ncurv 0 1 1 2\nsurf 0 1 0 1 1 2 3 4\ncall b.obj\n";
    let sample = Sample::new("a.obj", format!("{SQUARE}{FACE}{others}").as_bytes());
    let (scene, warnings) = loaded_with_warnings(&sample);
    assert_eq!((scene.triangle_count(), warnings.lines().count()), (2, 1), "{warnings}");
    assert!(warnings.contains("are left out: p, l, curv, surf, call"), "{warnings}");
}

#[test]
fn files_found_by_their_last_name_are_named_in_one_warning() {
    let text = format!("mtllib x/a.mtl\n{SQUARE}usemtl m\nf 1/1 2/2 3/3\nusemtl n\n{FACE}");
    let library = b"newmtl m\nmap_Kd C:\\x\\t.png\nnewmtl n\nmap_Kd C:\\x\\t.png\n";
    let sample = Sample::new("a.obj", text.as_bytes()).with("a.mtl", library).with("t.png", &png(ORANGE));
    let (_, warnings) = loaded_with_warnings(&sample);
    assert_eq!(warnings.lines().count(), 1, "{warnings}");
    assert!(warnings.contains("x/a.mtl by a.mtl, C:\\x\\t.png by t.png"), "{warnings}");
}

#[test]
fn tga_files_are_known_by_their_ending() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(2, 1, image::Rgba(ORANGE)).write_to(&mut bytes, image::ImageFormat::Tga).unwrap();
    let scene = textured(b"map_Kd t.TGA").with("t.tga", bytes.get_ref()).load().unwrap();
    assert_eq!((scene.textures[0].width_px, &scene.textures[0].srgba8[..4]), (2, &ORANGE[..]));
    assert!(textured(b"map_Kd t.tga").with("t.tga", b"no picture at all").load().is_err());
}
