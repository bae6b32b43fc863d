//! A model from a file fills the default picture.

use std::f32::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use app_core::setup::{SceneArgs, Setup};
use clap::Parser;
use depth_image::{PinholeCamera, ViewCell};
use glam::{UVec2, Vec2, Vec3};

/// The size of a view by default.
const VIEW_PX: UVec2 = UVec2::new(200, 150);

#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    scene: SceneArgs,
}

fn loaded(file: &Path, more: &[&str]) -> anyhow::Result<Setup> {
    let arguments = ["test", "--scene", file.to_str().unwrap()].into_iter().chain(more.iter().copied());
    Arguments::try_parse_from(arguments).unwrap().scene.load()
}

fn written(folder: &Path, name: &str, triangles: &[[Vec3; 3]]) -> PathBuf {
    let mut text = String::new();
    for [a, b, c] in triangles {
        [a, b, c].iter().for_each(|p| writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap());
        writeln!(text, "f -3 -2 -1").unwrap();
    }
    let file = folder.join(format!("{name}.obj"));
    std::fs::write(&file, text).unwrap();
    file
}

/// A grid over the unit square, bent into a surface.
fn surface(at: impl Fn(f32, f32) -> Vec3) -> Vec<[Vec3; 3]> {
    const STEPS: usize = 24;
    let point = |x: usize, y: usize| at(x as f32 / STEPS as f32, y as f32 / STEPS as f32);
    let cells = (0..STEPS).flat_map(|y| (0..STEPS).map(move |x| (x, y)));
    cells
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [point(x, y), point(x + 1, y), point(x, y + 1), point(x + 1, y + 1)];
            [[a, b, c], [d, c, b]]
        })
        .collect()
}

/// Radius and height of a body of revolution along its outline, from 0 to 1.
fn turned(outline: impl Fn(f32) -> Vec2) -> Vec<[Vec3; 3]> {
    surface(|u, v| {
        let at = outline(v);
        let around = Vec2::from_angle(u * TAU);
        Vec3::new(around.x * at.x, at.y, around.y * at.x)
    })
}

fn block(low: [f32; 3], high: [f32; 3]) -> Vec<[Vec3; 3]> {
    let low = Vec3::from(low);
    let high = Vec3::from(high);
    let corner = |i: usize| Vec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
    let sides = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 3, 6, 7], [0, 2, 4, 6], [1, 3, 5, 7]];
    sides.iter().flat_map(|side| [[0, 1, 2], [3, 2, 1]].map(|t| t.map(|i: usize| corner(side[i])))).collect()
}

/// Ten shapes of every proportion, some off the origin.
fn shapes() -> Vec<(&'static str, Vec<[Vec3; 3]>)> {
    let ring = |u: f32, v: f32| {
        let around = Vec2::from_angle(u * TAU);
        let across = Vec2::from_angle(v * TAU);
        let radius = 1.0 + 0.35 * across.x;
        Vec3::new(around.x * radius, 0.35 * across.y, around.y * radius)
    };
    let steps = (0..5).flat_map(|i| {
        let at = i as f32;
        block([0.0, 0.0, -at - 1.0], [3.0, 5.0 - at, -at])
    });
    let table = [[0.0, 0.0], [1.8, 0.0], [0.0, 0.9], [1.8, 0.9]].into_iter();
    let table = table.flat_map(|[x, z]| block([x, 0.0, z], [x + 0.2, 0.9, z + 0.2]));
    let car = block([-2.2, 0.3, -0.9], [2.2, 0.9, 0.9]).into_iter().chain(block([-1.2, 0.9, -0.8], [1.0, 1.5, 0.8]));
    vec![
        ("cube", block([9.0, 9.0, 9.0], [11.0, 11.0, 11.0])),
        ("sphere", turned(|v| Vec2::new((v * PI).sin(), -(v * PI).cos()))),
        ("cone", turned(|v| Vec2::new(1.0 - v, 2.0 * v))),
        ("vase", turned(|v| Vec2::new(0.45 + 0.3 * (v * 4.5).sin(), 2.0 * v))),
        ("ring", surface(ring)),
        ("stairs", steps.collect()),
        ("table", table.chain(block([0.0, 0.9, 0.0], [2.0, 1.0, 1.1])).collect()),
        ("car", car.collect()),
        ("slab", block([0.0, 0.0, 0.0], [4.0, 0.4, 3.0])),
        ("tower", block([0.0, 0.0, 0.0], [1.0, 2.0, 1.0])),
    ]
}

