//! Skins of careless exporters, nodes without size, and deep hierarchies.

use glam::Vec3;
use scene::{Scene, load_file};

use crate::samples::skinned::Tube;
use crate::samples::warnings::{with_one_warning, with_warnings};
use crate::samples::{GltfCube, Sample, cube, cube_triangles, load, refusal, signed_volume};

/// The vertices of [`Tube::bending`], six a ring.
const VERTICES: usize = 9 * 6;

fn positions(scene: &Scene, time_s: f32) -> Vec<Vec3> {
    let frozen = scene.frozen_at(time_s);
    let mesh = frozen.instances[0].mesh as usize;
    frozen.meshes[mesh].vertices.iter().map(|v| Vec3::from(v.position)).collect()
}

fn loaded(change: impl FnOnce(&mut Tube)) -> Scene {
    let mut tube = Tube::bending();
    change(&mut tube);
    load("tube.glb", &tube.glb()).unwrap()
}

#[test]
fn vertices_without_weights_follow_the_node_of_their_mesh() {
    let scene = loaded(|tube| {
        let weights: Vec<f32> = (0..VERTICES).flat_map(|v| [if v < 6 { 0.0 } else { 1.0 }, 0.0, 0.0, 0.0]).collect();
        let accessor = tube.floats(&weights, "VEC4");
        tube.set_attribute("WEIGHTS_0", accessor);
        tube.nodes = tube.nodes.replacen(r#""skin":0"#, r#""skin":0,"translation":[0,7,0]"#, 1);
    });
    let plain = positions(&loaded(|_| {}), 0.0);
    let moved = positions(&scene, 0.0);
    // Joints place their vertices without the node's transform (glTF 2.0, 3.7.3.2); the others have nothing else.
    for (vertex, (plain, moved)) in plain.iter().zip(&moved).enumerate() {
        let expected = if vertex < 6 { *plain + Vec3::Y * 7.0 } else { *plain };
        assert!(expected.distance(*moved) < 1e-5, "{vertex}: {moved}, not {expected}");
    }
}

#[test]
fn weights_of_any_sum_are_those_that_sum_to_1() {
    let weighted = |weights: [f32; 4]| {
        positions(
            &loaded(|tube| {
                let accessor = tube.floats(&weights.repeat(VERTICES), "VEC4");
                tube.set_attribute("WEIGHTS_0", accessor);
                let joints = tube.shorts(&[0, 1, 0, 0].repeat(VERTICES));
                tube.set_attribute("JOINTS_0", joints);
            }),
            1.0,
        )
    };
    let expected = weighted([0.75, 0.25, 0.0, 0.0]);
    for scale in [0.8, 2.0, 0.001] {
        let found = weighted([0.75 * scale, 0.25 * scale, 0.0, 0.0]);
        assert!(found.iter().zip(&expected).all(|(a, b)| a.distance(*b) < 1e-5), "{scale}");
    }
}

#[test]
fn a_primitive_without_joints_is_rigid_beside_one_with_joints() {
    let mut tube = Tube::bending();
    let rigid = tube.floats(&[0., 5., 0., 1., 5., 0., 0., 6., 0.], "VEC3");
    let json =
        tube.json().replace(r#""primitives":["#, &format!(r#""primitives":[{{"attributes":{{"POSITION":{rigid}}}}},"#));
    let scene = load("two.glb", &crate::samples::glb(&json, &tube.binary)).unwrap();
    for time_s in [0.0, 1.0] {
        assert_eq!(positions(&scene, time_s)[..3], [Vec3::Y * 5.0, Vec3::new(1.0, 5.0, 0.0), Vec3::Y * 6.0]);
    }
    assert!(positions(&scene, 0.0)[3..] != positions(&scene, 1.0)[3..]);
    // A mesh of such primitives alone has a skin for nothing.
    let mut tube = Tube::new(1, 1, 3);
    tube.attributes = tube.attributes.replace("JOINTS_0", "_J");
    assert!(load("rigid.glb", &tube.glb()).unwrap().animation.is_none());
}

#[test]
fn a_bind_matrix_without_an_inverse_hides_its_vertices() {
    for second in [glam::Mat4::ZERO, glam::Mat4::from_scale(Vec3::new(1.0, 0.0, 0.0))] {
        let (scene, warning) = with_one_warning(|| {
            loaded(|tube| {
                let matrices = [glam::Mat4::IDENTITY, second].map(|matrix| matrix.to_cols_array()).concat();
                let accessor = tube.floats(&matrices, "MAT4");
                tube.skins = format!(r#"{{"inverseBindMatrices":{accessor},"joints":[1,2]}}"#);
            })
        });
        assert!(warning.contains("bind matrices without an inverse hide their vertices"), "{warning}");
        let points = positions(&scene, 0.0);
        // The first rings follow the first joint alone, and the last ones the second.
        let radius = |vertex: usize| points[vertex].with_x(0.0).length();
        assert!((radius(0) - 0.2).abs() < 1e-5 && radius(VERTICES - 1) < 1e-6, "{points:?}");
    }
}

#[test]
fn chains_of_joints_and_of_nodes_may_be_ten_thousand_deep() {
    let chain: String = (1..10_000).map(|i| format!(r#"{{"children":[{i}],"translation":[0,0.001,0]}},"#)).collect();
    let deep = cube(|c| c.nodes = chain + r#"{"mesh":0}"#);
    let scene = load("deep.glb", &deep.glb()).unwrap();
    assert!((scene.bounds().center().y - 9.999).abs() < 1e-3, "{}", scene.bounds().center());
    let tube = Tube::new(2000, 1, 3);
    let rings = load("chain.glb", &tube.glb()).unwrap();
    // Joints of this tube have numbers of eight bits, of which 250 are different.
    assert!(rings.animation.unwrap().moving[0].joints.len() >= 2000);
}

#[test]
fn nodes_of_scale_0_are_hidden_and_flat_ones_are_flat() {
    let placed = |scale: &str| {
        load(
            "a.glb",
            &cube(|c| {
                c.nodes = format!(r#"{{"mesh":0}},{{"mesh":0,"translation":[2,0,0],"scale":[{scale}]}}"#);
                c.roots = "0,1".into();
            })
            .glb(),
        )
        .unwrap()
    };
    for hidden in ["0,0,0", "1,0,0", "0,0,-1"] {
        let scene = placed(hidden);
        assert_eq!((scene.instances.len(), scene.triangle_count(), scene.bounds().max.x), (1, 12, 0.5), "{hidden}");
    }
    let flat = placed("1,0,2");
    assert_eq!((flat.triangle_count(), flat.bounds().max), (24, Vec3::new(2.5, 0.5, 1.0)));
    let upright = flat.meshes[1].vertices.iter().all(|v| v.position[1] == 0.0 && v.normal[1].abs() > 0.99);
    assert!(upright, "{:?}", flat.meshes[1].vertices);
    // Flat copies take memory of their own.
    let sample = Sample::new("many.glb", &{
        let nodes: Vec<String> = (0..50).map(|_| r#"{"mesh":0,"scale":[1,0,1]}"#.into()).collect();
        let roots: Vec<String> = (0..50).map(|i| i.to_string()).collect();
        cube(|c| (c.nodes, c.roots) = (nodes.join(","), roots.join(","))).glb()
    });
    let limits = scene::Limits { vertices: 200, ..scene::Limits::default() };
    let error = load_file(&sample.path, &limits, scene::ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("vertices of flattened meshes"), "{error}");
    let zeros = cube(|c| {
        c.nodes = r#"{"mesh":0},{"mesh":0,"matrix":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]}"#.into();
        c.roots = "0,1".into();
    });
    assert_eq!(load("zeros.glb", &zeros.glb()).unwrap().triangle_count(), 12);
    let all_hidden = cube(|c| c.nodes = r#"{"mesh":0,"scale":[0,0,0]}"#.into());
    assert!(refusal("none.glb", &all_hidden.glb()).contains("no triangles in scene 0"));
}

#[test]
fn cameras_without_size_and_lamps_of_negative_strength_are_left_out() {
    let (scene, warnings) = with_warnings(|| {
        let lit = cube(|c| {
            c.nodes = r#"{"mesh":0},{"camera":0,"scale":[0,0,0]},{"extensions":{"KHR_lights_punctual":{"light":0}}},
                {"extensions":{"KHR_lights_punctual":{"light":1}}}"#
                .into();
            c.roots = "0,1,2,3".into();
            c.more = r#""cameras":[{"name":"eye","type":"perspective","perspective":{"yfov":1,"znear":0.1}}],
                "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":-5,"name":"dark"},
                {"type":"point","intensity":3}]}},"#
                .into();
        });
        load("a.glb", &lit.glb()).unwrap()
    });
    assert_eq!((scene.cameras.len(), scene.illumination.lights.len()), (0, 1));
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings.iter().any(|w| w.contains(r#"left out: node 1, camera "eye""#)), "{warnings:?}");
    assert!(
        warnings.iter().any(|w| w.contains("lights of negative strength are left out: light 0 (dark)")),
        "{warnings:?}"
    );
}

/// A cube with one morph target that moves all corners by 3 along x, with `mesh` and `node` as further members.
fn morphed(mesh: &str, nodes: &str, roots: &str) -> Scene {
    let mut cube = cube(|c: &mut GltfCube| {
        c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"targets":[{"POSITION":2},{"POSITION":0}]}"#.into();
        c.accessors += r#",{"bufferView":2,"componentType":5126,"count":8,"type":"VEC3"}"#;
        c.views += r#",{"buffer":0,"byteOffset":168,"byteLength":96}"#;
        c.buffers = r#"{"byteLength":264}"#.into();
        c.binary.extend([3f32, 0.0, 0.0].repeat(8).iter().flat_map(|v| v.to_le_bytes()));
        c.nodes = nodes.into();
        c.roots = roots.into();
    });
    let json = cube.json().replace(r#""meshes":[{"#, &format!(r#""meshes":[{{{mesh}"#));
    cube.binary.resize(264, 0);
    let (scene, warnings) = with_warnings(|| load("a.glb", &crate::samples::glb(&json, &cube.binary)).unwrap());
    assert!(warnings.is_empty(), "{warnings:?}");
    scene
}

#[test]
fn morph_targets_have_the_weights_of_the_mesh_or_of_the_node() {
    let moved_by = |scene: &Scene, instance: usize| {
        let instance = &scene.instances[instance];
        scene.meshes[instance.mesh as usize].vertices.iter().map(|v| v.position[0]).fold(f32::MIN, f32::max) - 0.5
    };
    let plain = r#"{"mesh":0}"#;
    assert_eq!(moved_by(&morphed("", plain, "0"), 0), 0.0);
    assert_eq!(moved_by(&morphed(r#""weights":[0.5],"#, plain, "0"), 0), 1.5);
    let nodes = r#"{"mesh":0},{"mesh":0,"weights":[1,0]},{"mesh":0,"weights":[1,0]},{"mesh":0,"weights":[0,0]}"#;
    let scene = morphed(r#""weights":[0.5,0],"#, nodes, "0,1,2,3");
    let mut found = [0, 1, 2, 3].map(|instance| moved_by(&scene, instance));
    found.sort_by(f32::total_cmp);
    assert_eq!((scene.meshes.len(), found), (3, [0.0, 1.5, 3.0, 3.0]));
    // The second target makes the cube twice as large.
    assert!((signed_volume(&morphed(r#""weights":[0,1],"#, plain, "0")) - 8.0).abs() < 1e-4);
    assert_eq!(cube_triangles().len(), 36);
}

#[test]
fn vertex_colours_above_1_stay_above_1() {
    let colored = |strongest: f32| {
        cube(|c| {
            c.primitive = r#"{"attributes":{"POSITION":0,"COLOR_0":2},"indices":1,"material":0}"#.into();
            c.accessors += r#",{"bufferView":2,"componentType":5126,"count":8,"type":"VEC3"}"#;
            c.views += r#",{"buffer":0,"byteOffset":168,"byteLength":96}"#;
            c.buffers = r#"{"byteLength":264}"#.into();
            c.binary.extend([0.5, 1.0, strongest].repeat(8).iter().flat_map(|v| v.to_le_bytes()));
            c.more = r#""materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,1]}}],"#.into();
        })
    };
    let shown = |scene: &Scene| {
        let mesh = &scene.meshes[0];
        let material = &scene.materials[mesh.parts[0].material as usize];
        let [r, g, b, _] = mesh.vertices[0].color_srgba8;
        let linear = [r, g, b].map(depth_image::linear_from_srgb8);
        Vec3::from(linear) * Vec3::from_slice(&material.base_color_linear[..3])
    };
    let (bright, warning) = with_one_warning(|| load("a.glb", &colored(4.0).glb()).unwrap());
    assert!(
        warning.contains("colours of vertices are above 1") && warning.contains("mesh 0, primitive 0"),
        "{warning}"
    );
    let expected = Vec3::new(0.25, 0.25, 4.0);
    assert!(shown(&bright).distance(expected) < 0.01, "{}", shown(&bright));
    assert_eq!(bright.materials[0].base_color_linear, [0.5, 0.25, 1.0, 1.0], "other meshes keep the material");
    assert_eq!(load("a.glb", &colored(1.0).glb()).unwrap().materials.len(), 2);
}

#[test]
fn moving_morph_targets_are_named() {
    let moving = cube(|c: &mut GltfCube| {
        c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"targets":[{"POSITION":0}]}"#.into();
        c.more = r#""animations":[{"name":"talk","channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}],
            "samplers":[{"input":0,"output":0}]}],"#
            .into();
    });
    let (scene, warning) = with_one_warning(|| load("a.glb", &moving.glb()).unwrap());
    assert!((signed_volume(&scene) - 1.0).abs() < 1e-6);
    assert!(
        warning.contains("channels that move morph targets") && warning.contains("animation 0 (talk)"),
        "{warning}"
    );
}

#[test]
fn colours_of_integers_are_shares_also_where_the_file_does_not_say_so() {
    let colored = cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0,"COLOR_0":2},"indices":1}"#.into();
        c.accessors += r#",{"bufferView":2,"componentType":5121,"count":8,"type":"VEC4"}"#;
        c.views += r#",{"buffer":0,"byteOffset":168,"byteLength":32}"#;
        c.buffers = r#"{"byteLength":200}"#.into();
        c.binary.extend([55, 0, 255, 128].repeat(8));
    });
    let (scene, warnings) = with_warnings(|| load("a.glb", &colored.glb()).unwrap());
    assert_eq!(scene.meshes[0].vertices[0].color_srgba8, [128, 0, 255, 128]);
    assert!(warnings.is_empty(), "{warnings:?}");
}
