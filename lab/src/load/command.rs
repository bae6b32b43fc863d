//! `myriorama-lab bench load`: many clients on real processes.

use std::time::Duration;

use app_core::exit::Outcome;
use app_core::process::runtime;
use app_core::progress::bar;
use app_core::sizes::{SizePx, within};
use clap::Args;
use glam::UVec2;
use render::Lighting;
use scene::SceneSpec;

use super::clients::Wanted;
use super::{phases, report};
use crate::cpu_share::Hierarchy;
use crate::processes::{Setting, Share};
use crate::study::{RunArgs, new_report};

/// Measures four loads, each on a coordinator and node processes of its own. Of views of 320×180, 8 clients
/// ask for 10 frames a second, 16 for 15, 80 for 10, and 200 for none, unless options say otherwise. With --quick each load
/// takes half a minute.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama-lab bench load --minutes 10 --strict")]
pub struct LoadArgs {
    /// The scene
    #[arg(long, value_name = "SPEC", default_value = "courtyard")]
    scene: SceneSpec,
    /// How surfaces are lit
    #[arg(long, value_name = "TERMS", default_value_t)]
    lighting: Lighting,
    /// The size of views
    #[arg(long, default_value_t = SizePx(UVec2::new(320, 180)), value_name = "WxH")]
    size: SizePx,
    /// Frames a second that each client asks for, in place of 10, 15 and 10
    #[arg(long, value_name = "HZ", value_parser = within(0.01..=1000.0))]
    rate: Option<f64>,
    /// How views are made: a reconstruction method or direct [default: by the lighting]
    #[arg(long, value_name = "NAME")]
    method: Option<String>,
    /// The number of node processes, P
    #[arg(long, default_value_t = 1, value_name = "P", value_parser = clap::value_parser!(u16).range(1..=64))]
    nodes: u16,
    /// Cores of each node, by a control group; 0 sets no limit. Without a limit, each node of a machine promises all of
    /// it [default: all cores but half a one, divided; no limit for one node, or without control groups]
    #[arg(long, value_name = "CORES", value_parser = within(0.0..=1024.0))]
    share: Option<f64>,
    /// The time of each load
    #[arg(long, default_value_t = 10.0, value_name = "MIN",
        value_parser = within(0.1..=1440.0))]
    minutes: f64,
    #[command(flatten)]
    run: RunArgs,
}

impl LoadArgs {
    fn lasting(&self) -> Duration {
        Duration::from_secs_f64(if self.run.quick { 30.0 } else { self.minutes * 60.0 })
    }

    fn wanted(&self) -> Wanted {
        Wanted { size_px: self.size.0, rate_hz: self.rate, method: self.method.clone() }
    }

    fn setting(&self) -> Setting {
        let coordinator =
            ["--scene".to_owned(), self.scene.to_string(), "--lighting".to_owned(), self.lighting.to_string()];
        let share = self.share_cores().map_or(Share::Whole, Share::Cores);
        Setting { coordinator: coordinator.into(), device: self.run.device.device, nodes: self.nodes.into(), share }
    }

    fn share_cores(&self) -> Option<f64> {
        let all = std::thread::available_parallelism().map_or(1.0, |cores| cores.get() as f64);
        let is_shared = self.nodes > 1 && Hierarchy::find().is_ok();
        let equal = is_shared.then(|| (all - 0.5) / f64::from(self.nodes));
        self.share.or(equal).filter(|cores| *cores > 0.0)
    }
}

/// Measures all loads and writes the report.
///
/// # Errors
/// A process does not start, or a client fails other than by refusal.
pub fn run(args: &LoadArgs) -> anyhow::Result<Outcome> {
    let progress = bar("load", 4);
    let phases = runtime()?.block_on(phases::run(&args.setting(), &args.wanted(), args.lasting(), &progress))?;
    progress.finish_and_clear();
    let mut report = new_report("Myriorama bench load", &phases.device);
    report.parameter("scene", args.scene.to_string());
    report.parameter("lighting", args.lighting.to_string());
    report.parameter("size", args.size.to_string());
    report.parameter("method", args.method.clone().unwrap_or_else(|| "by the lighting".to_owned()));
    report.parameter("nodes P", u32::from(args.nodes));
    let share = args.share_cores().map_or_else(|| "all".to_owned(), |cores| format!("{cores:.2}"));
    report.parameter("cores of each node", share);
    report.parameter("each load", format!("{} s", args.lasting().as_secs()));
    report::add(&phases, &mut report)?;
    println!("{}\n", phases.device);
    args.run.finish("out/bench-load", &report)
}
