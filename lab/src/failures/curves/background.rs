//! Rays into the background: past the farthest sample of every image, and along the lines of sight of a camera.

use depth_image::{PinholeCamera, ProvenanceKind, View};
use fixtures::quad;
use glam::{UVec2, Vec3};
use scene::Scene;
use scene::procedural::tree_terrain;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{depths, is_kind, share};
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Stage, looking};
use crate::failures::stand::Stand;

const Y: [&str; 2] = ["pixels of the background that are filled or covered", ""];
const SERIES: &[Series] = &[Series::new("joint_carve", &[Shape::Bounded { least: 0.0, most: 0.01 }])];

pub const CURVES: [Curve; 2] = [
    Curve {
        name: "Background against the room behind the farthest sample",
        subject: "a card at 1 m before the sky, two images; a wall that neither shows extends the volume",
        x: X::log("depth of the volume", "m", &[2.0, 5.0, 10.0, 100.0, 1000.0]).with_small(&[2.0, 10.0, 100.0]),
        y: Y,
        series: SERIES,
        why: "A texel of background proves the whole way free, also behind the farthest sample of its image.",
        measure: by_depth,
    },
    Curve {
        name: "Background against the distance from a camera",
        subject: "a tree before the sky, two images",
        x: X::log("distance of the eye", "m", &[1e-4, 1e-3, 0.01, 0.03, 0.1, 0.2]).with_small(&[1e-3, 0.01, 0.1]),
        y: Y,
        series: SERIES,
        why: "Near a camera the rays of a view end where they vanish in its image: in a node that they never leave.",
        measure: by_distance,
    },
];

fn by_depth(stand: &Stand, depths_m: &[f64]) -> anyhow::Result<Rows> {
    rows(depths_m, |depth_m| {
        let depth_m = depth_m as f32;
        let mut scene = quad(Vec3::new(-0.1, 0.0, -1.0), 0.2, Vec3::Z, [180, 90, 40]);
        let wall = quad(Vec3::new(2.0 * depth_m, 0.0, -depth_m), depth_m, Vec3::Z, [40, 90, 180]);
        scene.instances.push(scene::Instance { mesh: 1, ..wall.instances[0] });
        scene.meshes.extend(wall.meshes);
        let places = [(-0.1, stand.sample_px), (0.1, stand.sample_px), (0.03, stand.view_px)];
        let [left, right, view] =
            places.map(|(x, size_px)| looking(Vec3::X * x, Vec3::new(x, 0.0, -1.0), 40.0, size_px));
        covered_background(stand, &scene, &[left, right], view)
    })
}

fn by_distance(stand: &Stand, distances_m: &[f64]) -> anyhow::Result<Rows> {
    let samples = [0.0, 0.4].map(|x| tree_camera(x, stand.sample_px));
    rows(distances_m, |distance_m| {
        covered_background(stand, &tree_terrain(2000, 1), &samples, tree_camera(distance_m as f32, stand.view_px))
    })
}

fn tree_camera(x_m: f32, size_px: UVec2) -> PinholeCamera {
    looking(Vec3::new(x_m, 0.6, 2.5), Vec3::new(x_m, 0.6, 0.0), 45.0, size_px)
}

/// The share of the background's pixels, but for those beside a surface, that the carve does not leave empty.
fn covered_background(
    stand: &Stand,
    scene: &Scene,
    samples: &[PinholeCamera],
    camera: PinholeCamera,
) -> anyhow::Result<[f64; 1]> {
    let stage = Stage::new(stand, scene, samples)?;
    let truth: &View = &stage.truth(&[camera])?[0];
    let view: &View = &stage.views(&[camera], CARVE)?[0];
    let empty = is_kind(view, ProvenanceKind::Empty).enumerate();
    let open = empty.filter(|(place, _)| is_open(depths(truth), camera.size_px, *place));
    Ok([share(open.map(|(_, is_empty)| !is_empty))])
}

/// Whether a pixel and all around it show the background.
fn is_open(depths: &[f32], size_px: UVec2, place: usize) -> bool {
    let [columns, rows] = size_px.to_array().map(|side| side as usize);
    let x = place % columns;
    let y = place / columns;
    let mut around =
        (y.max(1) - 1..(y + 2).min(rows)).flat_map(|y| (x.max(1) - 1..(x + 2).min(columns)).map(move |x| (x, y)));
    around.all(|(x, y)| depths[y * columns + x] <= 0.0)
}
