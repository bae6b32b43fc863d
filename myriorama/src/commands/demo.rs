//! `myriorama demo`: one scene in expensive and in plain light, by a whole cluster in this process.

mod args;
mod contact_sheet;
mod first_page;
mod page_layout;
mod shared_light;
mod viewpoint;

use app_core::exit::Outcome;
use app_core::experiment::{Experiment, PAPER_VIEWS};
use app_core::print_line;
use app_core::progress::bar;
use node::Engine as _;
use render::Lighting;
use report::{Bar, Check, Report};

pub use args::DemoArgs;
use shared_light::LightResult;

/// The number of views V of the quick form.
const QUICK_VIEWS: usize = 64;
/// Nodes that share the device.
const NODES: usize = 5;

/// Runs the demo and writes the report.
///
/// # Errors
/// Input cannot be used, or the device or the cluster fails.
pub fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    let setup = args.scene.load()?;
    let page_scene = args.first_page_scene()?;
    let page_setup = if page_scene.scene == args.scene.scene { setup.clone() } else { page_scene.load()? };
    let cover = first_page::write(args, &page_scene, page_setup)?;
    if args.showcase {
        return Ok(Outcome::Done);
    }
    let experiment = Experiment::start(args.scene.clone(), setup, args.device.device, NODES)?;
    let results = measure(args, &experiment)?;
    let mut report = new_report(args, &experiment);
    for result in &results {
        report.parameter(format!("method, {}", result.lighting), args.scene.method_in(result.lighting));
    }
    report.cover = Some(cover);
    shared_light::report(&results, &mut report)?;
    for result in &results {
        let name = format!("{}: samplers K, off the formula's", result.lighting);
        report.checks.push(Check::new(name, result.samplers_off_formula() as f64, "", Bar::Equal(0.0)));
    }
    experiment.stop()?;
    report.tables.iter().for_each(|table| print_line!("\n{}", table.to_text()));
    print_line!("\n{}", report.summary);
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}

/// The results of each light, the most expensive first.
fn measure(args: &DemoArgs, experiment: &Experiment) -> anyhow::Result<Vec<LightResult>> {
    let scene = &args.scene.scene;
    let triangles = experiment.setup.scene.triangle_count();
    print_line!("{scene}: {triangles} triangles on {}", experiment.engine.device_name());
    let lights = [args.expensive_light()?, Lighting::default()];
    let views = if args.quick { QUICK_VIEWS } else { PAPER_VIEWS };
    let progress = bar("light", lights.len());
    let mut results = Vec::with_capacity(lights.len());
    for lighting in lights {
        results.push(LightResult::measure(experiment, lighting, views)?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(results)
}

fn new_report(args: &DemoArgs, experiment: &Experiment) -> Report {
    let mut report = Report::new(format!("Myriorama demo: {}", args.scene.scene), experiment.engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("scene", args.scene.scene.to_string());
    report.parameter("triangles", experiment.setup.scene.triangle_count() as usize);
    report.parameter("sample images S", experiment.setup.samples.len());
    report.parameter("nodes P", NODES);
    report.parameter("sampling", args.scene.sampling().to_string());
    report.parameter("quick", args.quick);
    report
}
