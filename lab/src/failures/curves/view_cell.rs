//! Sample sets and the views that they serve: places outside the cell, its width, the number of images and their size, and a
//! yard that no camera sees.

use depth_image::{ProvenanceKind, View};
use fixtures::poles;
use glam::{Vec2, Vec3};
use metrics::unheld_rate;
use scene::procedural::{courtyard, tree_terrain};

use crate::failures::cached_light::pixels_where;
use crate::failures::curve::{Curve, FLIP, Rows, Series, X, rows};
use crate::failures::measures::{depths, is_kind, mean};
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, POLES, Stage, TREE, YARD, looking, search};
use crate::failures::stand::Stand;

const POLES_SUBJECT: &str = "nine poles before a wall, four images";
const POLE_RADIUS_M: f32 = 0.12;
/// The height of the eyes of cameras that do not see the yard, below the walls' tops.
const LOW_M: f32 = 1.7;
/// The distance of all these eyes from the middle of the yard.
const DISTANCE_M: f32 = 9.0;

pub const CURVES: [Curve; 5] = [
    Curve {
        name: "Error outside the view cell",
        subject: POLES_SUBJECT,
        x: X::linear("distance from the cell", "widths", &[0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0])
            .with_small(&[0.0, 0.5, 1.0, 2.0, 4.0]),
        y: FLIP,
        series: &[
            Series::new("joint_carve", &[Shape::rises(0.05, 0.02)]),
            Series::new("light_field_search:64", &[Shape::rises(0.05, 0.05)]),
        ],
        why: "Outside of the cameras' hull a view sees what no camera saw, more of it the farther it is.",
        measure: outside,
    },
    Curve {
        name: "Error against the cell's width",
        subject: POLES_SUBJECT,
        x: X::log("width of the cell", "default cells", &[0.25, 0.5, 1.0, 2.0, 4.0]),
        y: FLIP,
        series: &[
            Series::new("joint_carve", &[Shape::rises(0.05, 0.03)]),
            Series::new("light_field_search:64", &[Shape::rises(0.05, 0.03)]),
        ],
        why: "Cameras farther apart leave more of the views' surfaces unseen between them.",
        measure: by_width,
    },
    Curve {
        name: "Disocclusion against the number of images",
        subject: "a courtyard, images in a fixed nested order",
        x: X::log("images", "", &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0]).with_small(&[1.0, 2.0, 4.0, 8.0]),
        y: ["surfaces that no image holds", "%"],
        series: &[
            Series::new("courtyard", &[Shape::falls(0.5, 0.05)]),
            Series::new("tree-terrain", &[Shape::falls(0.5, 0.3)]),
        ],
        why: "Each further image sees behind edges of those before, less and less of it.",
        measure: by_images,
    },
    Curve {
        name: "Error against the size of sample images",
        subject: "a tree over a terrain, four images",
        x: X::log("side", "default sides", &[0.25, 0.35, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0])
            .with_small(&[0.25, 0.5, 1.0, 2.0, 4.0]),
        y: FLIP,
        series: &[
            Series::new("joint_carve", &[Shape::falls(0.03, 0.015)]),
            Series::new("light_field_search:64", &[Shape::falls(0.05, 0.01)]),
        ],
        why: "A texel larger than a view's pixel blurs surfaces and frays silhouettes.",
        measure: by_side,
    },
    Curve {
        name: "A yard that no camera sees",
        subject: "a courtyard, four images from below the walls' tops",
        x: X::linear("height of the view", "°", &[15.0, 30.0, 40.0, 50.0, 60.0, 75.0, 88.0])
            .with_small(&[15.0, 45.0, 60.0, 88.0]),
        y: ["share of the picture", ""],
        series: &[
            Series::new("the yard", &[Shape::rises(0.04, 0.005)]),
            Series::new("not marked, joint_carve", &[Shape::Bounded { least: 0.0, most: 0.02 }]),
            Series::new("not marked, light_field_search:64", &[Shape::rises(0.01, 0.01)]),
        ],
        why: "The carve marks what it does not know. The search meets the shadow volume that all cameras share, and calls its colour a hit.",
        measure: unseen_yard,
    },
];