/// The pixels of a view that triangles cover, and the least and the greatest projected corner.
fn drawn(camera: &PinholeCamera, triangles: impl Iterator<Item = [Vec3; 3]>) -> (f32, [Vec2; 2]) {
    let size = camera.size_px;
    let mut covered = vec![false; size.element_product() as usize];
    let mut least = Vec2::MAX;
    let mut most = Vec2::MIN;
    for corners in triangles {
        let seen = corners.map(|corner| camera.project(corner).unwrap());
        assert!(seen.iter().all(|at| at.planar_depth_m > camera.near_m), "a model reaches behind the near plane");
        let [a, b, c] = seen.map(|at| at.pixel);
        let low = a.min(b).min(c);
        let high = a.max(b).max(c);
        (least, most) = (least.min(low), most.max(high));
        let [low, high] = [low, high].map(|at| at.clamp(Vec2::ZERO, size.as_vec2()));
        for y in low.y as u32..high.y.ceil() as u32 {
            for x in low.x as u32..high.x.ceil() as u32 {
                let at = Vec2::new(x as f32, y as f32) + 0.5;
                let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(at - from));
                let inside = sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0);
                covered[(y * size.x + x) as usize] |= inside;
            }
        }
    }
    let share = covered.iter().filter(|&&covered| covered).count() as f32 / covered.len() as f32;
    (share, [least, most])
}

fn triangles(scene: &scene::Scene) -> impl Iterator<Item = [Vec3; 3]> {
    scene.instances.iter().flat_map(|instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        let point =
            move |i: u32| instance.world_from_mesh.transform_point3(Vec3::from(mesh.vertices[i as usize].position));
        mesh.indices.chunks_exact(3).map(move |t| [point(t[0]), point(t[1]), point(t[2])])
    })
}

fn middle_view(setup: &Setup) -> PinholeCamera {
    ViewCell::between(&setup.around).unwrap().camera_at(Vec2::ZERO, VIEW_PX)
}

#[test]
fn models_fill_the_default_picture_and_no_view_cuts_them_off() {
    let folder = tempfile::tempdir().unwrap();
    let mut shares = Vec::new();
    for (name, shape) in shapes() {
        let setup = loaded(&written(folder.path(), name, &shape), &[]).unwrap();
        let (share, [least, most]) = drawn(&middle_view(&setup), triangles(&setup.scene));
        let sides = (most - least) / VIEW_PX.as_vec2();
        assert!((0.8..=0.901).contains(&sides.max_element()), "{name}: {sides}");
        let forward = middle_view(&setup).forward_in_world();
        assert!((-0.51..-0.49).contains(&forward.y), "{name} is seen from {forward}");
        for sample in &setup.around {
            let (_, [least, most]) = drawn(sample, triangles(&setup.scene));
            assert!(least.min_element() > 0.0 && most.cmplt(sample.size_px.as_vec2()).all(), "{name}: {least} {most}");
        }
        shares.push((name, share));
    }
    let mean = shares.iter().map(|(_, share)| share).sum::<f32>() / shares.len() as f32;
    assert!(shares.len() == 10 && mean >= 0.35, "{mean}: {shares:?}");
}

/// A post on a plate, upright along each axis in turn.
#[test]
fn a_file_with_another_axis_upwards_is_turned() {
    let folder = tempfile::tempdir().unwrap();
    let post = [block([-2.0, 0.0, -1.0], [2.0, 0.1, 1.0]), block([-0.2, 0.1, -0.2], [0.2, 3.0, 0.2])].concat();
    // Places whose x or z takes the part of y.
    let lying = |axes: fn(Vec3) -> Vec3| post.iter().map(|t| t.map(axes)).collect::<Vec<_>>();
    let files =
        [("y", post.clone()), ("z", lying(|p| Vec3::new(p.x, -p.z, p.y))), ("x", lying(|p| Vec3::new(p.y, -p.x, p.z)))];
    let setups = files.map(|(up, triangles)| loaded(&written(folder.path(), up, &triangles), &["--up", up]).unwrap());
    let upright = setups[0].scene.bounds();
    for setup in &setups {
        assert_eq!(setup.scene.bounds(), upright);
        assert_eq!(setup.around, setups[0].around);
    }
    let error = loaded(Path::new("model.glb"), &["--up", "z"]).err().unwrap();
    assert!(format!("{error:#}").contains("model.glb is +Y up"), "{error:#}");
}
