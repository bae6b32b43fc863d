//! `myriorama-lab bench scaling`.

use std::fs::create_dir_all;

use anyhow::Context as _;
use app_core::exit::Outcome;
use app_core::experiment::VIEW_SIZE_PX;
use app_core::process::runtime;
use app_core::setup::SceneArgs;
use app_core::sizes::within;
use clap::Args;
use reconstruction::ReconstructionMethod;
use render::Lighting;
use scene::SceneSpec;

use super::matrix::{Extent, Form};
use super::measure::{Request, take};
use super::report::{report, show};
use super::subject::Subject;
use crate::study::RunArgs;

/// Measures the time between two sample sets on a coordinator and P node processes, for P = 2…11 nodes, V = 10…1000
/// views and every policy. The nodes share this machine's processors in equal parts by control groups of Linux, so that
/// eleven nodes fit two cores. The paper's figures and the predictions stand beside the results. A simulation
/// around the same schedule is compared with them and goes on to 1,000 nodes. With --quick a subset is measured in under
/// ten minutes: P = 11 and 5, with shared light at V = 1000 alone, in views of 80×60.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  myriorama-lab bench scaling --quick\n  myriorama-lab bench scaling --out out/scaling"
)]
pub struct ScalingArgs {
    /// A scene by name, or a file
    #[arg(long, value_name = "SPEC", default_value = "tree-terrain-500k")]
    scene: SceneSpec,
    /// How surfaces are lit; the default is the paper's lighting
    #[arg(long, default_value_t, value_name = "TERMS")]
    lighting: Lighting,
    /// How views are reconstructed
    #[arg(long, default_value_t, value_name = "NAME")]
    method: ReconstructionMethod,
    /// The most nodes P
    #[arg(long, default_value_t = 11, value_name = "P", value_parser = clap::value_parser!(u16).range(2..=64))]
    nodes: u16,
    /// The most views V
    #[arg(long, default_value_t = 1000, value_name = "V", value_parser = clap::value_parser!(u32).range(10..=1000))]
    views: u32,
    /// Cores of each node [default: all but 0.35 for the client, in equal parts]
    #[arg(long, value_name = "CORES", value_parser = within(0.01..=64.0))]
    quota: Option<f64>,
    /// The most simulated nodes P
    #[arg(long, default_value_t = 1000, value_name = "P", value_parser = clap::value_parser!(u16).range(2..=1000))]
    simulate_to: u16,
    /// Measure Table 1 alone, in about a quarter of an hour: pipeline and auto at V = 1000 for each of its P
    #[arg(long = "table-1", conflicts_with = "quick")]
    table_1: bool,
    #[command(flatten)]
    run: RunArgs,
}

/// The usual folder of the report.
const FOLDER: &str = "out/bench-scaling";

impl ScalingArgs {
    fn request(&self, is_lit: bool) -> Request {
        let form = match (self.table_1, self.run.quick) {
            (true, _) => Form::Table1,
            (false, true) => Form::Quick,
            (false, false) => Form::Full,
        };
        Request {
            device: self.run.device.device,
            extent: Extent { form, nodes: self.nodes.into(), views: self.views as usize, is_lit },
            quota_cores: self.quota,
            event_log: self.run.folder(FOLDER).join("schedule.log"),
        }
    }
}

/// Measures, simulates and writes the report.
///
/// # Errors
/// Input that cannot be used, no control groups, or a failure of the cluster.
pub fn run(args: &ScalingArgs) -> anyhow::Result<Outcome> {
    let folder = args.run.folder(FOLDER);
    create_dir_all(folder).with_context(|| format!("cannot write to {}", folder.display()))?;
    let scene = SceneArgs { method: Some(args.method), lighting: args.lighting, ..SceneArgs::new(args.scene.clone()) };
    let is_lit = args.method.light_cache_quality().is_some();
    // A view of shared light takes ten times as long as one of images alone.
    let view_size_px = if is_lit && args.run.quick { VIEW_SIZE_PX * 2 / 5 } else { VIEW_SIZE_PX };
    let subject = Subject::load(&scene, view_size_px)?;
    let request = args.request(is_lit);
    let results = runtime()?.block_on(take(&request, &subject))?;
    println!("simulating up to {} nodes", args.simulate_to);
    let report = report(&results, request.extent, &args.scene.to_string(), usize::from(args.simulate_to))?;
    show(&report, folder)?;
    args.run.write(FOLDER, &report)
}
