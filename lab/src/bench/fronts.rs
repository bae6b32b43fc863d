//! The fronts of time against error of joint carve and light field search.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::experiment::VIEW_SIZE_PX;
use app_core::progress::bar;
use app_core::setup::SceneArgs;
use depth_image::ViewCell;
use engine::GpuEngine;
use reconstruction::ReconstructionMethod;
use report::{Bar, Check, Report};
use scene::SceneSpec;

use super::args::BenchArgs;
use crate::evaluation::Evaluation;
use crate::models::models_of;
use crate::reference_views::ReferenceViews;
use crate::sweep;

/// The number of models of a folder that are compared, the largest files.
const MODELS: usize = 4;

/// Evaluates all settings on one scene; adds a table, charts and checks.
pub fn compare(name: &str, reference: &ReferenceViews, args: &BenchArgs, report: &mut Report) -> anyhow::Result<()> {
    let progress = bar(format!("error against time, {name}"), sweep::settings(args.quick).len());
    let rows = sweep::sweep(reference, args.quick, args.runs(), |_| progress.inc(1))?;
    progress.finish_and_clear();
    report.tables.push(sweep::table(&format!("Error against time, {name}"), &rows)?);
    report.charts.extend(sweep::charts(name, &rows).into_iter().map(Into::into));
    report.checks.extend(checks(name, &rows, args.scene.method()));
    Ok(())
}

/// Names of the checks of one scene, in the order of [`checks`].
fn check_names(name: &str) -> [String; 3] {
    [
        "wrong hits, the carve's over the fewest of any search",
        "disoccluded coloured wrong, the carve's over the least of any search",
        "settings that beat the default in time and FLIP",
    ]
    .map(|what| format!("{name}: {what}"))
}

fn checks(name: &str, rows: &[Evaluation], default: ReconstructionMethod) -> Vec<Check> {
    let (searches, carves) = sweep::split(rows);
    let least = |rows: &[&Evaluation], value: fn(&Evaluation) -> f64| {
        rows.iter().map(|row| value(row)).fold(f64::NAN, f64::min)
    };
    let exact = |value: fn(&Evaluation) -> f64| {
        carves
            .iter()
            .find(|row| row.method == ReconstructionMethod::JointCarve { stop_level: 0 })
            .map_or(f64::NAN, |row| value(row))
    };
    let [hits, colors, beaten] = check_names(name);
    let disoccluded = exact(|row| row.disoccluded_wrong) / least(&searches, |row| row.disoccluded_wrong);
    let own = rows.iter().find(|row| row.method == default);
    let better = |flip: fn(&Evaluation) -> f64| {
        own.map(|own| rows.iter().filter(|row| row.ms_a_view < own.ms_a_view && flip(row) < flip(own)).count() as f64)
    };
    let foreground = better(|row| row.foreground_flip).unwrap_or(f64::NAN);
    vec![
        Check::new(hits, exact(|row| row.wrong_hits) / least(&searches, |row| row.wrong_hits), "×", Bar::AtMost(1.0)),
        Check::maybe(
            colors,
            Some(disoccluded).filter(|ratio| !ratio.is_nan()),
            "×",
            Bar::AtMost(1.0),
            "no view has disocclusions",
        ),
        Check::maybe(beaten, better(|row| row.flip), "", Bar::Equal(0.0), "the default is not among the settings")
            .with_foreground(foreground),
    ]
}

/// A scene with gaps wide enough to count: in foliage, every pixel that no camera sees is a silhouette's.
const GAPS: &str = "poles";

/// Evaluates a scene with disocclusions.
pub fn gaps(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    sweep_scene(GAPS, fixtures::spec(GAPS)?, args, engine, report)
}

fn sweep_scene(
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

/// Evaluates the models of the folder, if one is given.
pub fn models(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let Some(folder) = &args.models else {
        let bar = Bar::AtMost(1.0);
        report.checks.extend(
            check_names("real models").into_iter().map(|name| Check::not_run(name, "", bar, "--models is not given")),
        );
        return Ok(());
    };
    for path in models_of(folder, if args.quick { 2 } else { MODELS })? {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        sweep_scene(&name, SceneSpec::File(path), args, engine, report)?;
    }
    Ok(())
}
