//! The order of the demo.

use std::time::Instant;

use anyhow::Context as _;
use app_core::camera_file::{self, Placement};
use app_core::exit::Outcome;
use depth_image::PinholeCamera;
use engine::GpuEngine;
use node::Engine as _;
use scene::Limits;
use study::{Bar, Check, Picture, Report};

use super::args::{COMPARED_VIEWS, DemoArgs};
use super::{beside, charts, light, showcase, timing};
use crate::experiment::Experiment;
use crate::lighting_study;
use crate::memory::peak_memory_mb;
use crate::progress::bar;
use crate::reference_views::ReferenceViews;
use crate::sweep;

/// The longest that the whole demo may take.
const TIME_LIMIT_S: f64 = 180.0;

/// Runs the demo and writes the report.
///
/// # Errors
/// Input that cannot be used, or a failure of the device or the cluster.
pub fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let cover = first_page(args)?;
    if args.showcase {
        return Ok(Outcome::Done);
    }
    let given = given_views(args)?;
    let experiment = Experiment::start(args.scene.clone(), given, args.device.device, usize::from(args.nodes))?;
    println!(
        "{}: {} triangles on {}",
        args.scene.scene,
        experiment.setup.scene.triangle_count(),
        experiment.engine.device_name()
    );
    let mut report = new_report(args, &experiment);
    report.cover = Some(cover);
    // What sharing gains where light is expensive comes first; plain light is beside it.
    let light = light::show(args, &experiment, &mut report)?;
    let times = timing::measure(&experiment, args.quick)?;
    timing::tables(&times, &mut report)?;
    report.charts.extend([charts::total_time(&times).into(), charts::stages(&times).into()]);
    compare(args, &experiment, &mut report)?;
    beside::conventional(&experiment, &mut report)?;
    let choice = experiment.visibility()?;
    report.parameter("direct finds surfaces by", choice.to_string());
    report.summary = format!("{} In plain light: {}", lighting_study::summary(&light), timing::summary(&times));
    report.checks = checks(&times, start, args);
    report.checks.extend(lighting_study::checks(&light));
    experiment.stop()?;
    report.tables.iter().for_each(|table| println!("\n{}", table.to_text()));
    println!("\n{}", report.summary);
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}

/// The first page, on a device of its own: its views are far larger than the others, and so are their buffers.
fn first_page(args: &DemoArgs) -> anyhow::Result<Picture> {
    let setup = args.scene.load()?;
    let engine = GpuEngine::shared(args.device.device)?;
    showcase::write(&engine, setup, &args.scene, &args.out)
}

fn given_views(args: &DemoArgs) -> anyhow::Result<Vec<PinholeCamera>> {
    let Some(path) = &args.cameras else { return Ok(Vec::new()) };
    let scene =
        args.scene.scene.load(&Limits::default(), args.scene.missing_textures).context("the scene cannot be used")?;
    let near_m = scene.bounds().near_m();
    Ok(camera_file::read(path, Placement { origin_in_source: scene.origin_in_source, near_m })?)
}

fn new_report(args: &DemoArgs, experiment: &Experiment) -> Report {
    let mut report = Report::new(format!("Myriorama demo: {}", args.scene.scene), experiment.engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("scene", args.scene.scene.to_string());
    report.parameter("triangles", experiment.setup.scene.triangle_count() as usize);
    report.parameter("sample images S", experiment.setup.samples.len());
    report
        .parameter("sample size", experiment.setup.samples.first().map(|c| format!("{}x{}", c.size_px.x, c.size_px.y)));
    report.parameter("nodes P", u32::from(args.nodes));
    report.parameter("lighting", args.scene.lighting.to_string());
    report.parameter("method", args.scene.method().to_string());
    report.parameter("quick", args.quick);
    report
}

/// Adds errors against time.
fn compare(args: &DemoArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let count = COMPARED_VIEWS;
    let reference =
        ReferenceViews::draw(&experiment.engine, &experiment.setup, &experiment.args, experiment.views(count)?)?;
    let progress = bar("error against time", sweep::settings(args.quick).len());
    let rows = sweep::sweep(&reference, args.quick, 1, |_| progress.inc(1))?;
    progress.finish_and_clear();
    report.tables.push(sweep::table("Error against time", &rows)?);
    let name = args.scene.scene.to_string();
    report.charts.extend(sweep::charts(&name, &rows).into_iter().map(Into::into));
    Ok(())
}

/// Lages et al.: a highly tessellated tree over a terrain, about 500,000 triangles.
const PAPER_SCENE: &str = "tree-terrain-500k";

fn checks(times: &timing::Times, start: Instant, args: &DemoArgs) -> Vec<Check> {
    let speed = format!("{} views delivered: pipeline over direct, throughput", times.headline_views);
    // The gain of sharing grows with the scene; other models have a figure, not a bar.
    let promised = !args.quick && args.scene.scene.to_string() == PAPER_SCENE;
    let k_off = times.headline_k_off_formula();
    let memory = peak_memory_mb().filter(|_| times.is_software);
    vec![
        Check::maybe(
            speed,
            promised.then(|| times.headline_ratio()),
            "×",
            Bar::AtLeast(6.0),
            "it is promised of all views of the paper's scene",
        ),
        Check::new("chosen K off the formula's", k_off, "", Bar::Equal(0.0)),
        Check::new("time of the whole demo", start.elapsed().as_secs_f64(), "s", Bar::AtMost(TIME_LIMIT_S)),
        Check::maybe(
            "peak memory on the software device",
            memory,
            "MB",
            Bar::AtMost(1500.0),
            "the device has memory of its own",
        ),
    ]
}
