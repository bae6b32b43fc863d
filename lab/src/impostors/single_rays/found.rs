//! Which rays find the teapot's surface, in images of equal texels.

use depth_image::{Camera, ProvenanceKind, srgb8_from_linear};
use glam::Vec3;
use reconstruction::{RayEnd, RayWork};
use report::{Axis, Bar, Cell, Check, Series, Table, XyChart};

use super::teapot::{ASIDE, NEAR_M, Rays, Teapot};

/// The side of one image; several share its texels.
pub const SIDE_PX: u32 = 512;
/// Ends within this share of the teapot's longest side are right.
const RIGHT: f32 = 0.01;
/// Distortions of an image of [`SIDE_PX`].
const DISTORTIONS_PX: [f32; 8] = [0.0, 20.0, 40.0, 60.0, 80.0, 120.0, 160.0, 200.0];
/// Widths of patches, in distances.
const RATIOS: [f32; 5] = [0.25, 0.5, 1.0, 2.0, 3.0];
/// No two colours differ by less.
pub const LEAST_ERROR: f64 = 1e-9;

/// Of rays that meet the teapot.
pub struct Figures {
    pub name: &'static str,
    pub distortion_px: f32,
    pub images: usize,
    pub found_ratio: f64,
    /// Ends elsewhere.
    pub wrong_ratio: f64,
    pub psnr_db: f64,
}

/// One to four images, of pinholes and of single-pole cameras.
///
/// # Errors
/// The device fails.
pub fn compare(teapot: &Teapot<'_>, rays: &Rays) -> anyhow::Result<Vec<Figures>> {
    let aside_m = ASIDE * rays.width_m;
    let at = |x: f32, y: f32| rays.middle + Vec3::new(x, y, 0.0) * aside_m;
    let root = |images: u32| (f64::from(SIDE_PX) / f64::from(images).sqrt()) as u32;
    let bent = |eyes: &[Vec3], side_px: u32, distortion_px: f32| -> Vec<Camera> {
        eyes.iter().map(|eye| Camera::SinglePole(teapot.camera(*eye, distortion_px, side_px))).collect()
    };
    let pinholes = |eyes: &[Vec3], side_px: u32| -> Vec<Camera> {
        eyes.iter().map(|eye| teapot.camera(*eye, 0.0, side_px).reference.into()).collect()
    };
    let best = |name, eyes: &[Vec3], side_px: u32| -> anyhow::Result<Figures> {
        let scale = side_px as f32 / SIDE_PX as f32;
        let tried = DISTORTIONS_PX.iter().map(|distortion_px| {
            let figures = figures(teapot, rays, name, &bent(eyes, side_px, distortion_px * scale))?;
            Ok(Figures { distortion_px: distortion_px * scale, ..figures })
        });
        let tried = tried.collect::<anyhow::Result<Vec<_>>>()?;
        tried.into_iter().max_by(|a, b| a.found_ratio.total_cmp(&b.found_ratio)).ok_or_else(|| anyhow::anyhow!("none"))
    };
    let square = [at(-1.0, -1.0), at(1.0, 1.0), at(1.0, -1.0), at(-1.0, 1.0)];
    Ok(vec![
        figures(teapot, rays, PINHOLE, &bent(&[rays.middle], SIDE_PX, 0.0))?,
        figures(teapot, rays, "one pinhole, joint_carve", &pinholes(&[rays.middle], SIDE_PX))?,
        best(SINGLE_POLE, &[rays.middle], SIDE_PX)?,
        best(SINGLE_POLES, &[at(-1.0, 0.0), at(1.0, 0.0)], root(2))?,
        figures(teapot, rays, "two pinholes, joint_carve", &pinholes(&square[..2], root(2)))?,
        figures(teapot, rays, PINHOLES, &pinholes(&square, root(4)))?,
    ])
}

fn figures(teapot: &Teapot<'_>, rays: &Rays, name: &'static str, cameras: &[Camera]) -> anyhow::Result<Figures> {
    let set = teapot.set(cameras)?;
    let work = RayWork::new(&set, NEAR_M);
    let (ends, _) = teapot.stand.reconstructor().follow(work, &rays.rays)?;
    let of_teapot = ends.iter().zip(&rays.truth).filter_map(|(end, truth)| truth.map(|truth| (end, truth)));
    let tolerance_m = RIGHT * teapot.bounds.size().max_element();
    let (mut count, mut found, mut wrong, mut error) = (0usize, 0usize, 0usize, 0.0);
    for (end, (way_m, color_linear)) in of_teapot {
        let is_hit = end.kind == ProvenanceKind::Hit;
        let is_right = is_hit && (end.way_m - way_m).abs() <= tolerance_m;
        count += 1;
        found += usize::from(is_right);
        wrong += usize::from(is_hit && !is_right);
        error += squared_error(end, color_linear);
    }
    anyhow::ensure!(count > 0, "no ray meets the teapot");
    Ok(Figures {
        name,
        distortion_px: 0.0,
        images: cameras.len(),
        found_ratio: found as f64 / count as f64,
        wrong_ratio: wrong as f64 / count as f64,
        psnr_db: -10.0 * (error / count as f64).max(LEAST_ERROR).log10(),
    })
}

