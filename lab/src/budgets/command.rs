//! The command.

use anyhow::Context as _;
use app_core::exit::Outcome;
use app_core::progress::bar;
use clap::Args;
use glam::UVec2;

use super::defaults::defaults;
use super::held_out::held_out;
use super::report::{add_defaults, add_plans, add_scene};
use super::table::{Stage, Subject};
use crate::study::{RunArgs, is_named};

const LIGHTING: &str = "soft 16, occlusion 16";
const SCENES: [&str; 4] = ["urban", "courtyard", "tree-terrain-125k", "bird-nest"];
const VIEW_PX: UVec2 = UVec2::new(1280, 720);
const PLANS_A_SCENE: u64 = 5;
const QUICK_VIEW_PX: UVec2 = UVec2::new(640, 360);
const QUICK_PLANS: u64 = 2;

/// Compares plans for budgets with tables of all rows, on views that no plan sees.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study planner --seed 7 --strict   20 plans over four scenes
  myriorama-lab study planner --quick --scene urban")]
pub struct PlannerArgs {
    #[command(flatten)]
    study: RunArgs,
    /// Chooses budgets, numbers of views, and the views that plans are tested on
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// Only scenes whose names contain this text
    #[arg(long = "scene", value_name = "TEXT")]
    scenes: Vec<String>,
}

/// Measures all scenes and writes the report.
///
/// # Errors
/// A scene cannot be used, the device fails, or the folder cannot be written.
pub fn run(args: &PlannerArgs) -> anyhow::Result<Outcome> {
    let engine = args.study.engine()?;
    let mut report = args.study.report("planner", &engine);
    let size_px = if args.study.quick { QUICK_VIEW_PX } else { VIEW_PX };
    let count = if args.study.quick { QUICK_PLANS } else { PLANS_A_SCENE };
    report.parameter("seed", args.seed as usize);
    report.parameter("lighting", LIGHTING);
    report.parameter("views", size_px.to_string());
    let mut plans = Vec::new();
    let mut default_rows = Vec::new();
    for scene in SCENES.into_iter().filter(|scene| is_named(scene, &args.scenes)) {
        let stage = Stage::new(&engine, Subject { scene, lighting: LIGHTING.parse()?, size_px })?;
        let progress = bar(format!("rows, {scene}"), Stage::steps(planner::MAX_ROWS));
        let table = stage.table(|| progress.inc(1)).with_context(|| format!("scene {scene:?}"))?;
        progress.finish_and_clear();
        add_scene(&mut report, scene, &table)?;
        plans.extend(held_out(&stage, &table, args.seed, count)?);
        let experiment = stage.experiment(args.study.device.device)?;
        default_rows.extend(defaults(&experiment, scene, stage.typical_view()?, &table)?);
        experiment.stop()?;
    }
    add_plans(&mut report, &plans)?;
    add_defaults(&mut report, &default_rows)?;
    args.study.finish("out/study/planner", &report)
}
