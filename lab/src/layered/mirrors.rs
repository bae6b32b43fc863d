//! Mirrors in views from a cube: errors and time by the number of mirrors on a ray's way, beside direct drawing, and the views after
//! which the cube is repaid.

use std::time::Instant;

use anyhow::Context as _;
use depth_image::{PinholeCamera, View, ViewPlanes};
use glam::{UVec2, Vec3};
use metrics::{Rgb8Image, flip_map, psnr_db};
use reconstruction::{Mirrors, ReconstructRequest, ReconstructionMethod, SampleSet};
use render::{LayerSelection, Lighting};
use report::{Bar, Cell, Check, Report, Table};

use super::subject::Subject;
use super::views::LAYERED;
use crate::failures::stand::Stand;
use crate::impostors::{changed, reflecting};
use crate::statistics::median;

pub const SCENE: &str = "mirror-box";
const SIDE: u32 = 512;
/// As in the paper.
const VIEW_PX: UVec2 = UVec2::new(256, 256);
const VIEWS: usize = 5;
const REPEATS: usize = 3;
/// Mirrors on a ray's way.
const GENERATIONS: [u32; 4] = [0, 1, 2, 7];
const MOST: u32 = 7;
const LEAST_PSNR_DB: f64 = 27.0;
/// A light, and the bound of the time of a view with all mirrors over that of direct drawing.
const LIGHTS: [(&str, f64); 2] = [("shadows", 0.3), ("soft 16, occlusion 16", 0.05)];
/// The light by which a cube is to be repaid, and the most views after which it is; the paper's first scene takes 831.
const REPAID: (&str, f64) = ("shadows", 290.0);

/// Adds the table of all lights, and its checks.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, report: &mut Report) -> anyhow::Result<()> {
    let columns = [
        ("light", ""),
        ("mirrors", ""),
        ("mirrored pixels: PSNR", "dB"),
        ("mirrored pixels: FLIP", ""),
        ("a view", "ms"),
        ("direct", "ms"),
        ("over direct", ""),
        ("sampled", "s"),
        ("loaded", "s"),
        ("repaid after", "views"),
    ];
    let mut table = Table::new(format!("Mirrors of {SCENE} in views of 256×256 from a cube of {SIDE}²"), &columns);
    for (light, most) in LIGHTS {
        report.checks.extend(of_light(stand, light, most, &mut table)?);
    }
    report.tables.push(table);
    Ok(())
}

fn of_light(stand: &Stand, light: &str, most: f64, table: &mut Table) -> anyhow::Result<Vec<Check>> {
    let subject = Subject::of_views(stand, SCENE, light.parse()?, |_| cameras())?;
    let cube = subject.cube((SIDE, LayerSelection::Dominant), subject.lighting, 2)?;
    drop(subject.upload(&cube)?);
    let (set, load_s) = subject.upload(&cube)?;
    let (truths, _) = direct(&subject, MOST)?;
    let mirrored: Vec<Vec<bool>> = subject.truths.iter().zip(&truths).map(|(none, all)| changed(none, all)).collect();
    let mut checks = Vec::new();
    for generations in GENERATIONS {
        let (views, view_s) = walked(&subject, &set, generations)?;
        let direct_s = direct(&subject, generations)?.1;
        let [psnr, flip] = errors(&truths, &views, &mirrored)?;
        let saved_s = direct_s - view_s;
        let repaid = if saved_s > 0.0 { (cube.sample_s + load_s) / saved_s } else { f64::INFINITY };
        let numbers = [psnr, flip, view_s * 1e3, direct_s * 1e3, view_s / direct_s, cube.sample_s, load_s, repaid];
        table.push([Cell::from(light), Cell::from(generations)].into_iter().chain(numbers.map(Cell::from)))?;
        if generations == MOST {
            let over = format!("{SCENE}, {light}: a view with {MOST} mirrors over direct drawing");
            checks.push(Check::new(over, view_s / direct_s, "", Bar::AtMost(most)));
            if light == REPAID.0 {
                let of = format!("{SCENE}: mirrored pixels, {MOST} mirrors");
                checks.push(Check::new(of, psnr, "dB", Bar::AtLeast(LEAST_PSNR_DB)));
                let of = format!("{SCENE}, {light}: views that repay a cube");
                checks.push(Check::new(of, repaid, "", Bar::AtMost(REPAID.1)));
            }
        }
    }
    Ok(checks)
}

