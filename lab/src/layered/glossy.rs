//! Glossy pixels by rays into their lobes, drawn directly and in a cube, and gathered in light fields: error against time.

use depth_image::{LightDirections, PinholeCamera, View, ViewPlanes};
use glam::Vec3;
use reconstruction::Mirrors;
use render::{LayerSelection, Lighting};
use report::{Axis, Bar, Check, Mark, PictureRow, Point, Report, XyChart};

use super::figures;
use super::mirrors::{self, TimedViews, VIEW_PX, errors};
use super::subject::Subject;
use super::views::LAYERED;
use crate::failures::stand::Stand;
use crate::impostors::changed;
use crate::pareto::{Better, with_front};
use crate::study::{Column, table, with_series};

pub const SCENE: &str = "teapot-floor";
const VIEWS: usize = 3;
const LIGHT: &str = "shadows";
/// Rays a pixel, and those of the reference.
const RAYS: [u32; 5] = [1, 4, 16, 64, 128];
const MOST_RAYS: u32 = 256;
/// Rays of a quick run.
const QUICK: usize = 3;
/// The number of rays a pixel to which gathering in 258 directions is to be equal or better.
const FEW_RAYS: u32 = 4;
const SIDE: u32 = 512;
/// Pictures show rays of this number, which quick runs have, too.
const PICTURED_RAYS: u32 = 16;

/// How glossy pixels are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// By this number of rays a pixel, in the scene.
    Drawn(u32),
    /// The same, in a cube.
    InCube(u32),
    Gathered(LightDirections),
}

struct GlossyRow {
    way: Way,
    psnr_db: f64,
    flip: f64,
    view_s: f64,
    view: View,
}

const COLUMNS: [Column<GlossyRow>; 5] = [
    Column::new("way", |row| row.way.kind().into()),
    Column::new("rays or directions", |row| row.way.count().into()),
    Column::with_unit("PSNR", "dB", |row| row.psnr_db.into()),
    Column::new("FLIP", |row| row.flip.into()),
    Column::with_unit("a view", "ms", |row| (row.view_s * 1e3).into()),
];

impl Way {
    fn kind(self) -> &'static str {
        match self {
            Self::Drawn(_) => "rays, drawn directly",
            Self::InCube(_) => "rays in a cube",
            Self::Gathered(_) => "gathered directions",
        }
    }

    fn is_pictured(self) -> bool {
        match self {
            Self::Drawn(rays) | Self::InCube(rays) => rays == PICTURED_RAYS,
            Self::Gathered(directions) => directions != LightDirections::D66,
        }
    }

    fn count(self) -> u32 {
        match self {
            Self::Drawn(rays) | Self::InCube(rays) => rays,
            Self::Gathered(directions) => directions.count(),
        }
    }
}

/// Adds the table of all numbers of rays and of directions, its check, a chart and pictures; quick runs leave the most rays out.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let subject = Subject::of_views(stand, SCENE, LIGHT.parse()?, |_| cameras())?;
    let truths = stand.views(&subject.on_device, lighting(MOST_RAYS)?, &subject.views, ViewPlanes::COLOR)?;
    let glossy: Vec<Vec<bool>> = subject.truths.iter().zip(&truths).map(|(none, all)| changed(none, all)).collect();
    let row = |way: Way, timed: TimedViews| -> anyhow::Result<GlossyRow> {
        let [psnr_db, flip] = errors(&truths, &timed.views, &glossy)?;
        Ok(GlossyRow { way, psnr_db, flip, view_s: timed.view_s, view: mirrors::middle(&timed.views)?.clone() })
    };
    let rays = &RAYS[..if is_quick { QUICK } else { RAYS.len() }];
    let mut rows = Vec::new();
    for &rays in rays {
        rows.push(row(Way::Drawn(rays), TimedViews::drawn(&subject, lighting(rays)?)?)?);
    }
    let cube = subject.cube(SIDE, LayerSelection::Dominant, subject.lighting, 1)?;
    let set = subject.upload(&cube, None)?.0;
    for &rays in rays {
        let mirrors = Mirrors { glossy_rays: rays, ..Mirrors::default() };
        rows.push(row(Way::InCube(rays), TimedViews::of_cube(&subject, &set, LAYERED, mirrors)?)?);
    }
    let mirrors = Mirrors { glossy_rays: 1, ..Mirrors::default() };
    for directions in LightDirections::ALL {
        let field = subject.light_field(directions, lighting(1)?)?.0;
        let set = subject.upload(&cube, Some(field))?.0;
        rows.push(row(Way::Gathered(directions), TimedViews::of_cube(&subject, &set, LAYERED, mirrors)?)?);
    }
    let title = format!("Glossy pixels of {SCENE}, against {MOST_RAYS} rays drawn directly");
    report.tables.push(table(&title, &COLUMNS, &rows)?);
    report.charts.push(chart(&rows));
    report.checks.extend(check(&rows));
    report.pictures.push(picture_row(&rows, mirrors::middle(&truths)?)?);
    Ok(())
}

fn chart(rows: &[GlossyRow]) -> XyChart {
    let title = format!("Glossy pixels of {SCENE}: PSNR over time");
    let chart = XyChart::new(title, Axis::log("a view", "ms"), Axis::linear("PSNR", "dB"));
    let chart = with_series(
        chart,
        rows,
        Mark::Line,
        |row| row.way.kind().to_owned(),
        |row| Point::labelled(row.view_s * 1e3, row.psnr_db, row.way.count().to_string()),
    );
    let mut chart = with_front(chart, [Better::Low, Better::High]);
    chart.note = "Numbers of rays a pixel and of directions stand beside the points.".to_owned();
    chart
}

fn check(rows: &[GlossyRow]) -> Option<Check> {
    let gathered = rows.iter().find(|row| row.way == Way::Gathered(LightDirections::D258))?;
    let drawn = rows.iter().find(|row| row.way == Way::Drawn(FEW_RAYS))?;
    let gain_db = gathered.psnr_db - drawn.psnr_db;
    let name = format!("{SCENE}: gathering in 258 directions over {FEW_RAYS} rays");
    Some(Check::new(name, gain_db, "dB", Bar::AtLeast(0.0)))
}

fn picture_row(rows: &[GlossyRow], truth: &View) -> anyhow::Result<PictureRow> {
    let shown = rows.iter().rev().filter(|row| row.way.is_pictured());
    let captioned = shown.map(|row| (format!("{} {}", row.way.count(), row.way.kind()), &row.view));
    let truth = (format!("{MOST_RAYS} rays, drawn directly"), truth);
    figures::row(5, "A teapot on a glossy floor", captioned.chain([truth]))
}

/// Cameras towards the corner of the room, from left to right.
pub fn cameras() -> Vec<PinholeCamera> {
    let cameras = (0..VIEWS).map(|number| {
        let aside = number as f32 - 0.5 * (VIEWS - 1) as f32;
        PinholeCamera::looking_at(Vec3::new(8.0 + aside, 4.5, 8.0 - aside), Vec3::Y, Vec3::Y, 0.7, VIEW_PX)
    });
    cameras.collect()
}

fn lighting(rays: u32) -> anyhow::Result<Lighting> {
    Ok(format!("{LIGHT}, glossy {rays}").parse()?)
}
