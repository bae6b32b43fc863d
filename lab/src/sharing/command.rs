//! `myriorama-lab bench sharing`: whether clients of one cluster leave each other alone.

use app_core::exit::Outcome;
use app_core::process::runtime;
use clap::{Args, ValueEnum};
use render::Lighting;
use scene::SceneSpec;

use super::up::Up;
use super::{beside, guests, killed_compositor, report};
use crate::section::{self, Section, measure_parts};
use crate::study::RunArgs;

/// Measures a live viewer of 320×180 at 10 poses a second beside batches of other clients: other sizes, lightings,
/// codecs, scenes, moments, and views drawn directly. Each batch is measured alone, too. Then a node of one scene is killed
/// while viewers of another scene look on. --quick takes one repeat in place of three.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama-lab bench sharing --strict")]
pub struct SharingArgs {
    /// The scene of the viewer
    #[arg(long, value_name = "SPEC", default_value = "tree-terrain-500k")]
    scene: SceneSpec,
    /// The scene of the guest that asks for another one
    #[arg(long, value_name = "SPEC", default_value = "courtyard")]
    other_scene: SceneSpec,
    /// How surfaces are lit
    #[arg(long, value_name = "TERMS", default_value = "soft 4, occlusion 4")]
    lighting: Lighting,
    /// Nodes P that share the device
    #[arg(long, default_value_t = 4, value_name = "P", value_parser = clap::value_parser!(u16).range(2..=64))]
    nodes: u16,
    /// Measures only this part of the report; may be repeated
    #[arg(long, value_name = "PART")]
    only: Vec<Part>,
    #[command(flatten)]
    run: RunArgs,
}

/// A part of the report, which is measured by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// A viewer beside six kinds of batch
    Guests,
    /// Two scenes on processes; a compositor of one is killed
    KilledCompositor,
}

impl SharingArgs {
    fn repeats(&self) -> usize {
        if self.run.quick { 1 } else { 3 }
    }

    /// Arguments of `myriorama up`.
    fn cluster(&self) -> [String; 10] {
        [
            "--scene".to_owned(),
            self.scene.to_string(),
            "--scene".to_owned(),
            self.other_scene.to_string(),
            "--lighting".to_owned(),
            self.lighting.to_string(),
            "--device".to_owned(),
            self.run.device.device.to_string(),
            "--nodes".to_owned(),
            self.nodes.to_string(),
        ]
    }
}

/// Measures the parts and writes the report.
///
/// # Errors
/// The report cannot be written.
pub fn run(args: &SharingArgs) -> anyhow::Result<Outcome> {
    let sections = runtime()?.block_on(measure_parts(&args.only, async |part| measure_part(args, *part).await));
    let mut report = section::report("Myriorama bench sharing", &sections);
    for (name, value) in [
        ("scene", args.scene.to_string()),
        ("other scene", args.other_scene.to_string()),
        ("lighting", args.lighting.to_string()),
    ] {
        report.parameter(name, value);
    }
    report.parameter("nodes P", u32::from(args.nodes));
    report.parameter("repeats", args.repeats());
    section::add(&mut report, sections);
    args.run.finish("out/bench-sharing", &report)
}

async fn measure_part(args: &SharingArgs, part: Part) -> anyhow::Result<Section> {
    match part {
        Part::Guests => guests(&args.cluster(), args.repeats()).await,
        Part::KilledCompositor => killed_compositor::measure(args.run.device.device).await,
    }
}

/// All guests, one after the other, beside a viewer of one cluster.
async fn guests(cluster: &[String], repeats: usize) -> anyhow::Result<Section> {
    let up = Up::start(cluster).await?;
    let mut rows = Vec::new();
    for guest in &guests::GUESTS {
        // One guest that is refused, or that ends the viewer, hides no other.
        let row = beside::measure(&up, guest, repeats).await;
        if let Err(error) = &row {
            tracing::warn!(guest = guest.name, error = format!("{error:#}"), "not measured");
        }
        rows.push((guest, row.ok()));
    }
    report::section(&rows, up.device)
}
