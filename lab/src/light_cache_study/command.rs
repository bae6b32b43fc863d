//! `myriorama-lab study light_cache`.

use std::path::PathBuf;

use app_core::exit::{BadInput, Outcome};
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use report::Report;

use super::conditions::{CONDITIONS, Condition};
use super::measure::measure;
use super::report::{add_to, failed};
use super::stage::{LIGHTING, SAMPLES_A_PIXEL, VIEW_PX};
use super::subjects::{Subject, subjects};

/// Views of a scene, in the quick form and in the full one.
const VIEWS: [usize; 2] = [2, 8];

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

    fn subjects(&self) -> anyhow::Result<Vec<Subject>> {
        let mut subjects = subjects(self.models.as_deref(), self.quick)?;
        subjects.retain(|subject| self.wants(&subject.name));
        Ok(subjects)
    }

    /// The quick form has none.
    fn conditions(&self) -> Vec<Condition> {
        CONDITIONS.into_iter().filter(|condition| !self.quick && self.wants(condition.name)).collect()
    }
}

/// Measures all subjects and writes the report. A subject that fails is a check that falls short.
///
/// # Errors
/// There is no device or no such subject, the folder of models lacks one, or the report cannot be written.
pub fn run(args: &LightCacheArgs) -> anyhow::Result<Outcome> {
    let subjects = args.subjects()?;
    let conditions = args.conditions();
    if subjects.is_empty() && conditions.is_empty() {
        return Err(BadInput(format!("no subject's name contains {:?}", args.subject)).into());
    }
    let engine = GpuEngine::shared(args.device.device)?;
    let mut report = Report::new("Myriorama study: light_cache", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("views", format!("{VIEW_PX}, {SAMPLES_A_PIXEL} samples a pixel"));
    report.parameter("lighting", LIGHTING);
    let views = VIEWS[usize::from(!args.quick)];
    let progress = bar("scenes", subjects.len() + conditions.len());
    let mut results = Vec::new();
    for subject in &subjects {
        progress.set_message(subject.name.clone());
        match measure(&engine, subject, views) {
            Ok(result) => results.push(result),
            Err(error) => report.checks.push(failed(&subject.name, &error)),
        }
        progress.inc(1);
    }
    add_to(&mut report, &results)?;
    for condition in conditions {
        progress.set_message(condition.name);
        let check = condition.check(&engine, args.models.as_deref());
        report.checks.push(check.unwrap_or_else(|error| failed(condition.name, &error)));
        progress.inc(1);
    }
    progress.finish_and_clear();
    report.tables.iter().for_each(|table| println!("{}\n", table.to_text()));
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}
