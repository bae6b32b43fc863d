//! `myriorama-lab study light_cache`.

use std::path::PathBuf;

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use report::Report;

use super::conditions::CONDITIONS;
use super::measure::{Extent, measure};
use super::report::add_to;
use super::stage::{LIGHTING, SAMPLES_A_PIXEL};
use super::subjects::{VIEW_PX, subjects};

/// The quick form and the full one.
const EXTENTS: [Extent; 2] = [Extent { views: 2, truth_views: 1 }, Extent { views: 8, truth_views: 8 }];

/// Measures views with light from samples against direct drawing with few rays, at equal error.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study light_cache --models models/ --strict   exit status 1 when a check falls short
  myriorama-lab study light_cache --quick --subject courtyard")]
pub struct LightCacheArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/study/light_cache", value_name = "DIR")]
    out: PathBuf,
    /// A folder with the models FlightHelmet, lamborghini, ingenuity and threejs-shaderball, or with subfolders that have them
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Measures two views of a few scenes in place of eight of all
    #[arg(long)]
    quick: bool,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT", default_value = "")]
    subject: String,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

impl LightCacheArgs {
    fn wants(&self, name: &str) -> bool {
        name.to_lowercase().contains(&self.subject.to_lowercase())
    }
}

/// Measures all subjects and writes the report.
///
/// # Errors
/// There is no such subject, the folder of models lacks one, the device fails, or the report cannot be written.
pub fn run(args: &LightCacheArgs) -> anyhow::Result<Outcome> {
    let mut subjects = subjects(args.models.as_deref(), args.quick)?;
    subjects.retain(|subject| args.wants(&subject.name));
    let mut conditions = if args.quick { Vec::new() } else { CONDITIONS.to_vec() };
    conditions.retain(|condition| args.wants(condition.name));
    if subjects.is_empty() && conditions.is_empty() {
        return Err(BadInput(format!("no subject's name contains {:?}", args.subject)).into());
    }
    let engine = GpuEngine::shared(args.device.device)?;
    let mut report = Report::new("Myriorama study: light_cache", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("views", format!("{VIEW_PX}, {SAMPLES_A_PIXEL} samples a pixel"));
    report.parameter("lighting", LIGHTING);
    let extent = EXTENTS[usize::from(!args.quick)];
    let progress = bar("scenes", subjects.len() + conditions.len());
    let mut results = Vec::new();
    for subject in &subjects {
        progress.set_message(subject.name.clone());
        results.push(measure(&engine, subject, extent).with_context(|| subject.name.clone())?);
        progress.inc(1);
    }
    add_to(&mut report, &results)?;
    for condition in conditions {
        progress.set_message(condition.name);
        condition.add_to(&mut report, &engine, args.models.as_deref()).context(condition.name)?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    report.tables.iter().for_each(|table| println!("{}\n", table.to_text()));
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}
