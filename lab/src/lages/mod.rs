//! `myriorama-lab study lages`: the experiment of Lages et al., with their Figures 5, 6 and 11.

mod bunny;
mod charts;
mod read_back;
mod stages;
mod timing;

use std::path::PathBuf;

use app_core::exit::Outcome;
use app_core::experiment::Experiment;
use app_core::setup::SceneArgs;
use clap::Args;
use report::{Bar, Check, Report};

use crate::delivery::visibility;
use crate::study::RunArgs;
use read_back::ReadBack;
use timing::Times;

/// The number of nodes P of the paper.
const NODES: usize = 5;

/// Delivers 1 to 1000 views of 200×150 from S samples of 400×300 by five nodes in one process, and as many drawn directly. Then
/// compares views of the Stanford bunny from 2, 4 and 8 samples with direct drawing.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama-lab study lages --lighting \"soft 16, occlusion 16\"")]
pub struct LagesArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    study: RunArgs,
    /// A folder that has stanford-bunny or whose subfolders have it, for Figure 11
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
}

/// Measures deliveries and writes the report.
///
/// # Errors
/// Input cannot be used, or the device or the cluster fails.
pub fn run(args: &LagesArgs) -> anyhow::Result<Outcome> {
    let device = args.study.device.device;
    let experiment = Experiment::start(args.scene.clone(), args.scene.load()?, device, NODES)?;
    let times = timing::measure(&experiment, args.study.quick)?;
    let mut report = report(args, &experiment, &times)?;
    report.parameter("direct finds surfaces by", visibility(&experiment)?.to_string());
    bunny::figure_11(&experiment.engine, args.models.as_deref(), &mut report)?;
    experiment.stop()?;
    println!("{}", report.summary);
    args.study.finish("out/study/lages", &report)
}

fn report(args: &LagesArgs, experiment: &Experiment, times: &Times) -> anyhow::Result<Report> {
    let mut report = args.study.report(&format!("Lages, {}", args.scene.scene), &experiment.engine);
    report.parameter("scene", args.scene.scene.to_string());
    report.parameter("triangles", experiment.setup.scene.triangle_count() as usize);
    report.parameter("sample images S", experiment.setup.samples.len());
    report.parameter("nodes P", NODES);
    report.parameter("lighting", args.scene.lighting.to_string());
    report.parameter("method", args.scene.method().to_string());
    timing::tables(times, &mut report)?;
    report.tables.push(stages::stages(times, ReadBack::measure(experiment)?)?);
    report.charts.push(charts::total_time(times));
    report.summary = timing::summary(times);
    report.checks.push(Check::new("chosen K off the formula's", times.headline_k_off_formula(), "", Bar::Equal(0.0)));
    Ok(report)
}