/// From before the box, from left to right.
pub fn cameras() -> Vec<PinholeCamera> {
    let view = |number: usize| {
        let right = number as f32 / (VIEWS - 1) as f32 * 2.0 - 1.0;
        let eye = Vec3::new(2.2 * right, 1.9, 6.0);
        PinholeCamera::looking_at(eye, Vec3::Y * 1.1, Vec3::Y, 0.7, VIEW_PX)
    };
    (0..VIEWS).map(view).collect()
}

/// Views by rays that meet up to `reflections` mirrors, and the seconds of one view.
///
/// # Errors
/// The device fails.
pub fn walked(subject: &Subject<'_>, set: &SampleSet, reflections: u32) -> anyhow::Result<(Vec<View>, f64)> {
    shown(subject, set, LAYERED, Mirrors { reflections, ..Mirrors::default() })
}

/// Views by a method that shows mirrors, and the seconds of one view.
///
/// # Errors
/// The device fails.
pub fn shown(
    subject: &Subject<'_>,
    set: &SampleSet,
    method: ReconstructionMethod,
    mirrors: Mirrors<'_>,
) -> anyhow::Result<(Vec<View>, f64)> {
    let (reconstructor, turn) = (subject.stand.reconstructor(), Default::default());
    timed(|| {
        Ok(reconstructor.reconstruct(ReconstructRequest {
            common: mirrors.into(),
            turn,
            ..ReconstructRequest::new(set, &subject.views, method)
        })?)
    })
}

/// The same views, drawn directly.
///
/// # Errors
/// The device fails.
pub fn direct(subject: &Subject<'_>, reflections: u32) -> anyhow::Result<(Vec<View>, f64)> {
    drawn(subject, reflecting(subject.lighting, reflections)?)
}

/// Views that are drawn directly in a light, and the seconds of one view.
///
/// # Errors
/// The device fails.
pub fn drawn(subject: &Subject<'_>, lighting: Lighting) -> anyhow::Result<(Vec<View>, f64)> {
    timed(|| subject.stand.views(&subject.on_device, lighting, &subject.views, ViewPlanes::COLOR))
}

/// Views, and the seconds of one: the first run makes shaders, and of the others the median counts.
fn timed(make: impl Fn() -> anyhow::Result<Vec<View>>) -> anyhow::Result<(Vec<View>, f64)> {
    let views = make()?;
    let run = |_| -> anyhow::Result<f64> {
        let start = Instant::now();
        make()?;
        Ok(start.elapsed().as_secs_f64() / views.len() as f64)
    };
    let seconds = median((0..REPEATS).map(run).collect::<anyhow::Result<_>>()?);
    Ok((views, seconds))
}

/// Mean PSNR and FLIP over the marked pixels.
///
/// # Errors
/// Views differ in size, or no pixel is marked.
pub fn errors(truths: &[View], views: &[View], pixels: &[Vec<bool>]) -> anyhow::Result<[f64; 2]> {
    let mut sums = [0.0; 2];
    for ((truth, view), pixels) in truths.iter().zip(views).zip(pixels) {
        let [reference, picture] = [Rgb8Image::of_view(truth)?, Rgb8Image::of_view(view)?];
        sums[0] += psnr_db(&reference, &picture, Some(pixels))?.context("mirrored pixels")?;
        sums[1] += flip_map(&reference, &picture)?.mean(Some(pixels))?.context("mirrored pixels")?;
    }
    Ok(sums.map(|sum| sum / truths.len() as f64))
}
