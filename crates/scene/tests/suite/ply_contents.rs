//! Contents of PLY as several programs write them: textures, colours, strips, rows that cannot be used.

use scene::Scene;

use crate::samples::warnings::loaded_with_warnings;
use crate::samples::{Sample, load, refusal, world_triangles};

const CORNERS: [&str; 4] = ["0 0 0", "2 0 0", "2 2 0", "0 2 0"];
const FACES: &str = "property list uchar int vertex_indices\n";

/// A square of side 2 whose vertices have further properties and values.
fn square(vertex: &str, values: [&str; 4], faces: &str, rows: &[&str]) -> String {
    let mut text = "ply\nformat ascii 1.0\ncomment TextureFile my t.png\ncomment TextureFile u.png\nelement vertex 4\n\
        property float x\nproperty float y\nproperty float z\n"
        .to_owned();
    text += &format!("{vertex}element face {}\n{faces}end_header\n", rows.len());
    CORNERS.iter().zip(values).for_each(|(corner, values)| text += &format!("{corner} {values}\n"));
    rows.iter().for_each(|row| text += &format!("{row}\n"));
    text
}

fn without_textures(text: &str) -> String {
    text.lines().filter(|line| !line.starts_with("comment")).map(|line| format!("{line}\n")).collect()
}

