//! Import of OBJ and PLY: valid content is kept and invalid content is refused.

use glam::{DVec3, Vec3};
use scene::{Limits, MissingTextures, Scene, SceneErrorKind, SceneSpec, load_file};

use crate::samples::warnings::loaded_with_warnings;
use crate::samples::{Sample, cube_obj, cube_ply_ascii, cube_ply_binary, load, ply_header, refusal, signed_volume};

fn assert_is_cube(scene: &Scene) {
    assert_eq!(scene.triangle_count(), 12);
    assert_eq!((scene.bounds().min, scene.bounds().max), (Vec3::splat(-0.5), Vec3::splat(0.5)));
    assert!((signed_volume(scene) - 1.0).abs() < 1e-6);
    // A cube's edges are sharper than the crease angle.
    assert_eq!(scene.meshes[0].vertices.len(), 24);
    assert_eq!(scene.source_space.origin_in_source, DVec3::ZERO);
}

#[test]
fn cubes_of_all_forms_are_the_same_cube() {
    assert_is_cube(&load("cube.obj", cube_obj().as_bytes()).unwrap());
    for bytes in [cube_ply_ascii(), cube_ply_binary(false), cube_ply_binary(true)] {
        let scene = load("cube.ply", &bytes).unwrap();
        assert_is_cube(&scene);
        assert_eq!(scene.meshes[0].vertices[0].color_srgba8, [10, 20, 30, 255], "sRGB bytes are kept");
    }
}

#[test]
fn obj_corners_may_lack_parts_and_count_backwards() {
    let text = "v 0 0 0 1 0.5 0\nv 1 0 0 0 0 0\nv 0 1 0 1 1 1\nvt 0.25 0.75\nvn 0 0 2\n\
                f -3/1/-1 -2//1 3\nf 1 2 3\np 1\nl 1 2\ns off\ng x\n";
    let scene = load("odd.obj", text.as_bytes()).unwrap();
    assert_eq!(scene.triangle_count(), 2);
    let vertex = scene.meshes[0].vertices[0];
    assert_eq!((vertex.uv, vertex.normal, vertex.color_srgba8), ([0.25, 0.25], [0.0, 0.0, 1.0], [255, 128, 0, 255]));
}

#[test]
fn mtl_materials_and_their_textures_are_found() {
    let text = cube_obj().replace("f 5 6", "usemtl red\nf 5 6").replace("f 1 2", "usemtl gone\nf 1 2");
    let library = "newmtl red\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 62\nd 1\nmap_Kd -s 1 1 1 no.png\nillum 2\n";
    let sample =
        Sample::new("cube.obj", format!("mtllib my lib.mtl\n{text}").as_bytes()).with("my lib.mtl", library.as_bytes());
    let missing = sample.load().unwrap_err();
    assert!(matches!(&missing.kind, SceneErrorKind::MissingFiles(files) if files == &["no.png"]), "{missing}");
    let scene = load_file(&sample.path, &Limits::default(), MissingTextures::Grey).unwrap();
    let red = scene.materials.iter().find(|m| m.name == "red").unwrap();
    assert_eq!((red.base_color_linear, red.phong_specular, red.phong_exponent), ([1.0, 0.0, 0.0, 1.0], 0.5, 62.0));
    assert_eq!((red.base_color_texture, &scene.textures[0].srgba8), (Some(0.into()), &vec![188, 188, 188, 255]));
    assert!((red.roughness - 0.42).abs() < 0.01);
    assert_eq!((scene.materials.len(), scene.meshes[0].parts.len(), scene.triangle_count()), (3, 3, 12));
    assert!(load("lost.obj", format!("mtllib lost.mtl\n{text}").as_bytes()).is_ok(), "a missing library is no error");
}

#[test]
fn mtl_numbers_out_of_range_are_clamped() {
    let library =
        b"newmtl a\nKd -1 0.5 2\nKs -0.1 0 0\nNs -3\nd 1.5\nnewmtl b\nKs 0.4\nNs 200\nnewmtl c\nNs 200\nd 0.4\n";
    let faces = cube_obj().replace("f 5 6", "usemtl b\nf 5 6").replace("f 1 2", "usemtl c\nf 1 2");
    let scene = Sample::new("a.obj", format!("mtllib a.mtl\nusemtl a\n{faces}").as_bytes())
        .with("a.mtl", library)
        .load()
        .unwrap();
    let of = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap();
    assert_eq!((of("a").base_color_linear, of("a").phong_specular), ([0.0, 0.5, 2.0, 1.0], 0.0));
    assert!(of("c").alpha_hashed && of("c").base_color_linear[3] == 0.4 && !of("a").alpha_hashed, "opacity");
    assert!(of("b").is_specular(), "a highlight of exponent 200");
    assert!(!of("a").is_specular() && !of("c").is_specular(), "no highlight without a specular colour");
}

