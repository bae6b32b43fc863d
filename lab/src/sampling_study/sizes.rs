//! Fig. 7: redundancy by pixel approaches redundancy by visibility as images grow.

use app_core::progress::bar;
use glam::UVec2;
use report::{Axis, Bar, Cell, Check, Report, Series, Table, XyChart};
use sampling::{Redundancy, SamplingMethod};

use super::counts::{ImageCount, image_counts, mark_useful, percent};
use super::extent::Extent;
use super::held::Held;
use super::methods::{IMAGES, METHODS};
use super::subject::{Subject, WITH_IDS};
use super::visibility::seen;

const SIDES_PX: [u32; 4] = [256, 512, 1024, 2048];
/// The scenes of the paper's figure.
const SCENES: [&str; 2] = ["bird-nest", "urban"];

/// The number of views that decide which samples are useful.
const VIEWS: usize = 24;

/// Means over images 1 and 2 of one size, in per cent, by pixel and by visibility. Redundant samples are those of
/// conventional images, disoccluded and useful ones those of non-redundant images.
pub struct SizeRow {
    side_px: u32,
    redundant: [f64; 2],
    disoccluded: [f64; 2],
    useful: [f64; 2],
}

/// The name of a metric, and its values by pixel and by visibility.
type Metric = (&'static str, fn(&SizeRow) -> [f64; 2]);

/// Measures a scene if the paper shows it.
pub fn sizes(subject: &Subject, extent: Extent, quick: bool) -> anyhow::Result<Vec<SizeRow>> {
    if !SCENES.contains(&subject.name.as_str()) {
        return Ok(Vec::new());
    }
    let sides = if quick { &SIDES_PX[..2] } else { &SIDES_PX[..] };
    let rays = render::scalar::rays::Scene::of(&subject.scene, 0.0)?;
    let progress = bar(format!("{}: sizes of images", subject.name), sides.len());
    let mut rows = Vec::with_capacity(sides.len());
    for &side_px in sides {
        let size_px = UVec2::splat(side_px);
        let viewpoints = subject.cameras(SamplingMethod::CONVENTIONAL, size_px);
        let methods = [METHODS[0], METHODS[1], SamplingMethod::NonRedundant(Redundancy::Visibility)];
        let take = |method| subject.sample(method, size_px, WITH_IDS);
        let [whole, apart, by_rays] = [take(methods[0])?, take(methods[1])?, take(methods[2])?];
        let views = subject.between(VIEWS, size_px);
        let redundant = seen(&rays, methods[0], &whole, &viewpoints, &[], extent.seeds);
        let disoccluded = seen(&rays, methods[2], &by_rays, &viewpoints, &views, extent.seeds);
        let mut counts = image_counts(&[whole, apart]);
        subject.each_frame(&views, |frames| {
            frames.iter().filter_map(Held::of).for_each(|frame| mark_useful(&mut counts, &frame));
            Ok(())
        })?;
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / (IMAGES - 1) as f64;
        rows.push(SizeRow {
            side_px,
            redundant: [
                mean(&mut counts[0][1..].iter().map(|c| percent(c.redundant, c.samples))),
                mean(&mut redundant[1..].iter().map(|seen| 100.0 * seen.redundant.share)),
            ],
            disoccluded: [
                mean(&mut counts[1][1..].iter().map(|c| percent(c.disoccluded.len(), c.samples))),
                mean(&mut disoccluded[1..].iter().map(|seen| 100.0 * seen.disoccluded.share)),
            ],
            useful: [
                mean(&mut counts[1][1..].iter().map(|c: &ImageCount| percent(c.useful_count(), c.disoccluded.len()))),
                mean(&mut disoccluded[1..].iter().map(|seen| 100.0 * seen.useful.share)),
            ],
        });
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(rows)
}

/// Adds a table, charts and checks of one scene.
pub fn sizes_report(scene: &str, rows: &[SizeRow], report: &mut Report) -> anyhow::Result<()> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(()) };
    let columns = [
        ("side", "px"),
        ("redundant by pixel", "%"),
        ("redundant by visibility", "%"),
        ("disoccluded by pixel", "%"),
        ("disoccluded by visibility", "%"),
        ("useful, of these, by pixel", "%"),
        ("by visibility", "%"),
    ];
    let mut table = Table::new(format!("Fig. 7, {scene}"), &columns);
    for row in rows {
        let cells = row.redundant.into_iter().chain(row.disoccluded).chain(row.useful).map(Cell::from);
        table.push([row.side_px.into()].into_iter().chain(cells))?;
    }
    report.tables.push(table);
    let redundant: Metric = ("redundant", |row| row.redundant);
    let disoccluded: Metric = ("disoccluded", |row| row.disoccluded);
    let useful: Metric = ("useful", |row| row.useful);
    for (what, of) in [redundant, disoccluded, useful] {
        let axes = (Axis::log("side of images", "px"), Axis::linear(what, "%"));
        let line = |name: &str, place: usize| {
            Series::line(name, rows.iter().map(move |row| (f64::from(row.side_px), of(row)[place])))
        };
        let chart = XyChart::new(format!("Fig. 7, {scene}: {what} samples"), axes.0, axes.1);
        report.charts.push(chart.with(line("by pixel", 0)).with(line("by visibility", 1)).into());
        let gap = |row: &SizeRow| (of(row)[0] - of(row)[1]).abs();
        let name = format!(
            "{scene}: {what} by pixel and by visibility, gap at {} px over that at {} px",
            last.side_px, first.side_px
        );
        report.checks.push(Check::new(name, gap(last) / gap(first), "×", Bar::AtMost(0.75)));
    }
    Ok(())
}
