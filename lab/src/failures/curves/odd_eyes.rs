//! Eyes above, in and below the volume, and rays along its faces: pictures, whatever they show.

use depth_image::PinholeCamera;
use glam::Vec3;
use scene::procedural::tree_terrain;

use crate::failures::curve::{Curve, Rows, Series, X};
use crate::failures::measures::foreground;
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, HYBRID, MESH, Stage, looking, search};
use crate::failures::stand::Stand;

const CELL: Cell = Cell { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::new(0.0, 0.3, 0.0), half_m: 0.4 };
const SUBJECT: &str = "a tree over a terrain, four images from above";
const FINITE: &[Shape] = &[Shape::NeverNaN, Shape::Bounded { least: 0.0, most: 1.0 }];
const ALL: &[Series] = &[
    Series::new("joint_carve", FINITE),
    Series::new("light_field_search:64", FINITE),
    Series::new("mesh", FINITE),
    Series::new("hybrid_mesh", FINITE),
];
const FLIP: [&str; 2] = ["FLIP of the foreground", ""];

pub const CURVES: [Curve; 3] = [
    Curve {
        name: "Eye above, in and below the volume",
        subject: SUBJECT,
        x: X::linear("height of the eye", "heights of the volume", &[-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0])
            .with_small(&[-1.0, 0.0, 0.5, 1.0, 2.0]),
        y: FLIP,
        series: ALL,
        why: "Rays begin before, in or behind the volume; surfaces are seen from below, where no camera was.",
        measure: by_height,
    },
    Curve {
        name: "Rays along the volume's upper face",
        subject: SUBJECT,
        x: X::linear("pitch", "°", &[-2.0, -0.5, -0.01, 0.0, 0.01, 0.5, 2.0]).with_small(&[-0.5, 0.0, 0.5]),
        y: FLIP,
        series: ALL,
        why: "A ray in the plane of a face divides by zero where it enters and leaves.",
        measure: by_pitch,
    },
    Curve {
        name: "Eye in the plane of a side",
        subject: SUBJECT,
        x: X::linear("distance from the plane", "m", &[-0.1, -1e-4, 0.0, 1e-4, 0.1]).with_small(&[-1e-4, 0.0, 1e-4]),
        y: FLIP,
        series: ALL,
        why: "Half of the rays leave the volume where they enter it.",
        measure: by_side,
    },
];

fn by_height(stand: &Stand, heights: &[f64]) -> anyhow::Result<Rows> {
    errors(stand, heights, |stage, height| {
        let volume = stage.volume;
        let y = volume.min.y + height * volume.size().y;
        looking(volume.center().with_y(y) + Vec3::X * 0.01, volume.center(), 60.0, stand.view_px)
    })
}

fn by_pitch(stand: &Stand, pitches_deg: &[f64]) -> anyhow::Result<Rows> {
    errors(stand, pitches_deg, |stage, pitch_deg| {
        let volume = stage.volume;
        let eye = volume.center().with_y(volume.max.y) + Vec3::Z * 1.5 * volume.size().z;
        let towards = Vec3::new(0.0, pitch_deg.to_radians().sin(), -pitch_deg.to_radians().cos());
        looking(eye, eye + towards, 45.0, stand.view_px)
    })
}

fn by_side(stand: &Stand, distances_m: &[f64]) -> anyhow::Result<Rows> {
    errors(stand, distances_m, |stage, distance_m| {
        let volume = stage.volume;
        let eye = volume.center().with_x(volume.max.x + distance_m) + Vec3::Z * volume.size().z;
        looking(eye, eye + Vec3::NEG_Z, 45.0, stand.view_px)
    })
}

/// The error of each method, for a view at each x.
fn errors(stand: &Stand, x: &[f64], camera: impl Fn(&Stage<'_>, f32) -> PinholeCamera) -> anyhow::Result<Rows> {
    let stage = Stage::with_corners(stand, &tree_terrain(2000, 1), &CELL.samples(4, stand.sample_px))?;
    let cameras: Vec<PinholeCamera> = x.iter().map(|&x| camera(&stage, x as f32)).collect();
    let truths = stage.truth(&cameras)?;
    let views = [CARVE, search(64), MESH, HYBRID].map(|method| stage.views(&cameras, method));
    let views = views.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let row = |place: usize| {
        let one = place..=place;
        views.iter().map(|views| Ok(foreground(&truths[one.clone()], &views[one.clone()])?.flip)).collect()
    };
    (0..x.len()).map(row).collect()
}
