//! `myriorama-lab study fronts`.

use std::path::PathBuf;

use app_core::exit::{BadInput, Outcome};
use clap::{Args, ValueEnum};

use super::fronts;
use super::light::Light;
use crate::failures::stand::Stand;
use crate::study::{RunArgs, is_named};

/// The light under which fronts are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FrontLight {
    /// Under soft 16, indirect 64
    Indirect,
    /// Under soft 16, occlusion 16
    Occlusion,
}

/// Measures cost and error of shared and of direct light, and charts the fronts.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study fronts --quick --strict   one subject
  myriorama-lab study fronts --light indirect --models models/")]
pub struct FrontsArgs {
    #[command(flatten)]
    study: RunArgs,
    /// The light of the subjects; may be repeated. All unless it is given
    #[arg(long = "light", value_name = "LIGHT")]
    lights: Vec<FrontLight>,
    /// A folder with the model FlightHelmet, or with a subfolder that has it
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT")]
    subjects: Vec<String>,
}

/// Measures all subjects and writes the report.
///
/// # Errors
/// A subject cannot be used, the device fails, or the folder cannot be written.
pub fn run(args: &FrontsArgs) -> anyhow::Result<Outcome> {
    let lights = [(FrontLight::Indirect, Light::Indirect), (FrontLight::Occlusion, Light::Occlusion)];
    let lights = lights.into_iter().filter(|(light, _)| args.lights.is_empty() || args.lights.contains(light));
    let lights: Vec<Light> = lights.map(|(_, light)| light).collect();
    // A quick run measures few subjects, unless they are named.
    let names = fronts::subject_names(args.study.quick && args.subjects.is_empty()).iter().copied();
    let names: Vec<&'static str> = names.filter(|name| is_named(name, &args.subjects)).collect();
    if names.is_empty() {
        return Err(BadInput(format!("no subject's name contains {:?}", args.subjects)).into());
    }
    let work = fronts::wanted(&names, &lights, args.models.as_deref())?;
    let engine = args.study.engine()?;
    let mut report = args.study.report("fronts", &engine);
    fronts::measure(&Stand::new(&engine, false), &work, args.study.quick, &mut report)?;
    args.study.finish("out/study/fronts", &report)
}