#[test]
fn triangles_without_area_are_kept_with_unit_normals() {
    let points = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\n";
    let faces = "f 1 2 4\nf 1 1 2\nf 3 3 3\nf 1 2 3\n";
    let zero_normals = faces.replace(' ', "//1 ").replace('\n', "//1\n").replace("f//1", "f");
    for obj in [format!("{points}{faces}"), format!("{points}vn 0 0 0\n{zero_normals}")] {
        assert_keeps_flat_ones(&load("flat.obj", obj.as_bytes()).unwrap(), 4);
    }
    let rows = "0 0 0 1 2 3\n1 0 0 1 2 3\n2 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 3\n3 0 0 1\n3 2 2 2\n3 0 1 2\n";
    let ply = ply_header("ascii", 4, 4) + rows;
    assert_keeps_flat_ones(&load("flat.ply", ply.as_bytes()).unwrap(), 4);
    let beside = "v 7 7 7\nv 8 7 7\nf 1 1 1\nf 1 2 2\n";
    assert_keeps_flat_ones(&load("point.obj", beside.as_bytes()).unwrap(), 2);
}

fn assert_keeps_flat_ones(scene: &Scene, triangles: u64) {
    assert_eq!(scene.triangle_count(), triangles);
    scene.validate(&Limits::default()).unwrap();
    let unit = |v: &scene::Vertex| (Vec3::from(v.normal).length() - 1.0).abs() < 1e-5;
    assert!(scene.meshes.iter().flat_map(|m| &m.vertices).all(unit));
}

#[test]
fn obj_references_outside_the_folder_are_not_read() {
    for library in ["../a.mtl", "/etc/hostname", "file:///a.mtl"] {
        let sample = Sample::new("out.obj", format!("mtllib {library}\n{}", cube_obj()).as_bytes());
        let (scene, warnings) = loaded_with_warnings(&sample);
        assert_is_cube(&scene);
        assert!(warnings.contains("libraries are missing") && warnings.contains(library), "{warnings}");
    }
    let sample = Sample::new("a.obj", format!("mtllib a.mtl\nusemtl a\n{}", cube_obj()).as_bytes())
        .with("a.mtl", b"newmtl a\nmap_Kd ..\\secret.png\n");
    assert!(matches!(sample.load().unwrap_err().kind, SceneErrorKind::Forbidden { .. }));
    let grey = load_file(&sample.path, &Limits::default(), MissingTextures::Grey).unwrap();
    assert_eq!(grey.textures[0].srgba8, [188, 188, 188, 255]);
}

#[test]
fn bad_obj_rows_are_left_out_and_counted() {
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let rows = [
        ("f 1 2 4", "no vertex"),
        ("f 1 2 0", "no vertex"),
        ("f 1 2 -4", "no vertex"),
        ("f 1 2", "fewer than three"),
        ("f", "fewer than three"),
        ("f 1 2 x", "no vertex"),
        ("f 1/2/3/4 1 2", "no vertex"),
        ("v 1 2\nf 1 2 4", "finite"),
        ("v nan 0 0\nf 1 2 4", "finite"),
        ("v 1e999 0 0", "finite"),
        ("v a b c", "finite"),
        ("vn nan 0 1", "finite"),
        ("vn 1 2", "finite"),
        ("vt", "finite"),
        ("vt inf", "finite"),
    ];
    for (row, reason) in rows {
        let sample = Sample::new("bad.obj", format!("{points}{row}\nf 1 2 3\n").as_bytes());
        let (scene, warnings) = loaded_with_warnings(&sample);
        assert_eq!(scene.triangle_count(), 1, "{row}");
        assert!(warnings.contains("line 4") && warnings.contains(reason), "{row}: {warnings}");
        assert!(warnings.contains("bad.obj"), "the file is named: {warnings}");
    }
    let many = Sample::new("many.obj", format!("{points}{}f 1 2 3\n", "f 1 2\n".repeat(1000)).as_bytes());
    let (_, warnings) = loaded_with_warnings(&many);
    assert!(warnings.lines().count() == 1 && warnings.contains("1000, the first: line 4 (f)"), "{warnings}");
    for (file, reason) in
        [("", "no triangles"), (points, "no triangles"), ("f 1 2 3", "line 1 (f)"), ("v 1\nf 1 1 1", "line 2")]
    {
        assert!(refusal("empty.obj", file.as_bytes()).contains(reason), "{file}");
    }
}

