//! Pictures as clients get them: JPEG's quality, and samples a pixel.

use codec::{DecodeLimits, FrameCodec, decode_frame, encode_frame};
use depth_image::{Antialias, PinholeCamera, View, ViewPlanes, linear_from_srgb8, srgb8_from_linear};
use fixtures::poles;
use glam::Vec2;
use reconstruction::ReconstructRequest;
use render::Lighting;

use crate::failures::curve::{Curve, FLIP, Rows, Series, X, rows};
use crate::failures::measures::foreground;
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, POLES, Stage};
use crate::failures::stand::Stand;

const NEAR_POLES: Cell = Cell { half_m: 0.2, ..POLES };
const RADIUS_M: f32 = 0.06;
/// Positions along each side of a pixel of the truth: 64 samples.
const SIDE: usize = 8;

pub const CURVES: [Curve; 2] = [
    Curve {
        name: "Picture error against JPEG's quality",
        subject: "nine poles before a wall that fills the picture, drawn",
        x: X::linear("quality", "", &[30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 95.0, 100.0])
            .with_small(&[30.0, 50.0, 70.0, 90.0, 100.0]),
        y: FLIP,
        series: &[Series::new("jpeg", &[Shape::falls(0.02, 0.005)])],
        why: "Coarser coefficients ring at edges; at 90, the default, little is left to gain.",
        measure: by_quality,
    },
    Curve {
        name: "Picture error against samples a pixel",
        subject: "nine poles before a wall, four images, beside 64 samples a pixel drawn",
        x: X::log("samples a pixel", "", &[1.0, 2.0, 4.0, 8.0, 16.0]),
        y: FLIP,
        series: &[
            Series::new("drawn", &[Shape::falls(0.01, 0.004)]),
            Series::new("joint_carve", &[Shape::FallsThenFlat { least_fall: 0.005, tolerance: 0.004 }]),
        ],
        why: "Samples a pixel remove stairs at edges; what the sample images lack stays.",
        measure: by_samples,
    },
];

fn by_quality(stand: &Stand, qualities: &[f64]) -> anyhow::Result<Rows> {
    // Ringing around a model would count as foreground, and lower its mean.
    let stage = Stage::new(stand, &poles(RADIUS_M), &[])?;
    let cameras = NEAR_POLES.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    rows(qualities, |quality| {
        let views = truths.iter().map(|truth| delivered(truth, FrameCodec::Jpeg { quality: quality as u8 }));
        Ok([foreground(&truths, &views.collect::<anyhow::Result<Vec<_>>>()?)?.flip])
    })
}

fn delivered(view: &View, codec: FrameCodec) -> anyhow::Result<View> {
    let frame = encode_frame(codec, view.size_px, &view.srgb8)?;
    let srgb8 = decode_frame(codec, view.size_px, &frame, &DecodeLimits::default())?;
    Ok(View { srgb8, ..view.clone() })
}

fn by_samples(stand: &Stand, counts: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::new(stand, &poles(RADIUS_M), &NEAR_POLES.samples(4, 2 * stand.sample_px))?;
    let cameras = NEAR_POLES.views(stand.view_px);
    let truths =
        cameras.iter().map(|camera| supersampled(stand, &stage, camera)).collect::<anyhow::Result<Vec<_>>>()?;
    let set = stage.set()?;
    rows(counts, |count| {
        let planes = ViewPlanes { antialias: Antialias::of(count as u32).unwrap_or_default(), ..ViewPlanes::ALL };
        let drawn = stand.views(&stage.scene, Lighting::default(), &cameras, planes)?;
        let views = stand
            .reconstructor()
            .reconstruct(ReconstructRequest { planes, ..ReconstructRequest::new(&set, &cameras, CARVE) })?;
        Ok([foreground(&truths, &drawn)?.flip, foreground(&truths, &views)?.flip])
    })
}

/// The mean of 8 × 8 positions within each pixel, in linear light.
fn supersampled(stand: &Stand, stage: &Stage<'_>, camera: &PinholeCamera) -> anyhow::Result<View> {
    let fine = camera.resized(camera.size_px * SIDE as u32);
    let drawn = stand.views(&stage.scene, Lighting::default(), &[fine], ViewPlanes::COLOR)?.remove(0);
    let [width, height] = camera.size_px.to_array().map(|side| side as usize);
    let mut srgb8 = Vec::with_capacity(3 * width * height);
    for pixel in 0..width * height {
        let first = (pixel / width * width * SIDE + pixel % width) * SIDE;
        for channel in 0..3 {
            let places = (0..SIDE * SIDE).map(|i| first + i / SIDE * width * SIDE + i % SIDE);
            let sum: f32 = places.map(|place| linear_from_srgb8(drawn.srgb8[3 * place + channel])).sum();
            srgb8.push(srgb8_from_linear(sum / (SIDE * SIDE) as f32));
        }
    }
    let center = stage.truth(&[camera.with_offset(Vec2::ZERO)])?.remove(0);
    Ok(View { srgb8, ..center })
}
