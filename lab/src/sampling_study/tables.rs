//! Table 1 and Table 2 of the paper, its figures beside ours.

use report::{Cell, Report, Table};
use sampling::SamplingMethod;

use super::checks::{checks, missing_ratio};
use super::counts::percent;
use super::methods::METHODS;
use super::paper::{PAPER_AVAILABLE, paper};
use super::scene::SceneRow;

/// Adds tables and checks of all scenes.
pub fn tables(rows: &[SceneRow], report: &mut Report) -> anyhow::Result<()> {
    report.tables.push(by_pixel(rows)?);
    report.tables.push(by_visibility(rows)?);
    report.tables.push(availabilities(rows)?);
    report.checks.extend(rows.iter().flat_map(checks));
    report.checks.push(missing_ratio(rows));
    Ok(())
}

fn by_pixel(rows: &[SceneRow]) -> anyhow::Result<Table> {
    let columns = [
        ("scene", ""),
        ("sampling", ""),
        ("image", ""),
        ("samples", ""),
        ("redundant", "%"),
        ("disoccluded", "%"),
        ("useful, of these", "%"),
        ("paper: redundant", "%"),
        ("paper: disoccluded", "%"),
        ("paper: useful", "%"),
    ];
    let mut table = Table::new("Table 1, by pixel", &columns);
    for row in rows {
        for (method, images) in METHODS.iter().zip(&row.counts) {
            for (number, image) in images.iter().enumerate() {
                let ours = [
                    percent(image.redundant, image.samples),
                    percent(image.disoccluded.len(), image.samples),
                    percent(image.useful_count(), image.disoccluded.len()),
                ];
                let head = [row.name.clone().into(), method.to_string().into(), number.into(), image.samples.into()];
                table.push(head.into_iter().chain(ours.map(Cell::from)).chain(paper(&row.name, *method, number)))?;
            }
        }
    }
    Ok(table)
}

fn by_visibility(rows: &[SceneRow]) -> anyhow::Result<Table> {
    let columns = [
        ("scene", ""),
        ("sampling", ""),
        ("image", ""),
        ("redundant", "%"),
        ("± 95 %, redundant", "%"),
        ("disoccluded", "%"),
        ("± 95 %, disoccluded", "%"),
        ("useful, of these", "%"),
        ("± 95 %, useful", "%"),
    ];
    let mut table = Table::new("Table 1, by visibility", &columns);
    for row in rows {
        for (method, images) in METHODS.iter().zip(&row.seen) {
            for (number, image) in images.iter().enumerate() {
                let estimates = [image.redundant, image.disoccluded, image.useful];
                let cells = estimates.into_iter().flat_map(|e| [100.0 * e.share, 100.0 * e.half_width].map(Cell::from));
                let head = [row.name.clone().into(), method.to_string().into(), number.into()];
                table.push(head.into_iter().chain(cells))?;
            }
        }
    }
    Ok(table)
}

fn availabilities(rows: &[SceneRow]) -> anyhow::Result<Table> {
    let columns = [
        ("scene", ""),
        ("sampling", ""),
        ("available, average", "%"),
        ("available, least", "%"),
        ("paper: average", "%"),
        ("paper: least", "%"),
    ];
    let mut table = Table::new("Table 2", &columns);
    for row in rows {
        let paper = PAPER_AVAILABLE.iter().find(|(name, _)| *name == row.name).map(|(_, figures)| figures);
        for (method, available) in METHODS.iter().zip(&row.available) {
            let kind = match method {
                SamplingMethod::Conventional(_) => 0,
                SamplingMethod::DepthPeeling { .. } => 2,
                _ => 1,
            };
            let figures = paper.map_or([f64::NAN; 2], |figures| figures[kind]);
            let ours = [available.mean(), available.least()];
            let head = [row.name.clone().into(), method.to_string().into()];
            table.push(head.into_iter().chain(ours.into_iter().chain(figures).map(Cell::from)))?;
        }
    }
    Ok(table)
}
