//! The error of soft shadows and occlusion by few rays against that by many: its slope, and its bias beside noise.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::progress::bar;
use app_core::setup::Setup;
use depth_image::{Camera, DepthImage, PinholeCamera, linear_from_rgb9e5};
use engine::GpuEngine;
use glam::{UVec2, Vec3};
use render::{DrawWork, GpuScene, Lighting, Refinement, SamplePlanes, Visibility};
use report::{Axis, Bar, Check, Report, Series, Table, XyChart};

use super::args::BenchArgs;

/// Rays of the reference.
const REFERENCE: u32 = 1024;
/// Rays that are compared with the reference.
const RAYS: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];
const QUICK: usize = 5;
/// The number of rays at which the mean difference is compared with noise.
const UNBIASED_AT: u32 = 16;
/// The standard deviations that hold 99 % of a normal distribution.
const DEVIATIONS_99: f64 = 2.576;
const SIZE_PX: UVec2 = UVec2::new(100, 75);

/// An effect that rays are traced for.
struct Kind {
    name: &'static str,
    lighting: fn(u32) -> String,
}

const KINDS: [Kind; 2] = [
    Kind { name: "soft", lighting: |rays| format!("soft {rays}") },
    Kind { name: "occlusion", lighting: |rays| format!("phong, occlusion {rays}") },
];

/// The error of a picture by few rays against one by many, over all pixels.
struct Error {
    rays: u32,
    /// The root mean square of linear light, over all channels.
    rms: f64,
    /// The mean difference over half of its 99 % interval under noise.
    bias: f64,
}

/// Adds a table, a chart and checks.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, setup: &Setup, report: &mut Report) -> anyhow::Result<()> {
    let scene = engine.scene(setup.offer.hash.as_str())?;
    let camera = setup.samples.first().context("no sample cameras")?.resized(SIZE_PX);
    let rays = if args.quick { &RAYS[..QUICK] } else { &RAYS[..] };
    let progress = bar("error against rays", KINDS.len() * (1 + rays.len()));
    let mut of_kinds = Vec::with_capacity(KINDS.len());
    let mut rounding = 0f64;
    for kind in &KINDS {
        let draw = |rays: u32| {
            let image = draw(engine, &scene, &camera, (kind.lighting)(rays).parse()?);
            progress.inc(1);
            image
        };
        let reference = draw(REFERENCE)?;
        rounding = rounding.max(rounding_of(&reference));
        let errors = rays.iter().map(|&rays| Ok(Error::of(rays, &draw(rays)?, &reference)));
        of_kinds.push(errors.collect::<anyhow::Result<Vec<_>>>()?);
    }
    progress.finish_and_clear();
    report.tables.push(table(&of_kinds, rounding)?);
    report.charts.push(chart(&of_kinds, rounding).into());
    report.checks.extend(KINDS.iter().zip(&of_kinds).flat_map(|(kind, errors)| checks(kind, errors)));
    Ok(())
}

fn draw(
    engine: &GpuEngine,
    scene: &GpuScene,
    camera: &PinholeCamera,
    lighting: Lighting,
) -> anyhow::Result<DepthImage> {
    let refinement = Refinement::default();
    let work = DrawWork {
        scene,
        lighting,
        scene_time_s: 0.0,
        visibility: Visibility::Rays,
        refinement,
        turn: Default::default(),
    };
    let images = engine.renderer.draw_depth_images(work, &[Camera::Pinhole(*camera)], SamplePlanes::default())?;
    images.into_iter().next().context("no image")
}

impl Error {
    fn of(rays: u32, few: &DepthImage, many: &DepthImage) -> Self {
        let differences: Vec<Vec3> = (few.color_rgb9e5.iter().zip(&many.color_rgb9e5))
            .map(|(&few, &many)| linear_from_rgb9e5(few) - linear_from_rgb9e5(many))
            .collect();
        let squares = differences.iter().map(|difference| f64::from(difference.length_squared()) / 3.0);
        let rms = (squares.sum::<f64>() / differences.len() as f64).sqrt();
        Self { rays, rms, bias: bias(&differences) }
    }
}