fn png(srgba8: [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbaImage::from_pixel(1, 1, image::Rgba(srgba8));
    pixels.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn area(scene: &Scene) -> f32 {
    world_triangles(scene).iter().map(|[a, b, c]| (b - a).cross(c - a).length() * 0.5).sum()
}

fn textured(text: &str) -> (Scene, String) {
    let sample =
        Sample::new("a.ply", text.as_bytes()).with("my t.png", &png([1, 2, 3, 255])).with("U.png", &png([9; 4]));
    loaded_with_warnings(&sample)
}

#[test]
fn a_texture_is_placed_by_the_coordinates_of_vertices() {
    let values = ["0 0", "1 0", "1 1", "0 1"];
    for (u, v) in [("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t")] {
        let vertex = format!("property float {u}\nproperty float {v}\n");
        let (scene, warnings) = textured(&square(&vertex, values, FACES, &["4 0 1 2 3"]));
        let material = &scene.materials[scene.meshes[0].parts[0].material as usize];
        let texture = material.base_color_texture.unwrap().texture;
        assert_eq!((scene.textures[texture as usize].srgba8.as_slice(), warnings.as_str()), (&[1, 2, 3, 255][..], ""));
        let uvs: Vec<_> = scene.meshes[0].vertices.iter().map(|vertex| vertex.uv).collect();
        assert_eq!(uvs, [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], "{u}");
    }
}

#[test]
fn faces_may_have_their_own_coordinates_and_textures() {
    let faces = format!("{FACES}property list uchar float texcoord\nproperty int texnumber\n");
    let rows = ["3 0 1 2 6 0 0 1 0 1 1 1", "3 0 2 3 6 0.5 0 1 1 0 nan 0", "3 0 1 3 6 0 0 0 0 0 0 7"];
    let (scene, warnings) = textured(&square("", [""; 4], &faces, &rows));
    let mesh = &scene.meshes[0];
    let parts: Vec<_> =
        mesh.parts.iter().map(|part| (&*scene.materials[part.material as usize].name, part.index_count)).collect();
    assert_eq!(parts, [("my t.png", 3), ("u.png", 3), ("vertex colours", 3)]);
    let uvs = |part: usize| {
        let first = mesh.parts[part].first_index as usize;
        [0, 1, 2].map(|i| mesh.vertices[mesh.indices[first + i] as usize].uv)
    };
    assert_eq!(uvs(0), [[0.5, 1.0], [1.0, 0.0], [0.0, 1.0]], "NaN is 0");
    assert_eq!(uvs(1), [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]);
    assert!(warnings.contains("texture that is not there") && warnings.contains("face 2"), "{warnings}");
}

#[test]
fn textures_that_cannot_be_placed_are_named() {
    let (scene, warnings) = textured(&square("", [""; 4], FACES, &["4 0 1 2 3"]));
    assert!(scene.textures.is_empty() && warnings.contains("without coordinates") && warnings.contains("my t.png"));
    let vertex = "property float s\nproperty float t\n";
    let missing = refusal("a.ply", square(vertex, ["0 0"; 4], FACES, &["4 0 1 2 3"]).as_bytes());
    assert!(missing.contains("my t.png, u.png"), "{missing}");
    let outside = square(vertex, ["0 0"; 4], FACES, &["4 0 1 2 3"]).replace("my t.png", "../t.png");
    assert!(refusal("a.ply", outside.as_bytes()).contains("climbs out"));
}

#[test]
fn vertex_colors_of_all_names_and_ranges_are_bytes() {
    for (names, kind, values, expected) in [
        ("red green blue", "uchar", "200 10 0", [200, 10, 0, 255]),
        ("Red Green Blue", "uchar", "200 10 0", [200, 10, 0, 255]),
        ("diffuse_red diffuse_green diffuse_blue", "uchar", "200 10 0", [200, 10, 0, 255]),
        ("r g b", "uchar", "200 10 0", [200, 10, 0, 255]),
        ("r g b a", "uchar", "200 10 0 7", [200, 10, 0, 7]),
        ("red green blue", "float", "200 10 0", [200, 10, 0, 255]),
        ("red green blue", "float", "0.8 0.4 0", [204, 102, 0, 255]),
        ("red green blue", "ushort", "65535 257 0", [255, 1, 0, 255]),
    ] {
        let vertex: String = names.split(' ').map(|name| format!("property {kind} {name}\n")).collect();
        let text = without_textures(&square(&vertex, [values; 4], FACES, &["4 0 1 2 3"]));
        let scene = load("a.ply", text.as_bytes()).unwrap();
        assert!(scene.meshes[0].vertices.iter().all(|v| v.color_srgba8 == expected), "{names} {kind}");
    }
}

#[test]
fn faces_have_colors_where_vertices_have_none() {
    let color = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let rows = ["3 0 1 2 200 0 0", "3 0 2 3 0 100 0"];
    let face_colors = |vertex: &str, values: &str| {
        let text = without_textures(&square(vertex, [values; 4], &format!("{FACES}{color}"), &rows));
        let scene = load("a.ply", text.as_bytes()).unwrap();
        let mesh = &scene.meshes[0];
        [0, 3].map(|first| mesh.vertices[mesh.indices[first] as usize].color_srgba8)
    };
    assert_eq!(face_colors("", ""), [[200, 0, 0, 255], [0, 100, 0, 255]]);
    assert_eq!(face_colors(color, "1 2 3"), [[1, 2, 3, 255]; 2]);
}

#[test]
fn strips_are_triangles_of_one_direction() {
    let text = without_textures(&square("", [""; 4], FACES, &["7 0 1 3 2 -1 0 1"]))
        .replace("element face", "element tristrips");
    let scene = load("a.ply", text.as_bytes()).unwrap();
    assert_eq!((scene.triangle_count(), area(&scene)), (2, 4.0));
    assert!(world_triangles(&scene).iter().all(|[a, b, c]| (b - a).cross(c - a).z > 0.0));
    assert!(refusal("a.ply", text.replace("7 0 1 3 2 -1 0 1", "2 0 1").as_bytes()).contains("no triangles"));
}

#[test]
fn rows_that_cannot_be_used_are_left_out_and_counted() {
    let rows = ["4 0 1 2 3", "0", "2 0 1", "3 0 1 9", "3 0 1 -1", "0"];
    let text = without_textures(&square("", [""; 4], FACES, &rows));
    let (scene, warnings) = loaded_with_warnings(&Sample::new("a.ply", text.as_bytes()));
    assert_eq!((scene.triangle_count(), warnings.lines().count()), (2, 2), "{warnings}");
    assert!(warnings.contains("three corners are left out: 3, the first: face 1"), "{warnings}");
    assert!(warnings.contains("corner that is no vertex of the file are left out: 2, the first: face 3"), "{warnings}");
}

#[test]
fn unused_vertices_do_not_count() {
    for unused in ["1000 0 0", "nan nan nan", "-nan(ind) -1.#IND 1.#QNAN"] {
        let text = without_textures(&square("", [""; 4], FACES, &["3 0 1 2"])).replace("0 2 0", unused);
        let (scene, warnings) = loaded_with_warnings(&Sample::new("a.ply", text.as_bytes()));
        assert_eq!((scene.bounds().max.x, scene.meshes[0].vertices.len()), (2.0, 3), "{unused}");
        assert_eq!(warnings.contains("vertex 3"), unused != "1000 0 0", "{warnings}");
    }
    let used = without_textures(&square("", [""; 4], FACES, &["3 0 1 2", "3 0 2 3"])).replace("0 2 0", "0 nan 0");
    let (scene, warnings) = loaded_with_warnings(&Sample::new("a.ply", used.as_bytes()));
    assert!(scene.triangle_count() == 1 && warnings.contains("face 1"), "{warnings}");
}

#[test]
fn marks_line_ends_and_sides_do_not_matter() {
    let text = without_textures(&square("", [""; 4], FACES, &["4 3 2 1 0"]));
    for text in [format!("\u{feff}{text}"), text.replace('\n', "\r\n"), text.replace('\n', "\r")] {
        let scene = load("a.ply", text.as_bytes()).unwrap();
        assert!(area(&scene) == 4.0 && scene.materials.iter().all(|material| material.double_sided));
    }
}

#[test]
fn concave_faces_keep_their_outline() {
    let text = without_textures(&square("", [""; 4], FACES, &["4 3 0 1 2"])).replace("2 2 0", "0.5 0.5 0");
    assert_eq!(area(&load("a.ply", text.as_bytes()).unwrap()), 1.0);
}
