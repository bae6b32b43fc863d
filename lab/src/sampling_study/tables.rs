//! Table 1 and Table 2 of the paper, its figures beside ours.

use report::{Bar, Cell, Check, Report};
use sampling::{Redundancy, SamplingMethod};

use super::availability::Availability;
use super::counts::{ImageCount, percent};
use super::methods::{IMAGES, METHODS};
use super::paper::{PaperImage, paper_available, paper_image};
use super::scene::SceneRow;
use super::visibility::{Estimate, VisibilityEstimates};
use crate::study::{Column, table};

const PIXEL: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Pixel);
const VISIBILITY: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Visibility);
const PEELING: SamplingMethod = SamplingMethod::DepthPeeling { layers: IMAGES as u32 };

/// An image of a set.
struct ImageRow<'s> {
    scene: &'s str,
    method: SamplingMethod,
    number: usize,
    count: &'s ImageCount,
    seen: VisibilityEstimates,
    paper: PaperImage,
}

/// A set in the output frames.
struct SetRow<'s> {
    scene: &'s str,
    method: SamplingMethod,
    available: &'s Availability,
    /// The paper's average and least.
    paper: [Option<f64>; 2],
}

fn image_columns<'s>() -> [Column<ImageRow<'s>>; 10] {
    [
        Column::new("scene", |row| row.scene.into()),
        Column::new("sampling", |row| row.method.to_string().into()),
        Column::new("image", |row| row.number.into()),
        Column::new("samples", |row| row.count.samples.into()),
        Column::with_unit("redundant", "%", |row| percent(row.count.redundant, row.count.samples).into()),
        Column::with_unit("disoccluded", "%", |row| percent(row.count.disoccluded.len(), row.count.samples).into()),
        Column::with_unit("useful, of these", "%", |row| {
            percent(row.count.useful_count(), row.count.disoccluded.len()).into()
        }),
        Column::with_unit("paper: redundant", "%", |row| row.paper.redundant.into()),
        Column::with_unit("paper: disoccluded", "%", |row| row.paper.disoccluded.into()),
        Column::with_unit("paper: useful", "%", |row| row.paper.useful.into()),
    ]
}

fn seen_columns<'s>() -> [Column<ImageRow<'s>>; 6] {
    [
        Column::new("scene", |row| row.scene.into()),
        Column::new("sampling", |row| row.method.to_string().into()),
        Column::new("image", |row| row.number.into()),
        Column::with_unit("redundant", "%", |row| with_interval(row.seen.redundant)),
        Column::with_unit("disoccluded", "%", |row| with_interval(row.seen.disoccluded)),
        Column::with_unit("useful, of these", "%", |row| with_interval(row.seen.useful)),
    ]
}

fn set_columns<'s>() -> [Column<SetRow<'s>>; 6] {
    [
        Column::new("scene", |row| row.scene.into()),
        Column::new("sampling", |row| row.method.to_string().into()),
        Column::with_unit("available, average", "%", |row| row.available.mean().into()),
        Column::with_unit("available, least", "%", |row| row.available.least().into()),
        Column::with_unit("paper: average", "%", |row| row.paper[0].into()),
        Column::with_unit("paper: least", "%", |row| row.paper[1].into()),
    ]
}

/// A share and its 95 % interval, in per cent.
fn with_interval(estimate: Estimate) -> Cell {
    let Estimate { share, half_width } = estimate;
    if share.is_nan() { Cell::Missing } else { format!("{:.1} ± {:.1}", 100.0 * share, 100.0 * half_width).into() }
}

/// Adds the tables of all scenes, and checks that no sample is redundant by the test of its method.
///
/// # Errors
/// A row does not fit its table.
pub fn tables(scenes: &[SceneRow], report: &mut Report) -> anyhow::Result<()> {
    let images: Vec<ImageRow<'_>> = scenes.iter().flat_map(image_rows).collect();
    let sets: Vec<SetRow<'_>> = scenes.iter().flat_map(set_rows).collect();
    report.tables.push(table("Table 1, by pixel", &image_columns(), &images)?);
    report.tables.push(table("Table 1, by visibility (95 % intervals)", &seen_columns(), &images)?);
    report.tables.push(table("Table 2", &set_columns(), &sets)?);
    report.checks.extend(scenes.iter().flat_map(|scene| checks(scene.name.as_str(), &image_rows(scene))));
    Ok(())
}

fn image_rows(scene: &SceneRow) -> Vec<ImageRow<'_>> {
    let rows = METHODS.into_iter().enumerate().flat_map(|(place, method)| {
        let images = scene.counts[place].iter().zip(&scene.seen[place]).enumerate();
        images.map(move |(number, (count, &seen))| {
            let paper = paper_image(&scene.name, method, number);
            ImageRow { scene: scene.name.as_str(), method, number, count, seen, paper }
        })
    });
    rows.collect()
}

fn set_rows(scene: &SceneRow) -> Vec<SetRow<'_>> {
    let rows = METHODS.into_iter().zip(&scene.available).map(|(method, available)| {
        let paper = paper_available(&scene.name, method);
        SetRow { scene: scene.name.as_str(), method, available, paper }
    });
    rows.collect()
}

fn checks(scene: &str, images: &[ImageRow<'_>]) -> [Check; 3] {
    let [pixel, peeling] = [PIXEL, PEELING].map(|method| {
        let of_method = images.iter().filter(|image| image.method == method);
        let redundant: usize = of_method.clone().map(|image| image.count.redundant).sum();
        let samples: usize = of_method.map(|image| image.count.samples).sum();
        let name = format!("{scene}: redundant samples of {method}");
        Check::new(name, percent(redundant, samples), "%", Bar::AtMost(0.01))
    });
    let by_rays = images.iter().filter(|image| image.method == VISIBILITY).map(|image| image.seen.redundant);
    let least = by_rays.map(|seen| 100.0 * (seen.share - seen.half_width)).fold(0.0, f64::max);
    let name = format!("{scene}: redundant samples of {VISIBILITY}, by visibility, lower bound");
    [pixel, peeling, Check::new(name, least, "%", Bar::AtMost(0.1))]
}