/// Of sRGB from 0 to 1; rays that find nothing are black.
pub fn squared_error(end: &RayEnd, truth_linear: Vec3) -> f64 {
    let found = if end.kind == ProvenanceKind::Hit { end.color_linear } else { Vec3::ZERO };
    let apart = |channel: usize| {
        let [a, b] = [found, truth_linear].map(|color| f64::from(srgb8_from_linear(color[channel])) / 255.0);
        (a - b) * (a - b)
    };
    (apart(0) + apart(1) + apart(2)) / 3.0
}

pub fn table(name: &str, rows: &[Figures]) -> anyhow::Result<Table> {
    let columns = [
        ("images", ""),
        ("number", ""),
        ("distortion, the best for these rays", "px"),
        ("found", "%"),
        ("wrong", "%"),
        ("PSNR", "dB"),
    ];
    let mut table = Table::new(name, &columns);
    for row in rows {
        let numbers = [f64::from(row.distortion_px), row.found_ratio * 100.0, row.wrong_ratio * 100.0, row.psnr_db];
        table.push([Cell::from(row.name), Cell::from(row.images)].into_iter().chain(numbers.map(Cell::from)))?;
    }
    Ok(table)
}

/// The share of rays that one image leaves, by its distortion and the patch's width.
///
/// # Errors
/// The device fails.
pub fn by_distortion(teapot: &Teapot<'_>, patch: impl Fn(f32) -> Rays) -> anyhow::Result<XyChart> {
    let axes = [
        Axis::linear("distortion, the best for these rays", "px"),
        Axis::linear("rays that do not find the teapot", "%"),
    ];
    let [x, y] = axes;
    let mut chart = XyChart::new("What one single-pole image leaves, by the patch's width over its distance", x, y);
    for ratio in RATIOS {
        let rays = patch(ratio);
        let left = DISTORTIONS_PX.iter().map(|&distortion_px| {
            let camera = Camera::SinglePole(teapot.camera(rays.middle, distortion_px, SIDE_PX));
            let figures = figures(teapot, &rays, "", &[camera])?;
            Ok([f64::from(distortion_px), (1.0 - figures.found_ratio) * 100.0])
        });
        let left = left.collect::<anyhow::Result<Vec<[f64; 2]>>>()?;
        chart = chart.with(Series::line(format!("{ratio}"), left.into_iter().map(|[x, y]| (x, y))));
    }
    Ok(chart)
}

const PINHOLE: &str = "one pinhole, curved_search";
const SINGLE_POLE: &str = "single_pole:1";
const SINGLE_POLES: &str = "single_pole:2";
const PINHOLES: &str = "four pinholes, joint_carve";

fn row<'f>(rows: &'f [Figures], name: &str) -> anyhow::Result<&'f Figures> {
    rows.iter().find(|row| row.name == name).ok_or_else(|| anyhow::anyhow!("{name} was not measured"))
}

/// Of a flat patch that is as wide as it is far.
///
/// # Errors
/// A row is missing.
pub fn checks(rows: &[Figures]) -> anyhow::Result<Vec<Check>> {
    let (pinhole, pole) = (row(rows, PINHOLE)?, row(rows, SINGLE_POLE)?);
    let (poles, pinholes) = (row(rows, SINGLE_POLES)?, row(rows, PINHOLES)?);
    let points = (pole.found_ratio - pinhole.found_ratio) * 100.0;
    let (over_pinhole_db, over_pole_db) = (pole.psnr_db - pinhole.psnr_db, pinholes.psnr_db - pole.psnr_db);
    Ok(vec![
        Check::new("flat patch: rays found by a single pole less a pinhole's", points, "points", Bar::AtLeast(8.0)),
        Check::new("flat patch: rays found by two single poles", poles.found_ratio * 100.0, "%", Bar::AtLeast(97.0)),
        Check::new("flat patch: rays found by four pinholes", pinholes.found_ratio * 100.0, "%", Bar::AtLeast(98.5)),
        Check::new("flat patch: wrong ends of four pinholes", pinholes.wrong_ratio * 100.0, "%", Bar::AtMost(1.0)),
        Check::new("flat patch: colour, single pole over pinhole", over_pinhole_db, "dB", Bar::AtLeast(2.0)),
        Check::new("flat patch: colour, four pinholes over single pole", over_pole_db, "dB", Bar::AtLeast(5.0)),
    ])
}

/// Of the scene's mirror.
///
/// # Errors
/// A row is missing.
pub fn checks_of_mirror(rows: &[Figures]) -> anyhow::Result<Vec<Check>> {
    let (pinhole, pole, pinholes) = (row(rows, PINHOLE)?, row(rows, SINGLE_POLE)?, row(rows, PINHOLES)?);
    let points = (pole.found_ratio - pinhole.found_ratio) * 100.0;
    let over_pole_db = pinholes.psnr_db - pole.psnr_db;
    Ok(vec![
        Check::new("mirror: rays found by a single pole less a pinhole's", points, "points", Bar::AtLeast(2.0)),
        Check::new("mirror: rays found by four pinholes", pinholes.found_ratio * 100.0, "%", Bar::AtLeast(98.5)),
        Check::new("mirror: colour, four pinholes over single pole", over_pole_db, "dB", Bar::AtLeast(4.0)),
    ])
}
