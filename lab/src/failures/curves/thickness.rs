//! The thickness of surfaces, by the twin: on the device it is a constant.

use depth_image::View;
use glam::Vec3;
use reconstruction::scalar::reconstruct_with_thickness;
use scene::procedural::tree_terrain;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::foreground;
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, Stage};
use crate::failures::stand::Stand;

const CELL: Cell = Cell { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::new(0.0, 0.3, 0.0), half_m: 0.4 };

pub const CURVE: Curve = Curve {
    name: "Similarity against thickness",
    subject: "a tree over a terrain, four images, the twin",
    x: X::log("thickness", "footprints", &[0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
    y: ["SSIM of the foreground", ""],
    series: &[Series::new(
        "joint_carve",
        &[Shape::InvertedU { peak_within: [1.0, 16.0], least_change: 0.01, tolerance: 0.004 }],
    )],
    why: "Thin surfaces leak where samples of one slope disagree; thick ones swallow the space beside them.",
    measure,
};

fn measure(stand: &Stand, thicknesses: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &tree_terrain(4000, 1), &CELL.samples(4, stand.sample_px))?;
    let cameras = CELL.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    rows(thicknesses, |thickness| {
        let view =
            |camera| reconstruct_with_thickness(&stage.images, &stage.description(), camera, CARVE, thickness as f32);
        let views: Vec<View> = cameras.iter().map(view).collect();
        Ok([foreground(&truths, &views)?.ssim])
    })
}