fn bias(differences: &[Vec3]) -> f64 {
    let greys: Vec<f64> = differences.iter().map(|difference| f64::from(difference.element_sum()) / 3.0).collect();
    let n = greys.len() as f64;
    let mean = greys.iter().sum::<f64>() / n;
    let variance = greys.iter().map(|grey| (grey - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // Rays of pixels are independent of each other.
    mean.abs() / (DEVIATIONS_99 * (variance / n).sqrt())
}

/// The root mean square that rounding to RGB9E5 adds to the difference of two pictures, were it independent in both.
/// The background is the same in both.
fn rounding_of(image: &DepthImage) -> f64 {
    let step = |word: u32| 2f64.powi((word >> 27) as i32 - 24);
    let surfaces = image.color_rgb9e5.iter().zip(&image.inverse_depth_per_m).filter(|(_, inverse)| **inverse > 0.0);
    let sum: f64 = surfaces.map(|(&word, _)| step(word).powi(2) / 12.0).sum();
    (2.0 * sum / image.color_rgb9e5.len() as f64).sqrt()
}

/// The error of independent random rays, up to a factor. The reference's first rays are the compared ones, which lowers
/// the error a little.
fn random(rays: u32) -> f64 {
    (f64::from(rays).recip() - f64::from(REFERENCE).recip()).sqrt()
}

/// The slope of logarithms by least squares.
fn slope(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let logs: Vec<(f64, f64)> = points.map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mean_x, mean_y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let covariance: f64 = logs.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    covariance / logs.iter().map(|(x, _)| (x - mean_x).powi(2)).sum::<f64>()
}

fn slope_of(errors: &[Error]) -> f64 {
    slope(errors.iter().map(|error| (f64::from(error.rays), error.rms)))
}

const COLUMNS: [(&str, &str); 7] = [
    ("light", ""),
    ("rays a pixel", ""),
    ("RMSE of linear light", ""),
    ("over that of one ray", ""),
    ("1/√N", ""),
    ("mean difference over its 99 % interval", ""),
    ("rounding of two RGB9E5", ""),
];

fn table(of_kinds: &[Vec<Error>], rounding: f64) -> anyhow::Result<Table> {
    let mut table = Table::new(format!("Error against rays, beside {REFERENCE} rays"), &COLUMNS);
    for (kind, errors) in KINDS.iter().zip(of_kinds) {
        let first = errors.first().map_or(f64::NAN, |error| error.rms);
        for error in errors {
            let falls = [error.rms, error.rms / first, random(error.rays) / random(1), error.bias, rounding];
            table.push([kind.name.into(), error.rays.into()].into_iter().chain(falls.map(Into::into)))?;
        }
    }
    Ok(table)
}

fn chart(of_kinds: &[Vec<Error>], rounding: f64) -> XyChart {
    let first = of_kinds.iter().flatten().map(|error| error.rms).fold(0.0, f64::max);
    let steps = of_kinds.iter().flatten().map(|error| error.rays).collect::<std::collections::BTreeSet<_>>();
    let random = steps.into_iter().map(|rays| (f64::from(rays), first * random(rays) / random(1)));
    let (x, y) = (Axis::log("rays a pixel and lamp, or of occlusion", ""), Axis::log("RMSE of linear light", ""));
    let chart = XyChart::new("Error against rays", x, y)
        .with(Series::line("1/√N", random))
        .with_limit("rounding of RGB9E5", rounding);
    let mut chart = KINDS.iter().zip(of_kinds).fold(chart, |chart, (kind, errors)| {
        let points = errors.iter().map(|error| (f64::from(error.rays), error.rms));
        chart.with(Series::line(format!("{}, slope {:.2}", kind.name, slope_of(errors)), points))
    });
    chart.note = format!("Beside {REFERENCE} rays, whose first are those compared; 1/√N allows for that.");
    chart
}

fn checks(kind: &Kind, errors: &[Error]) -> [Check; 2] {
    let random = slope(errors.iter().map(|error| (f64::from(error.rays), random(error.rays))));
    let rms = errors.iter().all(|error| error.rms > 0.0).then(|| slope_of(errors));
    let bias = errors.iter().find(|error| error.rays == UNBIASED_AT && error.rms > 0.0).map(|error| error.bias);
    let exact = "nothing in the scene needs more than one ray";
    let falls = format!("{}: slope of log error over log rays (random rays: {random:.3})", kind.name);
    let unbiased = format!("{} {UNBIASED_AT}: mean difference over its 99 % interval", kind.name);
    [
        Check::maybe(falls, rms, "", Bar::AtMost(random), exact),
        Check::maybe(unbiased, bias, "", Bar::AtMost(1.0), exact),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_power_is_its_exponent() {
        assert!((slope([1.0, 2.0, 8.0].map(|x: f64| (x, 3.0 * x.powf(-0.7))).into_iter()) + 0.7).abs() < 1e-12);
    }

    #[test]
    fn a_shift_exceeds_the_interval_of_noise() {
        let noise = |shift: f32| {
            (0..1000).map(|i| Vec3::splat(((i * 7919) % 1000) as f32 * 1e-3 - 0.4995 + shift)).collect::<Vec<_>>()
        };
        assert!(bias(&noise(0.0)) < 0.01);
        assert!(bias(&noise(0.1)) > 1.0);
    }
}
