//! The time and the errors of views by joint carve and by light field search at several settings.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::experiment::VIEW_SIZE_PX;
use app_core::progress::bar;
use app_core::setup::SceneArgs;
use depth_image::ViewCell;
use engine::GpuEngine;
use reconstruction::ReconstructionMethod;
use report::{Axis, Bar, Better, Cell, Check, Point, Report, ReportError, Series, Table, XyChart};
use scene::SceneSpec;

use super::args::BenchArgs;
use crate::evaluation::Evaluation;
use crate::models::models_of;
use crate::reference_views::ReferenceViews;

/// A scene with gaps wide enough to count: in foliage, every pixel that no camera sees is a silhouette's.
const GAPS: &str = "poles";
/// The number of models of a folder that are compared, the largest files.
const MODELS: usize = 4;
/// Steps of light field search, as in the paper's Fig. 7 and beyond.
const STEPS: [u32; 6] = [8, 16, 32, 64, 128, 256];
/// Levels at which joint carve stops.
const STOP_LEVELS: [u32; 4] = [0, 1, 2, 3];

/// The settings that are compared. A quick run skips every other one.
fn settings(quick: bool) -> Vec<ReconstructionMethod> {
    let step = if quick { 2 } else { 1 };
    let searches = STEPS.iter().step_by(step).map(|&steps| ReconstructionMethod::LightFieldSearch { steps });
    let carves = STOP_LEVELS.iter().step_by(step).map(|&stop_level| ReconstructionMethod::JointCarve { stop_level });
    searches.chain(carves).collect()
}

/// Evaluates all settings on one scene; adds a table, a chart and checks.
pub fn compare(name: &str, reference: &ReferenceViews, args: &BenchArgs, report: &mut Report) -> anyhow::Result<()> {
    let settings = settings(args.quick);
    let progress = bar(format!("error against time, {name}"), settings.len());
    let mut rows = Vec::with_capacity(settings.len());
    for method in settings {
        rows.push(reference.evaluate(method, args.runs())?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    report.tables.push(table(name, &rows)?);
    report.charts.push(chart(name, &rows).into());
    report.checks.extend(checks(name, &rows, args.scene.method()));
    Ok(())
}

/// Evaluates a scene with disocclusions.
pub fn gaps(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    compare_scene(GAPS, GAPS.parse()?, args, engine, report)
}

/// Evaluates the models of the folder, if one is given.
pub fn models(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let Some(folder) = &args.models else { return Ok(()) };
    for path in models_of(folder, if args.quick { 2 } else { MODELS })? {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        compare_scene(&name, SceneSpec::File(path), args, engine, report)?;
    }
    Ok(())
}

fn compare_scene(
    name: &str,
    spec: SceneSpec,
    args: &BenchArgs,
    engine: &Arc<GpuEngine>,
    report: &mut Report,
) -> anyhow::Result<()> {
    let scene = SceneArgs { lighting: args.scene.lighting, ..SceneArgs::new(spec) };
    let setup = scene.load()?;
    let cell = ViewCell::between(&setup.around).context("no sample cameras")?;
    let reference = ReferenceViews::draw(engine, &setup, &scene, cell.spread(args.compared_views(), VIEW_SIZE_PX))?;
    compare(name, &reference, args, report)
}

fn table(name: &str, rows: &[Evaluation]) -> Result<Table, ReportError> {
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
    let mut table = Table::new(format!("Error against time, {name}"), &columns);
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

fn chart(name: &str, rows: &[Evaluation]) -> XyChart {
    let point =
        |row: &Evaluation, setting: u32| Point::labelled(row.ms_a_view, row.foreground_flip, setting.to_string());
    let searches = rows.iter().filter_map(|row| match row.method {
        ReconstructionMethod::LightFieldSearch { steps } => Some(point(row, steps)),
        _ => None,
    });
    let carves = rows.iter().filter_map(|row| match row.method {
        ReconstructionMethod::JointCarve { stop_level } => Some(point(row, stop_level)),
        _ => None,
    });
    let x = Axis::log("time a view", "ms");
    let y = Axis::linear("foreground FLIP", "");
    XyChart::new(format!("Foreground FLIP against time, {name}"), x, y)
        .with(Series::line("light_field_search", searches))
        .with(Series::line("joint_carve", carves))
        .with_front(Better::Low, Better::Low)
}

/// Joint carve beside the best search, and the default method beside all. Disoccluded pixels count where a view has some.
fn checks(name: &str, rows: &[Evaluation], default: ReconstructionMethod) -> [Check; 3] {
    let carve = rows.iter().find(|row| row.method == ReconstructionMethod::JointCarve { stop_level: 0 });
    let searches = rows.iter().filter(|row| matches!(row.method, ReconstructionMethod::LightFieldSearch { .. }));
    let over_the_least = |value: fn(&Evaluation) -> f64| {
        carve.map_or(f64::NAN, value) / searches.clone().map(value).fold(f64::NAN, f64::min)
    };
    let wrong_hits = over_the_least(|row| row.wrong_hits);
    let disoccluded = Some(over_the_least(|row| row.disoccluded_wrong)).filter(|ratio| !ratio.is_nan());
    let beats = |row: &&Evaluation, own: &Evaluation| row.ms_a_view < own.ms_a_view && row.flip < own.flip;
    let own = rows.iter().find(|row| row.method == default);
    let better = own.map(|own| rows.iter().filter(|row| beats(row, own)).count() as f64);
    let named = |what: &str| format!("{name}: {what}");
    [
        Check::new(named("wrong hits, the carve's over the fewest of any search"), wrong_hits, "×", Bar::AtMost(1.0)),
        Check::maybe(
            named("disoccluded coloured wrong, the carve's over the least of any search"),
            disoccluded,
            "×",
            Bar::AtMost(1.0),
            "no view has disocclusions",
        ),
        Check::maybe(
            named("settings that beat the default in time and FLIP"),
            better,
            "",
            Bar::Equal(0.0),
            "the default is not among the settings",
        ),
    ]
}
