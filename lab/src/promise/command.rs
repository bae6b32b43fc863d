//! The command, its parts and its report.

use std::path::PathBuf;

use app_core::exit::Outcome;
use app_core::process::runtime;
use clap::{Args, ValueEnum};
use scene::SceneSpec;

use super::{broken, price, walk};
use crate::section::{finish, measure_parts, report};

/// Measures what audits and planning cost a live viewer of 200×150, whose views are made by the policy `pipeline`, and how
/// soon a promise is broken and replaced that wrong measurements, or a viewer outside its view cell, have made untrue.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama-lab bench promise --quick --strict")]
pub struct PromiseArgs {
    /// Scenes of the part `price`
    #[arg(long, value_name = "SPEC", default_values = ["tree-terrain-500k", "courtyard"])]
    scene: Vec<SceneSpec>,
    /// Measures only this part of the report; may be repeated
    #[arg(long, value_name = "PART")]
    only: Vec<Part>,
    /// One alternation in place of five
    #[arg(long)]
    quick: bool,
    /// Where the report goes
    #[arg(long, default_value = "out/bench-promise", value_name = "DIR")]
    out: PathBuf,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

/// A part of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// A viewer with audits and without, while a plan is made and without a budget
    Price,
    /// A promise of measurements that are a third of the true ones
    Broken,
    /// A viewer that walks out of its view cell, and one that has view cells where it walks
    Walk,
}

/// Measures the parts and writes the report.
///
/// # Errors
/// The report cannot be written.
pub fn run(args: &PromiseArgs) -> anyhow::Result<Outcome> {
    let alternations = if args.quick { 1 } else { 5 };
    let measure = async |part: &Part| match part {
        Part::Price => price::measure(&args.scene, alternations).await,
        Part::Broken => broken::measure().await,
        Part::Walk => walk::measure().await,
    };
    let sections = runtime()?.block_on(measure_parts(&args.only, measure));
    let mut report = report("Myriorama bench promise", &sections);
    report.parameter("alternations", alternations);
    finish(report, sections, &args.out, args.strict)
}
