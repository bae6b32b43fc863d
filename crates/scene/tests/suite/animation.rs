//! Animated scenes: import of glTF clips and skins, poses, bounds and packages.

use std::f32::consts::FRAC_1_SQRT_2;

use fixtures::unit_cube;
use glam::Vec3;
use scene::procedural::snake;
use scene::{Limits, MissingTextures, NodeTransform, Scene, Vertex, load_file, pack, unpack};

use crate::samples::skinned::{ChannelOf, Tube};
use crate::samples::{GltfCube, Sample, cube, load, refusal, signed_volume};

/// The vertices of the first instance at a moment, in the world.
fn posed(scene: &Scene, scene_time_s: f32) -> Vec<Vertex> {
    let frozen = scene.frozen_at(scene_time_s);
    frozen.meshes[frozen.instances[0].mesh as usize].vertices.clone()
}

fn is_near(vertex: &Vertex, point: Vec3, normal: Vec3) -> bool {
    Vec3::from(vertex.position).distance(point) < 1e-5 && Vec3::from(vertex.normal).distance(normal) < 1e-5
}

fn refused(change: impl FnOnce(&mut Tube)) -> String {
    let mut tube = Tube::bending();
    change(&mut tube);
    refusal("bad.glb", &tube.glb())
}

#[test]
fn a_joint_that_turns_by_90_degrees_moves_its_vertices_in_a_quarter_circle() {
    let scene = load("tube.glb", &Tube::bending().glb()).unwrap();
    assert_eq!(scene.contents(), "96 triangles; clips: bend (3 s, plays)");
    assert_eq!(scene.period_s(), Some(3.0));
    let rest = scene.meshes[0].vertices.clone();
    let tip = rest.iter().position(|v| v.position == [2.0, 0.2, 0.0]).unwrap();
    let foot = rest.iter().position(|v| v.position == [0.5, 0.2, 0.0]).unwrap();
    let middle = rest.iter().position(|v| v.position == [1.0, 0.2, 0.0]).unwrap();
    // Clips repeat after 3 s, also before 0.
    for (scene_time_s, turn_rad) in [(0.0, 0.0), (0.5, 0.25), (1.0, 0.5), (2.0, 0.25), (4.0, 0.5), (-2.0, 0.5f32)] {
        let turn = glam::Quat::from_rotation_z(turn_rad * std::f32::consts::PI);
        let vertices = posed(&scene, scene_time_s);
        let point = Vec3::X + turn * Vec3::new(1.0, 0.2, 0.0);
        assert!(is_near(&vertices[tip], point, turn * Vec3::Y), "{scene_time_s} s: {:?}", vertices[tip]);
        assert!(is_near(&vertices[foot], Vec3::new(0.5, 0.2, 0.0), Vec3::Y), "{scene_time_s} s");
        // The joint itself stays, and its ring turns with it.
        let point = Vec3::X + turn * Vec3::new(0.0, 0.2, 0.0);
        assert!(is_near(&vertices[middle], point, turn * Vec3::Y), "{scene_time_s} s: {:?}", vertices[middle]);
    }
    // Two joints of half a weight each: the mean of both places.
    let mut tube = Tube::bending();
    let halves = tube.floats(&[0.5, 0.5, 0.0, 0.0].repeat(rest.len()), "VEC4");
    let numbers = tube.shorts(&[0, 1, 0, 0].repeat(rest.len()));
    tube.set_attribute("WEIGHTS_0", halves);
    tube.set_attribute("JOINTS_0", numbers);
    let halved = posed(&load("tube.glb", &tube.glb()).unwrap(), 1.0);
    let normal = Vec3::new(-FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    assert!(
        is_near(&halved[tip], (Vec3::new(2.0, 0.2, 0.0) + Vec3::new(0.8, 1.0, 0.0)) * 0.5, normal),
        "{:?}",
        halved[tip]
    );
}

#[test]
fn nodes_move_their_meshes_and_all_below_by_lines_steps_and_splines() {
    let mut tube = Tube::new(1, 1, 3);
    // A parent that climbs, a child that grows, a twin that stays.
    tube.nodes = r#"{"children":[1]},{"mesh":0,"translation":[5,0,0]},{"mesh":0,"translation":[0,0,7]}"#.into();
    tube.roots = "0,2".into();
    tube.skins = r#"{"joints":[0]}"#.into();
    let climb = [0., 0., 0., 0., 2., 0., 0., 8., 0.];
    let grow = [0., 0., 0., 1., 1., 1., 0., 0., 0., 0., 0., 0., 3., 3., 3., 0., 0., 0.];
    tube.animate(
        "climb",
        &[(0, "translation", "LINEAR", &[0., 1., 2.], &climb), (1, "scale", "CUBICSPLINE", &[0., 2.], &grow)],
    );
    tube.animate("hop", &[(0, "translation", "STEP", &[0., 1., 2.], &climb)]);
    let mut scene = load("nodes.glb", &tube.glb()).unwrap();
    assert_eq!(scene.contents(), "12 triangles; clips: climb (2 s, plays), hop (2 s)");
    assert_eq!(scene.animation.as_ref().unwrap().moving.len(), 1, "the twin does not move");
    let middle = |scene: &Scene, t: f32| {
        let frozen = scene.frozen_at(t);
        let of = |i: usize| {
            depth_image::Aabb::around(
                frozen.meshes[frozen.instances[i].mesh as usize]
                    .vertices
                    .iter()
                    .map(|v| frozen.instances[i].world_from_mesh.transform_point3(v.position.into())),
            )
        };
        let moving = scene.animation.as_ref().unwrap().moving[0].instance as usize;
        (of(moving), of(1 - moving))
    };
    for (time_s, height_m, scale) in [(0.0, 0.0, 1.0), (0.5, 1.0, 1.0 + 2.0 * 0.15625), (1.5, 5.0, 1.0 + 2.0 * 0.84375)]
    {
        let (moved, still) = middle(&scene, time_s);
        assert!((moved.min.x - 5.0).abs() < 1e-5 && (moved.max.x - 5.0 - scale).abs() < 1e-5, "{time_s}: {moved:?}");
        assert!((moved.max.y - height_m - 0.2 * scale).abs() < 1e-5, "{time_s}: {moved:?}");
        assert!((still.max.y - 0.2).abs() < 1e-6 && still.max.z > 6.9);
    }
    scene.play("hop").unwrap();
    for (time_s, height_m) in [(0.0, 0.0), (0.99, 0.0), (1.0, 2.0), (1.99, 2.0), (2.0, 0.0)] {
        assert!((middle(&scene, time_s).0.max.y - height_m - 0.2).abs() < 1e-5, "{time_s} s");
    }
    let error = scene.play("run").unwrap_err().to_string();
    assert_eq!(error, r#""run" is no clip of the scene, which has climb, hop"#);
    assert!(unit_cube().play("run").unwrap_err().to_string().ends_with("which has none"));
}

#[test]
fn what_a_clip_grows_may_have_no_size_at_rest() {
    let mut tube = Tube::new(1, 1, 3);
    tube.nodes = r#"{"mesh":0,"scale":[0,0,0],"translation":[3,0,0]}"#.into();
    (tube.roots, tube.skins) = ("0".into(), r#"{"joints":[0]}"#.into());
    assert!(refusal("still.glb", &tube.glb()).contains("no triangles in scene 0"));
    tube.animate("grow", &[(0, "scale", "LINEAR", &[0., 1.], &[0., 0., 0., 2., 2., 2.])]);
    let scene = load("grows.glb", &tube.glb()).unwrap();
    let reach_m = |t: f32| posed(&scene, t).iter().map(|v| v.position[0] - 3.0).fold(0.0, f32::max);
    assert_eq!([reach_m(0.0), reach_m(0.5)], [0.0, 1.0]);
    assert!(posed(&scene, 0.0).iter().all(|v| (Vec3::from(v.normal).length() - 1.0).abs() < 1e-3));
}

#[test]
fn a_skin_without_clips_is_shown_as_its_joints_stand() {
    let mut tube = Tube::new(2, 2, 4);
    // The mesh's own node counts for nothing; the second joint is turned.
    tube.nodes = format!(
        r#"{{"mesh":0,"skin":0,"translation":[9,9,9],"scale":[0,1,1]}},{{"children":[2]}},{{"translation":[1,0,0],"rotation":[0,0,{0},{0}]}}"#,
        FRAC_1_SQRT_2
    );
    let scene = load("still.glb", &tube.glb()).unwrap();
    assert_eq!(scene.period_s(), None);
    let rest = &scene.meshes[0].vertices;
    let stands = posed(&scene, 3.0);
    let tip = rest.iter().position(|v| v.position == [2.0, 0.2, 0.0]).unwrap();
    assert!(is_near(&stands[tip], Vec3::new(0.8, 1.0, 0.0), Vec3::NEG_X), "{:?}", stands[tip]);
}

/// The tube is open: two disks close its volume.
#[test]
fn mirrored_joints_and_far_places_keep_triangles_outside_out() {
    let volume = |tube: &Tube, t: f32| signed_volume(&load("tube.glb", &tube.glb()).unwrap().frozen_at(t));
    let plain = Tube::bending();
    let mut mirrored = plain.clone();
    mirrored.nodes = mirrored.nodes.replacen(r#"{"translation":[0,0,0]"#, r#"{"scale":[1,1,-1]"#, 1);
    let mut far = plain.clone();
    far.nodes = far.nodes.replacen(r#"{"translation":[0,0,0]"#, r#"{"translation":[5000000,0,2000]"#, 1);
    for time_s in [0.0, 0.4, 1.0] {
        let expected = volume(&plain, time_s);
        assert!(expected > 0.05, "{expected}");
        assert!((volume(&mirrored, time_s) - expected).abs() < 1e-4, "{}", volume(&mirrored, time_s));
        let scene = load("far.glb", &far.glb()).unwrap();
        assert!(scene.source_space.origin_in_source.x > 4.9e6);
        let vertices = posed(&scene, time_s);
        assert!(vertices.iter().all(|v| Vec3::from(v.position).length() < 4.0));
        let lengths = |vertices: &[Vertex]| Vec3::from(vertices[3].position).distance(vertices[40].position.into());
        let near = posed(&load("tube.glb", &plain.glb()).unwrap(), time_s);
        assert!((lengths(&vertices) - lengths(&near)).abs() < 1e-5, "no detail is lost far away");
    }
}

#[test]
fn bounds_hold_all_moments_and_little_more() {
    let mut reared = snake();
    reared.play("rear").unwrap();
    let mut swung = Tube::bending();
    // Slopes throw the tube far beyond both keys.
    swung.animations.clear();
    let swing = [0., 0., 0., 0., 0., 0., 0., 9., 0., 0., -9., 0., 1., 0., 0., 0., 0., 0.];
    swung.animate("swing", &[(1, "translation", "CUBICSPLINE", &[0.5, 2.], &swing)]);
    let bending = load("tube.glb", &Tube::bending().glb()).unwrap();
    for scene in [snake(), reared, bending, load("swung.glb", &swung.glb()).unwrap()] {
        let period_s = scene.period_s().unwrap();
        let all = scene.bounds();
        let mut around = depth_image::Aabb::EMPTY;
        for step in 0..777 {
            let at = scene.frozen_at(step as f32 * period_s / 777.0).bounds();
            around = around.grown_to(at.min).grown_to(at.max);
        }
        let spare = (around.min - all.min).min(all.max - around.max);
        let size = around.size().max_element();
        println!("{}: {around:?} in {all:?}", scene.name);
        assert!(spare.min_element() >= -1e-5 * size, "{}: {spare}", scene.name);
        assert!(all.size().max_element() < 1.2 * size, "{}: {all:?}", scene.name);
    }
}

#[test]
fn a_packed_animation_loses_nothing() {
    let tube = load("tube.glb", &Tube::bending().glb()).unwrap();
    for scene in [tube, snake()] {
        assert_eq!(unpack(&pack(&scene), &Limits::default()).unwrap(), scene);
    }
}

type Break = fn(&mut scene::Animation);

#[test]
fn an_invalid_animation_is_not_unpacked() {
    let broken: [(&str, Break); 15] = [
        ("parent", |a| a.nodes[1].parent = Some(1)),
        ("node 0", |a| a.nodes[0].rest = NodeTransform::Fixed(glam::DAffine3::from_scale(glam::DVec3::NAN))),
        ("moving instance 0", |a| a.moving[0].instance = 9),
        ("twice", |a| a.moving.push(a.moving[0].clone())),
        ("joint 3: node 99", |a| a.moving[0].joints[3].node = 99),
        ("not finite", |a| a.moving[0].joints[3].joint_from_mesh.matrix3.x_axis = glam::DVec3::NAN),
        ("no joint", |a| a.moving[0].joints.clear()),
        ("24 vertices", |a| a.moving[0].influences.truncate(24)),
        ("vertex 7", |a| a.moving[0].influences[7].joints[0] = 24),
        ("vertex 7", |a| a.moving[0].influences[7].weights = [f32::NAN; 4]),
        ("time 2 is before", |a| a.clips[0].channels[2].times_s.swap(1, 2)),
        ("values where", |a| a.clips[1].channels[2].values.truncate(3)),
        ("node 77", |a| a.clips[0].channels[2].node = 77),
        ("no unit quaternion", |a| a.clips[0].channels[0].values[1] = glam::Vec4::ZERO),
        ("playing", |a| a.playing = Some(2)),
    ];
    for (expected, break_it) in broken {
        let mut scene = snake();
        break_it(scene.animation.as_mut().unwrap());
        let error = unpack(&pack(&scene), &Limits::default()).unwrap_err().to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
    let mut scene = snake();
    scene.animation.as_mut().unwrap().world_from_source = glam::DAffine3::from_scale(glam::DVec3::splat(1e300));
    assert!(scene.validate(&Limits::default()).unwrap_err().to_string().contains("moves beyond"));
}

#[test]
fn weights_are_made_to_sum_to_1_and_the_strongest_four_count() {
    let mut tube = Tube::bending();
    let count = 9 * 6;
    let first = tube.floats(&[0.3, 0.2, 0.12, 0.02].repeat(count), "VEC4");
    let more = tube.floats(&[0.28, 0.0, 0.01, 0.0].repeat(count), "VEC4");
    let numbers = tube.shorts(&[0, 1, 0, 1].repeat(count));
    tube.set_attribute("WEIGHTS_0", first);
    tube.set_attribute("JOINTS_0", numbers);
    tube.attributes = tube.attributes.replacen('{', &format!(r#"{{"WEIGHTS_1":{more},"JOINTS_1":{numbers},"#), 1);
    let scene = load("tube.glb", &tube.glb()).unwrap();
    for influence in &scene.animation.unwrap().moving[0].influences {
        assert_eq!(influence.joints, [0, 0, 1, 0]);
        let expected = [0.3, 0.28, 0.2, 0.12].map(|w| w / 0.9);
        assert!(influence.weights.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-6), "{influence:?}");
    }
}

/// A change to a file.
type Damage = fn(&mut Tube);

/// The vertices of [`Tube::bending`].
const VERTICES: usize = 9 * 6;

/// Gives all vertices the same weights.
fn weights(tube: &mut Tube, of_each: [f32; 4]) {
    let accessor = tube.floats(&of_each.repeat(VERTICES), "VEC4");
    tube.set_attribute("WEIGHTS_0", accessor);
}

#[test]
fn damaged_skins_are_refused_by_their_field() {
    let cases: [(&str, Damage); 9] = [
        ("the sum of its weights is not finite", |t| weights(t, [3e38; 4])),
        ("the weight NaN", |t| weights(t, [f32::NAN, 0.0, 0.0, 1.0])),
        ("the weight -1", |t| weights(t, [2.0, -1.0, 0.0, 0.0])),
        ("joint 2 is beyond the skin's 2", |t| {
            let joints = t.shorts(&[2, 0, 0, 0].repeat(VERTICES));
            t.set_attribute("JOINTS_0", joints);
        }),
        ("JOINTS has 53 elements", |t| {
            let joints = t.shorts(&[0; 4 * 53]);
            t.set_attribute("JOINTS_0", joints);
        }),
        ("skin 0, inverseBindMatrices, matrix 1: it is not finite", |t| bind(t, f32::NAN)),
        ("1 matrices for 2 joints", |t| {
            let one = t.floats(&glam::Mat4::IDENTITY.to_cols_array(), "MAT4");
            t.skins = format!(r#"{{"inverseBindMatrices":{one},"joints":[1,2]}}"#);
        }),
        ("skin 0: it has no joints", |t| t.skins = r#"{"joints":[]}"#.into()),
        ("node 0: skin 1 does not exist", |t| t.nodes = t.nodes.replacen(r#""skin":0"#, r#""skin":1"#, 1)),
    ];
    for (expected, damage) in cases {
        let message = refused(damage);
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

/// Replaces the second joint's inverse bind matrix by one that scales x.
fn bind(tube: &mut Tube, scale: f32) {
    let matrices = [glam::Mat4::IDENTITY, glam::Mat4::from_scale(Vec3::new(scale, 1.0, 1.0))];
    let accessor = tube.floats(&matrices.map(|m| m.to_cols_array()).concat(), "MAT4");
    tube.skins = format!(r#"{{"inverseBindMatrices":{accessor},"joints":[1,2]}}"#);
}

#[test]
fn cyclic_skeletons_are_refused() {
    let reached = refused(|t| t.nodes = r#"{"mesh":0,"skin":0},{"children":[2]},{"children":[1]}"#.into());
    assert!(reached.contains("reached twice: a cycle"), "{reached}");
    let detached = refused(|t| {
        t.nodes = r#"{"mesh":0,"skin":0},{"children":[2]},{"children":[1]}"#.into();
        t.roots = "0".into();
    });
    assert!(detached.contains("skin 0, joint 0: node 1 is not in the scene, or in a cycle"), "{detached}");
}

#[test]
fn damaged_animations_are_refused_by_their_field() {
    const TURN: [f32; 8] = [0., 0., 0., 1., 0., 0., 1., 0.];
    let cases: [(&str, &[ChannelOf]); 12] = [
        (
            "animation 0, channel 0, input: time 1 is negative or not finite",
            &[(2, "rotation", "LINEAR", &[0., f32::NAN], &TURN)],
        ),
        ("input: time 0 is negative", &[(2, "rotation", "LINEAR", &[-1., 1.], &TURN)]),
        ("input: time 1 is before the one before it", &[(2, "rotation", "LINEAR", &[2., 1.], &TURN)]),
        ("target.path: neither translation", &[(2, "colour", "LINEAR", &[0., 1.], &[0.; 6])]),
        ("interpolation: unknown", &[(2, "rotation", "BEZIER", &[0., 1.], &TURN)]),
        ("output: 2 values where its keys need 6", &[(2, "rotation", "CUBICSPLINE", &[0., 1.], &TURN)]),
        ("output: 2 values where its keys need 3", &[(2, "rotation", "STEP", &[0., 1., 2.], &TURN)]),
        ("output: value 1 is no rotation", &[(2, "rotation", "LINEAR", &[0., 1.], &[0., 0., 0., 1., 0., 0., 0., 0.])]),
        ("output: value 0 is not finite", &[(2, "translation", "LINEAR", &[0.], &[f32::INFINITY, 0., 0.])]),
        ("channel 0: node 9 does not exist", &[(9, "rotation", "LINEAR", &[0., 1.], &TURN)]),
        (
            "channel 1: an earlier channel",
            &[(2, "rotation", "STEP", &[0., 1.], &TURN), (2, "rotation", "STEP", &[0., 1.], &TURN)],
        ),
        ("it moves beyond 1e9 m", &[(2, "scale", "LINEAR", &[0., 1.], &[1., 1., 1., 1e30, 1., 1.])]),
    ];
    for (expected, channels) in cases {
        let message = refused(|tube| {
            tube.animations.clear();
            tube.animate("bad", channels);
        });
        assert!(message.contains(expected), "{expected}: {message}");
    }
    let message = refused(|t| t.animations = t.animations.replace(r#""sampler":0"#, r#""sampler":5"#));
    assert!(message.contains("sampler 5 does not exist"), "{message}");
}

#[test]
fn keys_and_joints_over_the_limits_are_refused_before_they_are_read() {
    let sample = Sample::new("tube.glb", &Tube::bending().glb());
    let refused = |limits: Limits| load_file(&sample.path, &limits, MissingTextures::Refuse).unwrap_err().to_string();
    let keys = refused(Limits { keys: 2, ..Limits::default() });
    assert!(keys.contains("animation 0, channel 0, input, keys: 3 is over the limit of 2"), "{keys}");
    let mut twice = Tube::bending();
    twice.nodes += r#",{"mesh":0,"skin":0}"#;
    twice.roots += ",3";
    let sample = Sample::new("tube.glb", &twice.glb());
    let of = |limits: Limits| load_file(&sample.path, &limits, MissingTextures::Refuse);
    assert_eq!(of(Limits { vertices: 108, ..Limits::default() }).unwrap().animation.unwrap().moving.len(), 2);
    let vertices = of(Limits { vertices: 107, ..Limits::default() }).unwrap_err().to_string();
    assert!(vertices.contains("vertices of all skinned meshes"), "{vertices}");
}

#[test]
fn morph_targets_stay_at_rest() {
    let morphed = cube(|c: &mut GltfCube| {
        c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"targets":[{"POSITION":0}]}"#.into();
        c.more = r#""animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}],
            "samplers":[{"input":0,"output":0}]}],"#
            .into();
    });
    let scene = load("morphed.glb", &morphed.glb()).unwrap();
    assert!(scene.animation.is_none() && (signed_volume(&scene) - 1.0).abs() < 1e-6);
}
