//! `myriorama bench`: what is promised, as ratios of one run.

mod adaptive;
mod animation;
mod codec;
mod convergence;
mod fronts;
mod light;
mod peer;
mod rays;
mod sampling;
mod throughput;
mod timing;

use std::path::PathBuf;

use app_core::exit::Outcome;
use app_core::setup::{DeviceArgs, SceneArgs};
use clap::{Args, Subcommand};
use node::Engine as _;
use study::{Bar, Check, Report};

use crate::evaluate::Truth;
use crate::experiment::Experiment;
use crate::load::command::LoadArgs;
use crate::memory::peak_memory_mb;
use crate::scaling::command::ScalingArgs;
use crate::{load, scaling};

/// Every bullet is a check: a value, a bar, holds or falls short. Checks whose input was not given are not run
/// and do not fall short.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Example: myriorama bench --models models/ --peer peer-bench/ --strict"
)]
pub struct BenchArgs {
    #[command(subcommand)]
    part: Option<Part>,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// A folder of models (.gltf, .glb, .obj, .ply): the methods are compared on the largest of them, too
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// A folder with bench.ply, samples.json and views.json: the truth is compared with another synthesiser's
    #[arg(long, value_name = "DIR")]
    peer: Option<PathBuf>,
    /// P: nodes that share the device
    #[arg(long, default_value_t = 5, value_name = "P", value_parser = clap::value_parser!(u16).range(1..=256))]
    nodes: u16,
    /// Where the report goes
    #[arg(long, default_value = "out/bench", value_name = "DIR")]
    out: PathBuf,
    /// A smaller form of the same run: fewer repeats, views and models
    #[arg(long)]
    quick: bool,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

/// What is measured by itself.
#[derive(Debug, Subcommand)]
enum Part {
    /// How many clients a cluster of processes serves, and what becomes of those that are too many
    Load(LoadArgs),
    /// How the cluster scales with nodes and views, on processes of equal CPU share and in simulation
    Scaling(ScalingArgs),
}

impl BenchArgs {
    /// Times that a measurement is repeated; the median counts.
    fn runs(&self) -> usize {
        if self.quick { 1 } else { 3 }
    }

    /// Views that are compared pixel by pixel.
    fn compared_views(&self) -> usize {
        if self.quick { 4 } else { 8 }
    }
}

/// Measures all of it.
///
/// # Errors
/// Input that cannot be used, or a failure of the device or the cluster.
pub fn run(args: &BenchArgs) -> anyhow::Result<Outcome> {
    match &args.part {
        Some(Part::Load(args)) => return load::command::run(args),
        Some(Part::Scaling(args)) => return scaling::command::run(args),
        None => (),
    }
    let experiment = Experiment::start(args.scene.clone(), Vec::new(), args.device.device, usize::from(args.nodes))?;
    let mut report = new_report(args, &experiment);
    println!("{} on {}", args.scene.scene, experiment.engine.device_name());
    throughput::delivered(args, &experiment, &mut report)?;
    let views = experiment.views(args.compared_views())?;
    let truth = Truth::take(&experiment.engine, &experiment.setup, &experiment.args, views)?;
    throughput::nanoseconds(args, &truth, &experiment, &mut report)?;
    codec::measure(&truth.images, &mut report)?;
    fronts::compare(&args.scene.scene.to_string(), &truth, args, &mut report)?;
    drop(truth);
    light::qualities(args, &experiment, &mut report)?;
    light::truth(args, &experiment, &mut report)?;
    let engine = experiment.engine.clone();
    rays::measure(args, &engine, &experiment.setup, &mut report)?;
    convergence::measure(args, &engine, &experiment.setup, &mut report)?;
    adaptive::compare(args, &engine, &experiment.setup, &mut report)?;
    experiment.stop()?;
    animation::measure(args, &engine, &mut report)?;
    light::glossy(args, &engine, &mut report)?;
    sampling::measure(args, &engine, &mut report)?;
    fronts::gaps(args, &engine, &mut report)?;
    fronts::models(args, &engine, &mut report)?;
    peer::measure(args, &engine, &mut report)?;
    let memory = peak_memory_mb().filter(|_| engine.is_software());
    report.checks.push(Check::maybe(
        "peak memory on the software device",
        memory,
        "MB",
        Bar::AtMost(1500.0),
        "the device has memory of its own",
    ));
    report.tables.iter().for_each(|table| println!("\n{}", table.to_text()));
    println!();
    let ok = report.finish(&args.out)?;
    Ok(if args.strict && !ok { Outcome::FellShort } else { Outcome::Done })
}

fn new_report(args: &BenchArgs, experiment: &Experiment) -> Report {
    let mut report = Report::new("Myriorama bench", experiment.engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("scene", args.scene.scene.to_string());
    report.parameter("method", args.scene.method.to_string());
    report.parameter("nodes P", u32::from(args.nodes));
    report.parameter("repeats", args.runs());
    report.parameter("quick", args.quick);
    report
}