fn outside(stand: &Stand, widths: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &poles(POLE_RADIUS_M), &POLES.samples(4, stand.sample_px))?;
    rows(widths, |widths| {
        // From the cell's edge, in half widths from its middle.
        let x = 1.0 + 2.0 * widths as f32;
        let cameras = [[x, 0.2], [-x, -0.4]].map(|place| POLES.camera(place, stand.view_px));
        stage.flips(&cameras, [CARVE, search(64)])
    })
}

fn by_width(stand: &Stand, widths: &[f64]) -> anyhow::Result<Rows> {
    rows(widths, |width| {
        // Views stay where they are.
        let cell = Cell { half_m: POLES.half_m * width as f32, ..POLES };
        let stage = Stage::new(stand, &poles(POLE_RADIUS_M), &cell.samples(4, stand.sample_px))?;
        stage.flips(&POLES.views(stand.view_px), [CARVE, search(64)])
    })
}

fn by_images(stand: &Stand, counts: &[f64]) -> anyhow::Result<Rows> {
    let stages = [
        (YARD, Stage::new(stand, &courtyard(), &YARD.samples(9, stand.sample_px))?),
        (TREE, Stage::new(stand, &tree_terrain(2000, 1), &TREE.samples(9, stand.sample_px))?),
    ];
    rows(counts, |count| {
        let mut unheld = [0.0; 2];
        for (unheld, (cell, stage)) in unheld.iter_mut().zip(&stages) {
            let cameras = cell.views(stand.view_px);
            // One image is the middle's.
            let images = if count < 2.0 { &stage.images[4..5] } else { &stage.images[..count as usize] };
            let truths = stage.truth(&cameras)?;
            let rates = cameras.iter().zip(&truths).map(|(camera, truth)| unheld_rate(camera, depths(truth), images));
            let rates = rates.collect::<Result<Vec<_>, _>>()?;
            *unheld = 100.0 * mean(rates.into_iter().map(|rate| rate.unwrap_or(f64::NAN))).unwrap_or(f64::NAN);
        }
        Ok(unheld)
    })
}

fn by_side(stand: &Stand, ratios: &[f64]) -> anyhow::Result<Rows> {
    let scene = tree_terrain(2000, 1);
    rows(ratios, |ratio| {
        let size_px = (stand.sample_px.as_vec2() * ratio as f32).round().as_uvec2();
        let stage = Stage::new(stand, &scene, &TREE.samples(4, size_px))?;
        stage.flips(&TREE.views(stand.view_px), [CARVE, search(64)])
    })
}

fn unseen_yard(stand: &Stand, heights_deg: &[f64]) -> anyhow::Result<Rows> {
    let samples = [0.0f32, 0.4, 0.8, 1.2].map(|turn| {
        looking(Vec3::new(turn.cos() * DISTANCE_M, LOW_M, turn.sin() * DISTANCE_M), Vec3::Y, 45.0, stand.sample_px)
    });
    let stage = Stage::new(stand, &courtyard(), &samples)?;
    rows(heights_deg, |height_deg| {
        let (sin, cos) = f32::sin_cos((height_deg as f32).to_radians());
        let turn = Vec2::from_angle(0.6) * cos * DISTANCE_M;
        let camera = looking(Vec3::new(turn.x, sin * DISTANCE_M, turn.y), Vec3::ZERO, 35.0, stand.view_px);
        // The yard's floor and pillar: lower than the walls, inside them.
        let yard = pixels_where(&camera, &stage.truth(&[camera])?[0], |point| {
            point.x.abs() < 1.6 && point.z.abs() < 1.6 && point.y < 0.9
        });
        let seen = yard.len() as f64 / camera.pixel_count() as f64;
        let carved = share_unmarked(&yard, &stage.views(&[camera], CARVE)?[0]);
        let searched = share_unmarked(&yard, &stage.views(&[camera], search(64))?[0]);
        Ok([seen, carved, searched])
    })
}

/// Of all pixels, those of the yard that are not marked as filled, although no camera saw them.
fn share_unmarked(yard: &[usize], view: &View) -> f64 {
    let filled: Vec<bool> = is_kind(view, ProvenanceKind::Filled).collect();
    yard.iter().filter(|&&pixel| !filled[pixel]).count() as f64 / filled.len() as f64
}
