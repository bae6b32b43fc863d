//! A sphere that four cameras see: steps, bits of depth, and merged quads.

use depth_image::DepthImage;
use fixtures::uv_sphere;
use glam::Vec3;
use reconstruction::MeshStatistics;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::depth_error;
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, HYBRID, Stage, merged, search};
use crate::failures::stand::Stand;

const CELL: Cell = Cell { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.3 };
const STEPS: X = X::log("steps", "", &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0, 1024.0])
    .with_small(&[1.0, 2.0, 4.0, 8.0, 16.0, 64.0, 256.0, 1024.0]);
const FOUR_IMAGES: &str = "a sphere, four images";

pub const CURVES: [Curve; 4] = [
    Curve {
        name: "Depth error against steps",
        subject: FOUR_IMAGES,
        x: STEPS,
        y: ["mean depth error", "%"],
        series: &[Series::new("light_field_search", &[Shape::FallsThenFlat { least_fall: 0.05, tolerance: 0.05 }])],
        why: "Bisection repairs a coarse step where the surface is thick; near the rim only short steps enter it. From there on the texels decide.",
        measure: depth_by_steps,
    },
    Curve {
        name: "Depth error against bits of depth",
        subject: FOUR_IMAGES,
        x: X::linear("bits", "", &[4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 14.0, 16.0, 24.0, 32.0])
            .with_small(&[4.0, 6.0, 8.0, 10.0, 12.0, 16.0, 24.0, 32.0]),
        y: ["mean depth error", "%"],
        series: &[Series::new("joint_carve", &[Shape::FallsThenFlat { least_fall: 0.05, tolerance: 0.005 }])],
        why: "Below 10 bits a code is coarser than a texel's change of depth; 16 bits lose nothing.",
        measure: by_bits,
    },
    Curve {
        name: "Quads left against the merging bound",
        subject: FOUR_IMAGES,
        x: X::log("bound", "px", &[0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0]),
        y: ["quads left", ""],
        series: &[Series::new("hybrid_mesh", &[Shape::falls(0.2, 0.0), Shape::Bounded { least: 0.0, most: 1.0 }])],
        why: "A looser bound merges larger blocks.",
        measure: quads_left,
    },
    Curve {
        name: "Depth error against the merging bound",
        subject: FOUR_IMAGES,
        x: X::log("bound", "px", &[0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0]),
        y: ["mean depth error", "%"],
        series: &[
            Series::new("hybrid_mesh", &[Shape::rises(0.02, 0.01)]),
            Series::new("hybrid_mesh, not merged", &[Shape::Plateau { tolerance: 1e-9 }]),
        ],
        why: "A merged quad is flat where the surface is round; the bound limits how far it may lie off.",
        measure: merged_error,
    },
];

fn depth_by_steps(stand: &Stand, steps: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &uv_sphere(1.0, 64), &CELL.samples(4, stand.sample_px))?;
    let cameras = CELL.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    rows(steps, |steps| Ok([100.0 * depth_error(&truths, &stage.views(&cameras, search(steps as u32))?)?]))
}

fn by_bits(stand: &Stand, bits: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &uv_sphere(1.0, 64), &CELL.samples(4, stand.sample_px))?;
    let cameras = CELL.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    rows(bits, |bits| {
        let images: Vec<DepthImage> = stage.images.iter().map(|image| quantised(image, bits)).collect();
        let views = stage.views_of(&images, stage.volume, &cameras, CARVE)?;
        Ok([100.0 * depth_error(&truths, &views)?])
    })
}

/// Inverse depth rounded to a number of bits over the image's range.
fn quantised(image: &DepthImage, bits: f64) -> DepthImage {
    let mut coarse = image.clone();
    let Some((least, greatest)) = image.inverse_depth_range() else { return coarse };
    let (least, greatest) = (f64::from(least), f64::from(greatest));
    let step = (greatest - least) / (bits.exp2() - 1.0);
    let samples = coarse.inverse_depth_per_m.iter_mut().filter(|depth| **depth > 0.0);
    samples.for_each(|depth| *depth = (least + ((f64::from(*depth) - least) / step).round() * step) as f32);
    coarse
}

fn quads_left(stand: &Stand, bounds_px: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::with_corners(stand, &uv_sphere(1.0, 64), &CELL.samples(4, stand.sample_px))?;
    let set = stage.set()?;
    rows(bounds_px, |px| {
        let MeshStatistics { quads, quads_before, .. } =
            stand.reconstructor().mesh_statistics(&set, merged(px))?.unwrap_or_default();
        Ok([quads as f64 / quads_before as f64])
    })
}

fn merged_error(stand: &Stand, bounds_px: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::with_corners(stand, &uv_sphere(1.0, 64), &CELL.samples(4, stand.sample_px))?;
    let cameras = CELL.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    let error = |method| Ok::<_, anyhow::Error>(100.0 * depth_error(&truths, &stage.views(&cameras, method)?)?);
    let whole = error(HYBRID)?;
    rows(bounds_px, |px| Ok([error(merged(px))?, whole]))
}
