//! `myriorama plan`: the cheapest representation of a scene that keeps an error budget.

mod output;

use std::path::PathBuf;
use std::time::Duration;

use app_core::exit::Outcome;
use app_core::planning::{PlannedViews, Planning, one_node};
use app_core::print_line;
use app_core::setup::{DeviceArgs, SceneArgs, Setup};
use app_core::sizes::{SizePx, within};
use clap::Args;
use codec::FrameCodec;
use coordinator::PlanStore as _;
use coordinator::schedule::STILL_SET_S;
use depth_image::{Antialias, ViewPlanes};
use engine::GpuEngine;
use indicatif::ProgressBar;
use node::{Engine as _, Turn, WorkClass};
use output::Output;
use planner::{Budget, Kept, Planner, Pricing as _, PromiseState, device_name};
use probe::Prober;

use crate::serving::PlansArgs;

/// Finds the cheapest representation of a scene that keeps a budget: how it is sampled, from how many cameras, in images of
/// which size, and how views are reconstructed. Prints the choice, the reason, the front of cost against error, and the
/// flags that repeat it. Writes rows.csv and samples.json, the sample cameras in the transforms.json convention, to --out.
/// docs/planner.md says what is promised.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct PlanArgs {
    /// The most error, and the most time of a view: METRIC [p95] LIMIT, time LIMIT, or both with a comma between. Metrics
    /// are flip, flip whole, psnr and disocclusion; with p95 the limit is on 95 views in 100, otherwise on the mean
    #[arg(long, value_name = "BUDGET")]
    budget: Budget,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    scene: SceneArgs,
    /// Size of the views
    #[arg(long, default_value = "200x150", value_name = "WxH")]
    size: SizePx,
    /// Samples a pixel of the views: 1, 2, 4, 8 or 16
    #[arg(long, default_value = "4", value_name = "N")]
    antialias: Antialias,
    /// The codec of frames, whose time counts: lz4 or png (lossless), or jpeg:QUALITY
    #[arg(long, default_value = "lz4", value_name = "NAME")]
    codec: FrameCodec,
    /// Views of a sample set, which share its cost
    #[arg(long, default_value_t = 290, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    views: u32,
    /// Poses a second of a moving viewer, in place of --views: a set of a still scene serves 60 s of them
    #[arg(long, value_name = "HZ", conflicts_with = "views", value_parser = within(0.01..=1000.0))]
    rate: Option<f64>,
    /// The most time of measuring
    #[arg(long, default_value_t = 300.0, value_name = "S", value_parser = within(1.0..=1e6))]
    allowance: f64,
    #[command(flatten)]
    plans: PlansArgs,
    /// The folder of samples.json and rows.csv
    #[arg(long, default_value = "out/plan", value_name = "DIR")]
    out: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  myriorama plan --scene urban --budget \"disocclusion 0.5%\"
  myriorama plan --scene tree-terrain-125k --budget \"flip p95 0.06, time 8ms\"
  myriorama plan --scene helmet.gltf --budget \"psnr 32\" --rate 30 --method mesh

Exit status: 0 the budget is kept; 2 arguments or input that cannot be used; 3 nothing keeps the budget, or a failure.";

impl PlanArgs {
    /// V: the views that share the cost of a set.
    fn views_a_set(&self, setup: &Setup) -> usize {
        match self.rate {
            None => self.views as usize,
            // Each pose of a moving scene is of another moment.
            Some(_) if setup.offer.period_s.is_some() => 1,
            Some(hz) => (hz * STILL_SET_S).ceil() as usize,
        }
    }
}

/// Plans, prints and writes.
///
/// # Errors
/// The scene cannot be used, the device fails, the folder cannot be written, or nothing keeps the budget.
pub fn run(args: &PlanArgs) -> anyhow::Result<Outcome> {
    let setup = args.scene.load()?;
    let engine = GpuEngine::shared(args.device.device)?;
    engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
    let views = PlannedViews {
        size_px: args.size.0,
        planes: ViewPlanes { antialias: args.antialias, ..ViewPlanes::COLOR },
        codec: args.codec,
        scene_time_s: 0.0,
        seed: 0,
    };
    let planning = Planning::new(&setup, &args.scene, &views)?;
    let mut prober = Prober::new(engine.clone(), planning.subject.clone(), Turn::of(WorkClass::Batch));
    let direct = prober.direct_costs(&planning.viewpoints, planning.codec)?;
    let pricing = one_node(args.views_a_set(&setup), direct);
    let request =
        planning.request(args.budget, device_name(&engine.device_name()), pricing.views_a_set, args.allowance);
    let files = args.plans.files();
    let remembered = files.as_ref().map_or_else(|| Kept::empty(planning.key()), |files| files.read(&planning.key()));
    let mut planner = Planner::new(request, planning.ladder.clone(), pricing)?;
    let progress = ProgressBar::new_spinner();
    progress.enable_steady_tick(Duration::from_millis(200));
    let Planning { viewpoints, representations, .. } = &planning;
    let (outcome, kept) = probe::plan(&mut planner, &mut prober, viewpoints, representations, remembered, |planner| {
        progress.set_message(planner.outcome().reason);
    });
    progress.finish_and_clear();
    if let Some(files) = files {
        // The plan is made, whether a later one can use what was measured or not.
        files.write(&kept).unwrap_or_else(|error| eprintln!("warning: measurements are not kept: {error}"));
    }
    let output = Output { budget: args.budget, out: &args.out, setup: &setup, planning: &planning, outcome: &outcome };
    output.write(&planner.summaries(), pricing.direct())?;
    print_line!("\n{:.1} s of measuring; all rows are in {}", planner.spent_s(), args.out.join("rows.csv").display());
    anyhow::ensure!(outcome.state == PromiseState::Kept, "the budget {} is not kept: {}", args.budget, outcome.reason);
    Ok(Outcome::Done)
}