#[test]
fn corners_lose_what_is_not_there() {
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for corners in [
        "1/1 2/1 3/1",
        "1//9 2 3",
        "1/1/1 2/2/1 3/3/1",
        "1/9223372036854775807/9223372036854775807 2 3",
        "1/-9223372036854775808 2 3",
    ] {
        let sample = Sample::new("a.obj", format!("{points}f {corners}\n").as_bytes());
        let (scene, warnings) = loaded_with_warnings(&sample);
        assert!(scene.meshes[0].vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0] && v.uv == [0.0; 2]), "{corners}");
        assert!(warnings.contains("line 4") && warnings.contains("dropped"), "{warnings}");
    }
}

#[test]
fn mtl_statements_without_numbers_are_left_out() {
    for statement in ["Kd 1 x", "Kd", "Kd 1e39 0 0", "Ns nan", "d"] {
        let sample = Sample::new("a.obj", format!("mtllib a.mtl\nusemtl a\n{}", cube_obj()).as_bytes())
            .with("a.mtl", format!("newmtl a\n{statement}\nKe 1 0 0").as_bytes());
        let (scene, warnings) = loaded_with_warnings(&sample);
        assert_eq!((scene.materials[0].base_color_linear, scene.materials[0].emissive_linear), ([1.0; 4], Vec3::X));
        assert!(warnings.contains("mtllib a.mtl, line 2"), "{statement}: {warnings}");
    }
}

#[test]
fn ply_rows_beyond_the_file_are_refused_before_allocation() {
    for (format, vertices, faces) in
        [("ascii", 1 << 31, 1), ("binary_little_endian", 8, usize::MAX), ("binary_big_endian", 1 << 40, 6)]
    {
        assert!(refusal("huge.ply", ply_header(format, vertices, faces).as_bytes()).contains("do not fit"));
    }
    let mut list = cube_ply_binary(false);
    let text = String::from_utf8_lossy(&list).into_owned();
    let end = text.find("end_header").unwrap();
    list.splice(..end, text[..end].replace("list uchar", "list uint").into_bytes());
    assert!(refusal("list.ply", &list).contains("face"), "a list of 2^31 corners");
}

#[test]
fn bad_ply_files_are_refused_by_element() {
    let ascii = String::from_utf8(cube_ply_ascii()).unwrap();
    let bad = |from: &str, to: &str| refusal("bad.ply", ascii.replacen(from, to, 1).as_bytes());
    assert!(bad("4 0 3 2 1", "4 0 3 2 x").contains("face 0"));
    assert!(bad("-0.5 -0.5 -0.5 10", "x -0.5 -0.5 10").contains("vertex 0"));
    assert!(bad("property float x", "property float w").contains("x, y, z"));
    assert!(bad("element vertex 8", "element node 8").contains("no element vertex"));
    assert!(bad("ascii", "utf8").contains("header"));
    assert!(bad("element face 6", "element face 0").contains("point clouds"));
    assert!(bad("element face 6", "element edge 6").contains("point clouds"));
    assert!(bad("comment cube", "element nothing 18446744073709551615").contains("no properties"));
    assert!(refusal("not.ply", b"not a ply").contains("header"));
}

