//! `myriorama-lab study sampling`.

use std::path::PathBuf;

use app_core::exit::Outcome;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use report::Report;

use super::detection::{detection, detection_report};
use super::extent::Extent;
use super::reconstructions::{reconstructions, reconstructions_report};
use super::scene::scene_report;
use super::sizes::{sizes, sizes_report};
use super::subject::{SCENES, Subject};
use super::tables::tables;
use super::times::{times, times_report};

/// Samples a bird's nest, grass, a city and a tree from three viewpoints by every method. Reports redundant,
/// disoccluded and useful samples, their availability in output frames, the quality of reconstructed views, and all
/// costs.
#[derive(Debug, Args)]
pub struct SamplingArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/study/sampling", value_name = "DIR")]
    out: PathBuf,
    /// Runs a smaller form: smaller images, fewer views
    #[arg(long)]
    quick: bool,
    /// Only these scenes: bird-nest, grass, urban, tree
    #[arg(long = "scene", value_name = "NAME", value_parser = SCENES)]
    scenes: Vec<String>,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

/// Measures all scenes and writes the report.
///
/// # Errors
/// The device's, or a folder that cannot be written.
pub fn run(args: &SamplingArgs) -> anyhow::Result<Outcome> {
    let engine = GpuEngine::shared(args.device.device)?;
    let extent = Extent::of(args.quick);
    let mut report = Report::new("Myriorama study: sampling", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("sample images", format!("3 of {0}×{0}", extent.side_px));
    report.parameter("views between them", extent.views);
    report.parameter("seeded samples an image", extent.seeds);
    let (mut rows, mut costs, mut views) = (Vec::new(), Vec::new(), Vec::new());
    for name in SCENES.iter().filter(|name| args.scenes.is_empty() || args.scenes.iter().any(|wanted| wanted == *name))
    {
        let subject = Subject::load(&engine, name)?;
        // Times come first: they need the machine as it is.
        costs.push((subject.name.clone(), times(&subject, extent)?));
        rows.push(scene_report(&subject, extent, &mut report)?);
        let of_sizes = sizes(&subject, extent, args.quick)?;
        sizes_report(&subject.name, &of_sizes, &mut report)?;
        views.push((subject.name.clone(), reconstructions(&subject, args.quick)?));
    }
    tables(&rows, &mut report)?;
    times_report(&costs, extent, &mut report)?;
    reconstructions_report(&views, &mut report)?;
    detection_report(&detection(&engine, args.quick)?, &mut report)?;
    report.tables.iter().for_each(|table| println!("\n{}", table.to_text()));
    println!();
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}
