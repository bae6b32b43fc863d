//! Fig. 7: redundancy by pixel approaches redundancy by visibility as images grow.

use glam::UVec2;
use report::{Axis, Bar, Check, Report, Series, XyChart};
use sampling::{Redundancy, SamplingMethod};

use super::counts::{image_counts, mark_useful, percent};
use super::extent::Extent;
use super::held::ImageSurfaces;
use super::methods::{IMAGES, METHODS};
use super::subject::{Subject, WITH_IDS};
use super::visibility::seen;
use crate::study::{Column, measure_rows, table};

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

const COLUMNS: [Column<SizeRow>; 7] = [
    Column::with_unit("side", "px", |row| row.side_px.into()),
    Column::with_unit("redundant by pixel", "%", |row| row.redundant[0].into()),
    Column::with_unit("redundant by visibility", "%", |row| row.redundant[1].into()),
    Column::with_unit("disoccluded by pixel", "%", |row| row.disoccluded[0].into()),
    Column::with_unit("disoccluded by visibility", "%", |row| row.disoccluded[1].into()),
    Column::with_unit("useful, of these, by pixel", "%", |row| row.useful[0].into()),
    Column::with_unit("by visibility", "%", |row| row.useful[1].into()),
];

/// A metric by pixel and by visibility.
type Metric = (&'static str, fn(&SizeRow) -> [f64; 2]);

const METRICS: [Metric; 3] =
    [("redundant", |row| row.redundant), ("disoccluded", |row| row.disoccluded), ("useful", |row| row.useful)];

/// Measures a scene if the paper shows it.
///
/// # Errors
/// The device fails.
pub fn sizes(subject: &Subject, extent: Extent) -> anyhow::Result<Vec<SizeRow>> {
    if !SCENES.contains(&subject.name.as_str()) {
        return Ok(Vec::new());
    }
    let rays = render::scalar::rays::Scene::of(&subject.scene, 0.0)?;
    let sides = &SIDES_PX[..extent.sides];
    measure_rows(&format!("{}: sizes of images", subject.name), sides, |&side_px| {
        SizeRow::measure(subject, &rays, side_px, extent.seeds)
    })
}

impl SizeRow {
    fn measure(
        subject: &Subject,
        rays: &render::scalar::rays::Scene,
        side_px: u32,
        seeds: usize,
    ) -> anyhow::Result<Self> {
        let size_px = UVec2::splat(side_px);
        let viewpoints = subject.cameras(SamplingMethod::CONVENTIONAL, size_px);
        let views = subject.between(VIEWS, size_px);
        let by_rays = SamplingMethod::NonRedundant(Redundancy::Visibility);
        let whole = subject.sample(METHODS[0], size_px, WITH_IDS)?;
        let redundant = seen(rays, METHODS[0], &whole, &viewpoints, &[], seeds);
        let visible = subject.sample(by_rays, size_px, WITH_IDS)?;
        let disoccluded = seen(rays, by_rays, &visible, &viewpoints, &views, seeds);
        let mut counts = image_counts(&[whole, subject.sample(METHODS[1], size_px, WITH_IDS)?]);
        subject.each_frame(&views, |frames| {
            frames.iter().filter_map(ImageSurfaces::of).for_each(|frame| mark_useful(&mut counts, &frame));
            Ok(())
        })?;
        let [conventional, by_pixel] = [&counts[0], &counts[1]];
        Ok(Self {
            side_px,
            redundant: [
                mean_of_later(conventional, |image| percent(image.redundant, image.samples)),
                100.0 * mean_of_later(&redundant, |image| image.redundant.share),
            ],
            disoccluded: [
                mean_of_later(by_pixel, |image| percent(image.disoccluded.len(), image.samples)),
                100.0 * mean_of_later(&disoccluded, |image| image.disoccluded.share),
            ],
            useful: [
                mean_of_later(by_pixel, |image| percent(image.useful_count(), image.disoccluded.len())),
                100.0 * mean_of_later(&disoccluded, |image| image.useful.share),
            ],
        })
    }
}

/// The mean over all images but the first.
pub(super) fn mean_of_later<T>(images: &[T], value: fn(&T) -> f64) -> f64 {
    images[1..].iter().map(value).sum::<f64>() / (IMAGES - 1) as f64
}

/// Adds a table, charts and checks of one scene.
///
/// # Errors
/// A row does not fit its table.
pub fn sizes_report(scene: &str, rows: &[SizeRow], report: &mut Report) -> anyhow::Result<()> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(()) };
    report.tables.push(table(format!("Fig. 7, {scene}"), &COLUMNS, rows)?);
    for (what, of) in METRICS {
        let mut chart = XyChart::new(
            format!("Fig. 7, {scene}: {what} samples"),
            Axis::log("side of images", "px"),
            Axis::linear(what, "%"),
        );
        for (place, name) in ["by pixel", "by visibility"].into_iter().enumerate() {
            chart = chart.with(Series::line(name, rows.iter().map(|row| (f64::from(row.side_px), of(row)[place]))));
        }
        report.charts.push(chart);
        let [last_gap, first_gap] = [last, first].map(|row| (of(row)[0] - of(row)[1]).abs());
        let sides = format!("gap at {} px over that at {} px", last.side_px, first.side_px);
        let name = format!("{scene}: {what} by pixel and by visibility, {sides}");
        report.checks.push(Check::new(name, last_gap / first_gap, "×", Bar::AtMost(0.75)));
    }
    Ok(())
}