#[test]
fn ply_normals_coordinates_floats_and_other_elements_are_read() {
    let text = "ply\nformat ascii 1.0\nelement material 2\nproperty list uchar float a\nproperty int b\nelement vertex 3\n\
        property double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\n\
        property float u\nproperty float v\nproperty float red\nproperty float green\nproperty float blue\n\
        element face 1\nproperty list uchar uint vertex_index\nend_header\n\
        2 0.5 0.5 7\n0 8\n0 0 0 0 0 2 0.25 0.25 1 0.5 0\n1 0 0 0 0 1 1 1 0 0 0\n0 1 0 0 0 1 0 0 0 0 0\n3 0 1 2";
    let scene = load("rich.ply", text.replace('\n', "\r\n").as_bytes()).unwrap();
    let vertex = scene.meshes[0].vertices[0];
    assert_eq!((vertex.normal, vertex.uv, vertex.color_srgba8), ([0.0, 0.0, 1.0], [0.25, 0.75], [255, 128, 0, 255]));
}

#[test]
fn limits_hold_for_obj_and_ply() {
    for (name, bytes) in [("a.obj", cube_obj().into_bytes()), ("a.ply", cube_ply_binary(false))] {
        let sample = Sample::new(name, &bytes);
        for limits in [
            Limits { triangles: 11, ..Limits::default() },
            Limits { vertices: 7, ..Limits::default() },
            Limits { file_bytes: 99, ..Limits::default() },
        ] {
            let error = load_file(&sample.path, &limits, MissingTextures::Refuse).unwrap_err();
            assert!(matches!(error.kind, SceneErrorKind::TooLarge { .. }), "{name}: {error}");
        }
    }
}

#[test]
fn a_centimetre_survives_at_two_thousand_kilometres() {
    let at = |x: f64| format!("{:.3}", 2_684_572.0 + x);
    let text = format!(
        "v {} 1246324.5 448.1\nv {} 1246324.5 448.1\nv {} 1246374.5 448.1\nf 1 2 3\n",
        at(0.0),
        at(0.01),
        at(50.0)
    );
    let scene = load("grid.obj", text.as_bytes()).unwrap();
    let x = |i: usize| {
        f64::from(scene.meshes[0].vertices[i].position[0]) + f64::from(scene.instances[0].world_from_mesh.translation.x)
    };
    assert!((x(1) - x(0) - 0.01).abs() < 1e-5, "{}", x(1) - x(0));
    let restored = x(0) + scene.source_space.origin_in_source.x;
    assert!((restored - 2_684_572.0).abs() < 1e-3, "{restored}");
    assert!(scene.bounds().center().length() < 1.0);
    assert_eq!(scene.source_space.origin_in_source, scene.source_space.origin_in_source.round(), "whole metres");
}

#[test]
fn models_near_the_origin_keep_their_coordinates() {
    let text = "v 9000 0 0\nv 9010 0 0\nv 9000 10 0\nf 1 2 3\n";
    let scene = load("near.obj", text.as_bytes()).unwrap();
    assert_eq!((scene.source_space.origin_in_source, scene.bounds().min.x), (DVec3::ZERO, 9000.0));
    let small = "v 10 0 0\nv 10.001 0 0\nv 10 0.001 0\nf 1 2 3\n";
    let scene = load("small.obj", small.as_bytes()).unwrap();
    assert!((scene.source_space.origin_in_source.x - 10.0005).abs() < 1e-9 && scene.bounds().center().length() < 1e-6);
}

#[test]
fn unlit_sources_get_the_default_lights_by_spec() {
    let sample = Sample::new("cube.obj", cube_obj().as_bytes());
    let spec: SceneSpec = sample.path.to_str().unwrap().parse().unwrap();
    assert!(!sample.load().unwrap().has_light());
    let lit = spec.load(&Limits::default(), MissingTextures::Refuse).unwrap();
    assert_eq!(lit.illumination.lights.len(), 1);
    assert_eq!(lit.clone().with_default_lights(), lit, "lights that are there are kept");
}

#[test]
fn unknown_kinds_and_missing_files_are_refused() {
    assert!(refusal("a.blend", b"BLENDER").contains("blend"));
    assert!(refusal("noextension", b"").contains("not supported"));
    let missing = load_file("/nowhere/at/all.obj".as_ref(), &Limits::default(), MissingTextures::Refuse).unwrap_err();
    assert!(matches!(missing.kind, SceneErrorKind::Io(_)));
    let folder = Sample::new("x.txt", b"");
    std::fs::create_dir(folder.dir.path().join("dir.obj")).unwrap();
    assert!(load_file(&folder.dir.path().join("dir.obj"), &Limits::default(), MissingTextures::Refuse).is_err());
}
