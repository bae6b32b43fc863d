//! Quads of samples: blocks that are merged, and holes.

use depth_image::{DepthImage, HOLE_INVERSE_DEPTH};
use fixtures::uv_sphere;
use glam::Vec3;
use reconstruction::MeshStatistics;
use scene::procedural::tree_terrain;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{depth_error, found};
use crate::failures::shape::Shape;
use crate::failures::stage::{Cell, HYBRID, MESH, Stage, TREE, merged};
use crate::failures::stand::Stand;

const SPHERE: Cell = Cell { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.3 };
const BOUNDS: X = X::log("bound", "px", &[0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0]);
const FOUR_IMAGES: &str = "a sphere, four images";

pub const CURVES: [Curve; 3] = [
    Curve {
        name: "Quads left against the merging bound",
        subject: FOUR_IMAGES,
        x: BOUNDS,
        y: ["quads left", ""],
        series: &[Series::new("hybrid_mesh", &[Shape::falls(0.2, 0.0), Shape::Bounded { least: 0.0, most: 1.0 }])],
        why: "A looser bound merges larger blocks.",
        measure: quads_left,
    },
    Curve {
        name: "Depth error against the merging bound",
        subject: FOUR_IMAGES,
        x: BOUNDS,
        y: ["mean depth error", "%"],
        series: &[Series::new("hybrid_mesh", &[Shape::rises(0.02, 0.01)])],
        why: "A merged quad is flat where the surface is round; the bound limits how far it may lie off.",
        measure: merged_error,
    },
    Curve {
        name: "Surfaces shown against holes",
        subject: "a tree over a terrain, three images with random holes",
        x: X::linear("holes", "%", &[0.0, 10.0, 20.0, 30.0, 45.0, 60.0]).with_small(&[0.0, 10.0, 30.0, 60.0]),
        y: ["pixels with a surface that are hits", ""],
        series: &[
            Series::new("mesh", &[Shape::falls(0.2, 0.02)]),
            Series::new("hybrid_mesh", &[Shape::falls(0.01, 0.02), Shape::Bounded { least: 0.5, most: 1.0 }]),
        ],
        why: "One hole takes four quads of a mesh away, and one of a hybrid mesh.",
        measure: by_holes,
    },
];

fn sphere(stand: &Stand) -> anyhow::Result<Stage<'_>> {
    Stage::with_corners(stand, &uv_sphere(1.0, 64), &SPHERE.samples(4, stand.sample_px))
}

fn quads_left(stand: &Stand, bounds_px: &[f64]) -> anyhow::Result<Rows> {
    let set = sphere(stand)?.set()?;
    rows(bounds_px, |px| {
        let statistics = stand.reconstructor().mesh_statistics(&set, merged(px))?;
        let MeshStatistics { quads, quads_before, .. } = statistics.unwrap_or_default();
        Ok([quads as f64 / quads_before as f64])
    })
}

fn merged_error(stand: &Stand, bounds_px: &[f64]) -> anyhow::Result<Rows> {
    let stage = sphere(stand)?;
    let cameras = SPHERE.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    rows(bounds_px, |px| Ok([100.0 * depth_error(&truths, &stage.views(&cameras, merged(px))?)?]))
}

fn by_holes(stand: &Stand, percents: &[f64]) -> anyhow::Result<Rows> {
    let mut stage = Stage::with_corners(stand, &tree_terrain(2000, 1), &TREE.samples(3, stand.sample_px))?;
    let cameras = TREE.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    let whole = stage.images.clone();
    rows(percents, |percent| {
        let mut state = 1u32;
        stage.images = whole.iter().map(|image| holed(image, percent / 100.0, &mut state)).collect();
        let mesh = found(&truths, &stage.views(&cameras, MESH)?);
        Ok([mesh, found(&truths, &stage.views(&cameras, HYBRID)?)])
    })
}

/// Without some samples, the same ones each time. More holes take away the samples that fewer took, too.
fn holed(image: &DepthImage, share: f64, state: &mut u32) -> DepthImage {
    let mut image = image.clone();
    for depth in &mut image.inverse_depth_per_m {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *depth = if f64::from(*state >> 8) < share * f64::from(1 << 24) { HOLE_INVERSE_DEPTH } else { *depth };
    }
    image
}
