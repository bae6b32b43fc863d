//! Poles before a wall: what is thinner than a step or a texel is found by chance.

use depth_image::{ProvenanceKind, View};
use fixtures::poles;
use glam::Vec3;
use reconstruction::ReconstructionMethod;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{depths, foreground, is_kind, share};
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, Stage, search};
use crate::failures::stand::Stand;

const CELL: Cell = Cell { eye: Vec3::new(0.0, 0.0, 4.0), target: Vec3::new(0.0, 0.0, -2.0), half_m: 0.4 };
/// The distance of the poles, and one between them and the wall.
const POLES_M: f32 = 5.0;
const BETWEEN_M: f32 = 6.0;
/// The radius of poles that are some texels wide.
const RADIUS_M: f32 = 0.12;
/// Thin poles, in texels of a sample image.
const THIN_RADIUS_PX: f64 = 0.6;

pub const CURVES: [Curve; 4] = [
    Curve {
        name: "Poles found against their radius",
        subject: "nine poles before a wall, four images",
        x: X::log("radius", "texels", &[0.15, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0]).with_small(&[0.3, 0.6, 1.0, 2.0, 3.0]),
        y: ["pixels of poles found", ""],
        series: &[
            Series::new("light_field_search:8", &[Shape::rises(0.2, 0.12)]),
            Series::new("light_field_search:64", &[Shape::rises(0.1, 0.12)]),
            Series::new("joint_carve", &[Shape::rises(0.1, 0.12), Shape::EqualAt { x: 3.0, y: 0.95, tolerance: 0.05 }]),
            Series::new(
                "joint_carve less light_field_search:8",
                &[Shape::Bounded { least: 0.0, most: 1.0 }, Shape::EqualAt { x: 0.6, y: 0.6, tolerance: 0.4 }],
            ),
        ],
        why: "A step longer than a pole is thick enters it by chance; the carve steps from texel to texel.",
        measure: by_radius,
    },
    Curve {
        name: "Thin poles found against steps",
        subject: "nine poles of 0.6 texels before a wall, four images",
        x: X::log("steps", "", &[4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0]).with_small(&[4.0, 16.0, 64.0, 256.0]),
        y: ["pixels of poles found", ""],
        series: &[Series::new("light_field_search", &[Shape::rises(0.2, 0.03)])],
        why: "Steps shorter than the poles' depth leave none out.",
        measure: by_steps,
    },
    Curve {
        name: "Picture error against steps",
        subject: "nine poles before a wall, four images",
        x: X::log("steps", "", &[2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0, 1024.0])
            .with_small(&[2.0, 4.0, 8.0, 16.0, 64.0, 256.0, 512.0, 1024.0]),
        y: ["FLIP of the foreground", ""],
        series: &[
            Series::new("light_field_search", &[Shape::FallsThenFlat { least_fall: 0.02, tolerance: 0.015 }]),
            Series::new("joint_carve", &[Shape::Plateau { tolerance: 1e-9 }]),
        ],
        why: "Few steps lose poles; the error that stays is that of texels.",
        measure: picture_by_steps,
    },
    Curve {
        name: "Picture error against the stop level",
        subject: "nine poles before a wall, four images",
        x: X::linear("level", "", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).with_small(&[0.0, 1.0, 2.0, 3.0, 4.0]),
        y: ["FLIP of the foreground", ""],
        series: &[Series::new("joint_carve", &[Shape::rises(0.02, 0.01)])],
        why: "The nearest thing in a node of 2ⁿ × 2ⁿ cells counts as the surface: silhouettes grow by as much.",
        measure: by_stop_level,
    },
];

fn by_radius(stand: &Stand, radii_px: &[f64]) -> anyhow::Result<Rows> {
    rows(radii_px, |radius_px| {
        let [few, many, carve] = found_poles(stand, radius_px, [search(8), search(64), CARVE])?;
        Ok([few, many, carve, carve - few])
    })
}

fn by_steps(stand: &Stand, steps: &[f64]) -> anyhow::Result<Rows> {
    rows(steps, |steps| found_poles(stand, THIN_RADIUS_PX, [search(steps as u32)]))
}

fn picture_by_steps(stand: &Stand, steps: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &poles(RADIUS_M), &CELL.samples(4, stand.sample_px))?;
    let cameras = CELL.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    let carved = foreground(&truths, &stage.views(&cameras, CARVE)?)?.flip;
    rows(steps, |steps| Ok([foreground(&truths, &stage.views(&cameras, search(steps as u32))?)?.flip, carved]))
}

fn by_stop_level(stand: &Stand, levels: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &poles(RADIUS_M), &CELL.samples(4, stand.sample_px))?;
    let cameras = CELL.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    rows(levels, |level| {
        let method = ReconstructionMethod::JointCarve { stop_level: level as u32 };
        Ok([foreground(&truths, &stage.views(&cameras, method)?)?.flip])
    })
}

fn found_poles<const N: usize>(
    stand: &Stand,
    radius_px: f64,
    methods: [ReconstructionMethod; N],
) -> anyhow::Result<[f64; N]> {
    let samples = CELL.samples(4, stand.sample_px);
    let texel_m = POLES_M / samples[0].focal_px.x;
    let stage = Stage::new(stand, &poles(radius_px as f32 * texel_m), &samples)?;
    let cameras = CELL.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    let mut recalls = [0.0; N];
    for (recall, method) in recalls.iter_mut().zip(methods) {
        *recall = recall_of_poles(&truths, &stage.views(&cameras, method)?);
    }
    Ok(recalls)
}

/// The share of the poles' pixels at which a view has a hit about as near.
fn recall_of_poles(truths: &[View], views: &[View]) -> f64 {
    let is_pole = |inverse: &f32| *inverse > BETWEEN_M.recip();
    share(truths.iter().zip(views).flat_map(|(truth, view)| {
        let pixels = depths(truth).iter().zip(depths(view)).zip(is_kind(view, ProvenanceKind::Hit));
        pixels.filter(move |((truth, _), _)| is_pole(truth)).map(move |((_, found), hit)| hit && is_pole(found))
    }))
}
