//! The time and the errors of views by joint carve and by light field search at several settings.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::experiment::VIEW_SIZE_PX;
use app_core::setup::SceneArgs;
use depth_image::ViewCell;
use engine::GpuEngine;
use reconstruction::ReconstructionMethod;
use report::{Axis, Bar, Check, Point, Report, Series, XyChart};
use scene::SceneSpec;

use super::args::BenchArgs;
use crate::evaluation::Evaluation;
use crate::models::models_of;
use crate::pareto::{Better, with_front};
use crate::reference_views::ReferenceViews;
use crate::study::{Column, check_if_measured, measure_rows, table};

/// A scene with gaps wide enough to count: in foliage, every pixel that no camera sees is a silhouette's.
const GAPS: &str = "poles";
/// The number of models of a folder that are compared, the largest files.
const MODELS: usize = 4;
/// Steps of light field search, as in the paper's Fig. 7 and beyond.
const STEPS: [u32; 6] = [8, 16, 32, 64, 128, 256];
/// Levels at which joint carve stops.
const STOP_LEVELS: [u32; 4] = [0, 1, 2, 3];

const COLUMNS: [Column<Evaluation>; 15] = [
    Column::new("method", |row| row.method.to_string().into()),
    Column::with_unit("time a view", "ms", |row| row.ms_a_view.into()),
    Column::with_unit("foreground PSNR", "dB", |row| row.foreground.psnr_db.into()),
    Column::with_unit("foreground PSNR of the worst view", "dB", |row| row.foreground_psnr_min_db.into()),
    Column::new("foreground SSIM", |row| row.foreground.ssim.into()),
    Column::new("foreground FLIP", |row| row.foreground.flip.into()),
    Column::with_unit("PSNR", "dB", |row| row.whole.psnr_db.into()),
    Column::with_unit("PSNR of the worst view", "dB", |row| row.psnr_min_db.into()),
    Column::new("SSIM", |row| row.whole.ssim.into()),
    Column::new("FLIP", |row| row.whole.flip.into()),
    Column::with_unit("wrong hits", "%", |row| (row.wrong_hits * 100.0).into()),
    Column::with_unit("unknown", "%", |row| (row.unknown * 100.0).into()),
    Column::with_unit("disoccluded coloured wrong", "%", |row| (row.disoccluded_wrong * 100.0).into()),
    Column::with_unit("of these not marked", "%", |row| (row.disoccluded_unmarked * 100.0).into()),
    Column::with_unit("disoccluded", "%", |row| (row.disoccluded * 100.0).into()),
];

/// The settings that are compared. A quick run skips every other one.
fn settings(quick: bool) -> Vec<ReconstructionMethod> {
    let step = if quick { 2 } else { 1 };
    let searches = STEPS.iter().step_by(step).map(|&steps| ReconstructionMethod::LightFieldSearch { steps });
    let carves = STOP_LEVELS.iter().step_by(step).map(|&stop_level| ReconstructionMethod::JointCarve { stop_level });
    searches.chain(carves).collect()
}

/// Evaluates all settings on one scene; adds a table, a chart and checks.
pub fn compare(name: &str, reference: &ReferenceViews, args: &BenchArgs, report: &mut Report) -> anyhow::Result<()> {
    let rows = measure_rows(&format!("error against time, {name}"), settings(args.run.quick), |method| {
        reference.evaluate(method, args.runs())
    })?;
    report.tables.push(table(format!("Error against time, {name}"), &COLUMNS, &rows)?);
    report.charts.push(chart(name, &rows));
    report.checks.extend(checks(name, &rows, args.scene.method()));
    Ok(())
}

/// Evaluates a scene with disocclusions.
pub fn gaps(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    compare_scene(GAPS, fixtures::spec(GAPS)?, args, engine, report)
}

/// Evaluates the models of the folder, if one is given.
pub fn models(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let Some(folder) = &args.models else { return Ok(()) };
    for path in models_of(folder, if args.run.quick { 2 } else { MODELS })? {
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

fn chart(name: &str, rows: &[Evaluation]) -> XyChart {
    let searches = rows.iter().filter_map(|row| match row.method {
        ReconstructionMethod::LightFieldSearch { steps } => Some(setting_point(row, steps)),
        _ => None,
    });
    let carves = rows.iter().filter_map(|row| match row.method {
        ReconstructionMethod::JointCarve { stop_level } => Some(setting_point(row, stop_level)),
        _ => None,
    });
    let x = Axis::log("time a view", "ms");
    let y = Axis::linear("foreground FLIP", "");
    let chart = XyChart::new(format!("Foreground FLIP against time, {name}"), x, y)
        .with(Series::line("light_field_search", searches))
        .with(Series::line("joint_carve", carves));
    with_front(chart, [Better::Low, Better::Low])
}

fn setting_point(row: &Evaluation, setting: u32) -> Point {
    Point::labelled(row.ms_a_view, row.foreground.flip, setting.to_string())
}

/// A value of joint carve over the least of any search.
fn over_the_least(rows: &[Evaluation], value: fn(&Evaluation) -> f64) -> f64 {
    let carve = rows.iter().find(|row| row.method == ReconstructionMethod::JointCarve { stop_level: 0 });
    let searches = rows.iter().filter(|row| matches!(row.method, ReconstructionMethod::LightFieldSearch { .. }));
    carve.map_or(f64::NAN, value) / searches.map(value).fold(f64::NAN, f64::min)
}

/// Joint carve beside the best search, and the default method beside all. Disoccluded pixels count where a view has some.
fn checks(name: &str, rows: &[Evaluation], default: ReconstructionMethod) -> [Check; 3] {
    let wrong_hits = over_the_least(rows, |row| row.wrong_hits);
    let disoccluded = Some(over_the_least(rows, |row| row.disoccluded_wrong)).filter(|ratio| !ratio.is_nan());
    let own = rows.iter().find(|row| row.method == default);
    let better = own.map(|own| {
        rows.iter().filter(|row| row.ms_a_view < own.ms_a_view && row.whole.flip < own.whole.flip).count() as f64
    });
    [
        Check::new(
            format!("{name}: wrong hits, the carve's over the fewest of any search"),
            wrong_hits,
            "×",
            Bar::AtMost(1.0),
        ),
        check_if_measured(
            format!("{name}: disoccluded coloured wrong, the carve's over the least of any search"),
            disoccluded,
            "×",
            Bar::AtMost(1.0),
            "no view has disocclusions",
        ),
        check_if_measured(
            format!("{name}: settings that beat the default in time and FLIP"),
            better,
            "",
            Bar::Equal(0.0),
            "the default is not among the settings",
        ),
    ]
}
