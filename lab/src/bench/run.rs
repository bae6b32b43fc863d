//! The order of the bench.

use app_core::exit::Outcome;
use app_core::experiment::Experiment;
use node::Engine as _;
use report::{Bar, Report};

use super::args::{BenchArgs, Part};
use super::{errors, light, loaded, throughput};
use crate::memory::peak_memory_mb;
use crate::reference_views::ReferenceViews;
use crate::study::{check_if_measured, new_report};
use crate::{load, scaling, sharing, viewer};

/// Measures everything, or one part, and writes the report.
///
/// # Errors
/// Input that cannot be used, or a failure of the device or the cluster.
pub fn run(args: &BenchArgs) -> anyhow::Result<Outcome> {
    match &args.part {
        Some(Part::Load(args)) => return load::command::run(args),
        Some(Part::Scaling(args)) => return scaling::command::run(args),
        Some(Part::Sharing(args)) => return sharing::command::run(args),
        Some(Part::Viewer(args)) => return viewer::command::run(args),
        None if args.loading => return loading(args),
        None => (),
    }
    let experiment =
        Experiment::start(args.scene.clone(), args.scene.load()?, args.run.device.device, usize::from(args.nodes))?;
    let mut report = bench_report(args, &experiment.engine.device_name());
    println!("{} on {}", args.scene.scene, experiment.engine.device_name());
    throughput::delivered(args, &experiment, &mut report)?;
    let views = experiment.views(args.compared_views())?;
    let reference = ReferenceViews::draw(&experiment.engine, &experiment.setup, &experiment.args, views)?;
    throughput::nanoseconds(args, &reference, &experiment, &mut report)?;
    errors::compare(&args.scene.scene.to_string(), &reference, args, &mut report)?;
    drop(reference);
    light::measure(args, &experiment, &mut report)?;
    let engine = experiment.engine.clone();
    experiment.stop()?;
    errors::gaps(args, &engine, &mut report)?;
    loaded::measure(args, &engine, &mut report)?;
    errors::models(args, &engine, &mut report)?;
    let memory = peak_memory_mb().filter(|_| engine.is_software());
    report.checks.push(check_if_measured(
        "peak memory on the software device",
        memory,
        "MB",
        Bar::AtMost(1500.0),
        "the device has memory of its own",
    ));
    print_and_write(args, &report)
}

/// Only loads the model files.
fn loading(args: &BenchArgs) -> anyhow::Result<Outcome> {
    let engine = args.run.engine()?;
    let mut report = bench_report(args, &engine.device_name());
    loaded::measure(args, &engine, &mut report)?;
    print_and_write(args, &report)
}

fn print_and_write(args: &BenchArgs, report: &Report) -> anyhow::Result<Outcome> {
    report.tables.iter().for_each(|table| println!("\n{}", table.to_text()));
    println!();
    args.run.write("out/bench", report)
}

fn bench_report(args: &BenchArgs, device: &str) -> Report {
    let mut report = new_report("Myriorama bench", device);
    report.parameter("scene", args.scene.scene.to_string());
    report.parameter("method", args.scene.method().to_string());
    report.parameter("nodes P", u32::from(args.nodes));
    report.parameter("repeats", args.runs());
    report.parameter("quick", args.run.quick);
    report
}
