//! `myriorama-lab bench viewer`: the viewer in a real browser.

use app_core::exit::Outcome;
use app_core::process::runtime;
use clap::{Args, ValueEnum};
use scene::SceneSpec;

use super::stand::Ground;
use super::{dragging, faults, first_picture, memory, rest, slow_link, walk};
use crate::section::{self, Section, measure_parts};
use crate::study::RunArgs;

/// Measures the viewer's page in Chromium, before a gateway, a coordinator and two nodes on the same machine: pictures of
/// drags, stills, first pictures, a slow link, faults, a walk around the scene, and memory. Needs chromium. --quick takes one repeat in
/// place of five, and one minute of memory in place of ten.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama-lab bench viewer --quick --only dragging --only rest")]
pub struct ViewerBenchArgs {
    /// The scene
    #[arg(long, value_name = "SPEC", default_value = "courtyard")]
    scene: SceneSpec,
    /// Measures only this part of the report; may be repeated
    #[arg(long, value_name = "PART")]
    only: Vec<Part>,
    #[command(flatten)]
    run: RunArgs,
}

/// A part of the report, which is measured by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Pictures of a drag: their rate, age, bytes, and the gateway's share
    Dragging,
    /// The lossless still after a drag
    Rest,
    /// The first picture of a page, and of a cluster
    FirstPicture,
    /// A link of 1 Mbit/s with a round trip of 80 ms, which is then freed
    SlowLink,
    /// A compositor is killed, then the gateway
    Faults,
    /// A walk around the scene, and its stills beside direct drawing
    Walk,
    /// Memory of the page and the gateway while a visitor drags and rests
    Memory,
}

impl ViewerBenchArgs {
    fn ground(&self) -> Ground {
        let repeats = if self.run.quick { 1 } else { 5 };
        let memory_s = if self.run.quick { 60.0 } else { 600.0 };
        Ground { scene: self.scene.to_string(), device: self.run.device.device, repeats, memory_s }
    }
}

/// Measures the parts and writes the report.
///
/// # Errors
/// The report cannot be written.
pub fn run(args: &ViewerBenchArgs) -> anyhow::Result<Outcome> {
    let ground = args.ground();
    let measure = measure_parts(&args.only, async |part| measure_part(&ground, *part).await);
    let sections = runtime()?.block_on(measure);
    let mut report = section::report("Myriorama bench viewer", &sections);
    report.parameter("scene", ground.scene.clone());
    report.parameter("repeats", ground.repeats);
    section::add(&mut report, sections);
    args.run.finish("out/bench-viewer", &report)
}

async fn measure_part(ground: &Ground, part: Part) -> anyhow::Result<Section> {
    match part {
        Part::Dragging => dragging::measure(ground).await,
        Part::Rest => rest::measure(ground).await,
        Part::FirstPicture => first_picture::measure(ground).await,
        Part::SlowLink => slow_link::measure(ground).await,
        Part::Faults => faults::measure(ground).await,
        Part::Walk => walk::measure(ground).await,
        Part::Memory => memory::measure(ground).await,
    }
}
