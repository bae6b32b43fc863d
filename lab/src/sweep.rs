//! Time against error: settings of light field search and joint carve on one scene.

use reconstruction::ReconstructionMethod;
use report::{Axis, Better, Cell, Point, ReportError, Series, Table, XyChart};

use crate::evaluation::Evaluation;
use crate::reference_views::ReferenceViews;

/// Steps of light field search, as in the paper's Fig. 7 and beyond.
const STEPS: [u32; 6] = [8, 16, 32, 64, 128, 256];
/// Levels at which joint carve stops.
const STOP_LEVELS: [u32; 4] = [0, 1, 2, 3];

/// The settings that are compared.
#[must_use]
pub fn settings(quick: bool) -> Vec<ReconstructionMethod> {
    // A quick run skips every other setting.
    let step = if quick { 2 } else { 1 };
    let searches = STEPS.iter().step_by(step).map(|&steps| ReconstructionMethod::LightFieldSearch { steps });
    let carves = STOP_LEVELS.iter().step_by(step).map(|&stop_level| ReconstructionMethod::JointCarve { stop_level });
    searches.chain(carves).collect()
}

/// Evaluates all settings, and calls `done` for each.
pub fn sweep(
    reference: &ReferenceViews,
    quick: bool,
    runs: usize,
    mut done: impl FnMut(&Evaluation),
) -> anyhow::Result<Vec<Evaluation>> {
    let row = |method| reference.evaluate(method, runs).inspect(|row| done(row));
    settings(quick).into_iter().map(row).collect()
}

/// A table of evaluations.
pub fn table(name: &str, rows: &[Evaluation]) -> Result<Table, ReportError> {
    let columns = [
        ("method", ""),
        ("time a view", "ms"),
        ("foreground PSNR", "dB"),
        ("foreground PSNR of the worst view", "dB"),
        ("foreground SSIM", ""),
        ("foreground FLIP", ""),
        ("PSNR", "dB"),
        ("PSNR of the worst view", "dB"),
        ("SSIM", ""),
        ("FLIP", ""),
        ("wrong hits", "%"),
        ("unknown", "%"),
        ("disoccluded coloured wrong", "%"),
        ("of these not marked", "%"),
        ("disoccluded", "%"),
    ];
    let mut table = Table::new(name, &columns);
    for row in rows {
        let shares = [row.wrong_hits, row.unknown, row.disoccluded_wrong, row.disoccluded_unmarked, row.disoccluded]
            .map(|share| share * 100.0);
        let foreground = [row.foreground_psnr_db, row.foreground_psnr_min_db, row.foreground_ssim, row.foreground_flip];
        let whole = [row.psnr_db, row.psnr_min_db, row.ssim, row.flip];
        let numbers = [&[row.ms_a_view], &foreground[..], &whole, &shares].concat();
        table.push([Cell::from(row.method.to_string())].into_iter().chain(numbers.into_iter().map(Cell::from)))?;
    }
    Ok(table)
}

/// Charts of time against FLIP, PSNR and wrong hits, each with its Pareto front.
#[must_use]
pub fn charts(name: &str, rows: &[Evaluation]) -> Vec<XyChart> {
    let chart = |what: &str, unit: &str, better, value: fn(&Evaluation) -> f64| {
        let time = Axis::log("time a view", "ms");
        series(rows, value)
            .into_iter()
            .fold(XyChart::new(format!("{what} against time, {name}"), time, Axis::linear(what, unit)), XyChart::with)
            .with_front(Better::Low, better)
    };
    vec![
        chart("Foreground FLIP", "", Better::Low, |row| row.foreground_flip),
        chart("Foreground PSNR", "dB", Better::High, |row| row.foreground_psnr_db),
        chart("Wrong hits", "%", Better::Low, |row| row.wrong_hits * 100.0),
    ]
}

fn series(rows: &[Evaluation], value: fn(&Evaluation) -> f64) -> [Series; 2] {
    let points = |label: fn(ReconstructionMethod) -> Option<String>| {
        rows.iter()
            .filter_map(move |row| Some(Point::labelled(row.ms_a_view, value(row), label(row.method)?)))
            .collect::<Vec<_>>()
    };
    [
        Series::line("light_field_search", points(|method| steps(method).map(|steps| steps.to_string()))),
        Series::line("joint_carve", points(|method| stop_level(method).map(|level| format!("level {level}")))),
    ]
}

fn steps(method: ReconstructionMethod) -> Option<u32> {
    if let ReconstructionMethod::LightFieldSearch { steps } = method { Some(steps) } else { None }
}

fn stop_level(method: ReconstructionMethod) -> Option<u32> {
    if let ReconstructionMethod::JointCarve { stop_level } = method { Some(stop_level) } else { None }
}

/// Evaluations of light field search, and of joint carve.
#[must_use]
pub fn split(rows: &[Evaluation]) -> (Vec<&Evaluation>, Vec<&Evaluation>) {
    rows.iter().partition(|row| steps(row.method).is_some())
}
