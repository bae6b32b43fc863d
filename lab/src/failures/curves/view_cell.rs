//! Sample sets and the views that they serve: places outside the cell, its width, the number of images and their size.

use depth_image::ProvenanceKind;
use fixtures::poles;
use glam::Vec3;
use metrics::unheld_rate;
use scene::procedural::{courtyard, tree_terrain};

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{depths, foreground, mean, share_of_kind};
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, Stage, search};
use crate::failures::stand::Stand;

const TREE: Cell = Cell { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::new(0.0, 0.3, 0.0), half_m: 0.3 };
const POLES: Cell = Cell { eye: Vec3::new(0.0, 0.0, 4.0), target: Vec3::new(0.0, 0.0, -2.0), half_m: 0.4 };
const YARD: Cell = Cell { eye: Vec3::new(2.0, 9.0, 9.0), target: Vec3::ZERO, half_m: 1.0 };
const OUTSIDE: X = X::linear("distance from the cell", "widths", &[0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0])
    .with_small(&[0.0, 0.5, 1.0, 2.0, 4.0]);
const POLES_SUBJECT: &str = "nine poles before a wall, four images";
const POLE_RADIUS_M: f32 = 0.12;
const FLIP: [&str; 2] = ["FLIP of the foreground", ""];

pub const CURVES: [Curve; 6] = [
    Curve {
        name: "Error outside the view cell",
        subject: POLES_SUBJECT,
        x: OUTSIDE,
        y: FLIP,
        series: &[
            Series::new("joint_carve", &[Shape::rises(0.05, 0.02)]),
            Series::new("light_field_search:64", &[Shape::rises(0.05, 0.05)]),
        ],
        why: "Outside of the cameras' hull a view sees what no camera saw, more of it the farther it is.",
        measure: error_outside,
    },
    Curve {
        name: "Marked pixels outside the view cell",
        subject: POLES_SUBJECT,
        x: OUTSIDE,
        y: ["pixels marked as filled", ""],
        series: &[Series::new("joint_carve", &[Shape::rises(0.05, 0.02)])],
        why: "What no camera saw is said to be filled: the marks grow with the error.",
        measure: marked_outside,
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
        name: "Error against the distance of the view",
        subject: "a tree over a terrain, four images of one distance",
        x: X::log("distance over the cameras'", "", &[0.35, 0.5, 0.71, 1.0, 1.41, 2.0])
            .with_small(&[0.35, 0.5, 0.71, 1.0]),
        y: FLIP,
        series: &[Series::new("joint_carve", &[Shape::falls(0.02, 0.03)])],
        why: "A view that is nearer than the cameras enlarges their texels.",
        measure: by_distance,
    },
];

fn outside(stand: &Stand, widths: f64) -> Vec<depth_image::PinholeCamera> {
    // From the cell's edge, in half widths from its middle.
    let x = 1.0 + 2.0 * widths as f32;
    [[x, 0.2], [-x, -0.4]].map(|place| POLES.camera(place, stand.view_px)).to_vec()
}

fn error_outside(stand: &Stand, widths: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &poles(POLE_RADIUS_M), &POLES.samples(4, stand.sample_px))?;
    rows(widths, |widths| {
        let cameras = outside(stand, widths);
        let truths = stage.truth(&cameras)?;
        let flip = |method| Ok::<_, anyhow::Error>(foreground(&truths, &stage.views(&cameras, method)?)?.flip);
        Ok([flip(CARVE)?, flip(search(64))?])
    })
}

fn marked_outside(stand: &Stand, widths: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &poles(POLE_RADIUS_M), &POLES.samples(4, stand.sample_px))?;
    rows(widths, |widths| {
        let views = stage.views(&outside(stand, widths), CARVE)?;
        Ok([share_of_kind(&views, ProvenanceKind::Filled)])
    })
}

fn by_width(stand: &Stand, widths: &[f64]) -> anyhow::Result<Rows> {
    let cameras = POLES.views(stand.view_px);
    rows(widths, |width| {
        // Views stay where they are.
        let cell = Cell { half_m: POLES.half_m * width as f32, ..POLES };
        let stage = Stage::new(stand, &poles(POLE_RADIUS_M), &cell.samples(4, stand.sample_px))?;
        let truths = stage.truth(&cameras)?;
        let flip = |method| Ok::<_, anyhow::Error>(foreground(&truths, &stage.views(&cameras, method)?)?.flip);
        Ok([flip(CARVE)?, flip(search(64))?])
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
    let (scene, cameras) = (tree_terrain(2000, 1), TREE.views(stand.view_px));
    rows(ratios, |ratio| {
        let size_px = (stand.sample_px.as_vec2() * ratio as f32).round().as_uvec2();
        let stage = Stage::new(stand, &scene, &TREE.samples(4, size_px))?;
        let truths = stage.truth(&cameras)?;
        let flip = |method| Ok::<_, anyhow::Error>(foreground(&truths, &stage.views(&cameras, method)?)?.flip);
        Ok([flip(CARVE)?, flip(search(64))?])
    })
}

fn by_distance(stand: &Stand, ratios: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &tree_terrain(2000, 1), &TREE.samples(4, stand.sample_px))?;
    rows(ratios, |ratio| {
        let eye = TREE.target + (TREE.eye - TREE.target) * ratio as f32;
        let cameras = Cell { eye, half_m: TREE.half_m * ratio as f32, ..TREE }.views(stand.view_px);
        Ok([foreground(&stage.truth(&cameras)?, &stage.views(&cameras, CARVE)?)?.flip])
    })
}
