//! Views a second at the client, and nanoseconds a pixel on the device.

use anyhow::Context as _;
use app_core::experiment::{Experiment, PAPER_VIEWS};
use app_core::progress::bar;
use cluster::PolicyChoice;
use depth_image::{PinholeCamera, ViewPlanes};
use node::{Engine as _, Turn, WorkClass};
use report::{Report, Table};

use super::args::BenchArgs;
use crate::delivery::{DeliverySettings, deliver};
use crate::reference_views::{ReferenceViews, direct_work};
use crate::statistics::{median, median_seconds};

/// The number of views that direct rendering is timed on.
const DIRECT_VIEWS: usize = 48;

/// The pipeline's throughput over direct rendering's, delivered to a client. Runs take turns, so that neither has the
/// quieter machine.
pub fn delivered(args: &BenchArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let progress = bar(format!("{PAPER_VIEWS} views delivered"), 2 * args.runs());
    let mut pipeline = Vec::new();
    let mut direct = Vec::new();
    let mut reason = String::new();
    for _ in 0..args.runs() {
        let settings = DeliverySettings::new(experiment, PolicyChoice::Pipeline, PAPER_VIEWS);
        let run = deliver(experiment, settings, drop)?;
        reason = run.plan.reason;
        pipeline.push(PAPER_VIEWS as f64 / run.seconds);
        progress.inc(1);
        let settings = DeliverySettings::new(experiment, PolicyChoice::Direct, DIRECT_VIEWS);
        let run = deliver(experiment, settings, drop)?;
        direct.push(DIRECT_VIEWS as f64 / run.seconds);
        progress.inc(1);
    }
    progress.finish_and_clear();
    let mut table =
        Table::new("Delivered to a client", &[("policy", ""), ("views timed", ""), ("throughput", "views/s")]);
    table.push(["pipeline".into(), PAPER_VIEWS.into(), median(pipeline).into()])?;
    table.push(["direct".into(), DIRECT_VIEWS.into(), median(direct).into()])?;
    report.tables.push(table);
    report.parameter("plan", reason);
    Ok(())
}

/// c and g_v, each in one batch and to host pixels.
pub fn nanoseconds(
    args: &BenchArgs,
    reference: &ReferenceViews,
    experiment: &Experiment,
    report: &mut Report,
) -> anyhow::Result<()> {
    let pixels = reference.cameras.first().map_or(1, PinholeCamera::pixel_count) as f64;
    let c_ns = reference.ms_a_view(args.scene.method(), PAPER_VIEWS, args.runs())? * 1e6 / pixels;
    let g_ns = direct_s_a_view(reference, experiment, args.runs())? * 1e9 / pixels;
    let mut table = Table::new("Device time", &[("what", ""), ("time a pixel", "ns"), ("time a view", "ms")]);
    for (what, ns) in [("c: reconstruct", c_ns), ("g_v: draw from the scene", g_ns)] {
        table.push([what.into(), ns.into(), (ns * pixels * 1e-6).into()])?;
    }
    report.tables.push(table);
    Ok(())
}

fn direct_s_a_view(reference: &ReferenceViews, experiment: &Experiment, runs: usize) -> anyhow::Result<f64> {
    let work = direct_work(&experiment.setup, experiment.args.lighting, &reference.cameras, ViewPlanes::default());
    let batch_s = median_seconds(runs, || {
        experiment.engine.draw_direct(&work, Turn::of(WorkClass::Batch)).context("drawing views")?;
        Ok(())
    })?;
    Ok(batch_s / work.cameras.len() as f64)
}
