//! `myriorama-lab study fronts`.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use app_core::progress::bar;
use clap::{Args, ValueEnum};
use depth_image::Antialias;
use engine::GpuEngine;
use report::Report;

use super::checks::checks;
use super::measure::{Extent, Front};
use super::report::add_to;
use super::row::REPEATS;
use super::subject::{Conditions, SUBJECTS, Subject};
use crate::failures::stand::Stand;
use crate::lit::fronts as lit;
use crate::lit::light::Light;
use crate::study::{RunArgs, is_named};

/// The light under which fronts are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FrontLight {
    /// All rows of the ladder
    Plain,
    /// Shared and direct light under soft 16, indirect 64
    Indirect,
    /// Shared and direct light under soft 16, occlusion 16
    Occlusion,
}

/// Measures cost and error of all rows of the ladder, and of shared light under expensive light, and charts the fronts.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study fronts --quick --strict   a few subjects, every second number of cameras and size
  myriorama-lab study fronts --subject urban    one scene, all rows
  myriorama-lab study fronts --light indirect --light occlusion --models models/   expensive light alone")]
pub struct FrontsArgs {
    #[command(flatten)]
    study: RunArgs,
    /// The light of the subjects; may be repeated. All unless it is given
    #[arg(long = "light", value_name = "LIGHT")]
    lights: Vec<FrontLight>,
    /// A folder with the model FlightHelmet, or with a subfolder that has it, for expensive light
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT")]
    subjects: Vec<String>,
}

impl FrontsArgs {
    fn has_light(&self, light: FrontLight) -> bool {
        self.lights.is_empty() || self.lights.contains(&light)
    }

    /// A quick run measures few subjects, unless they are named.
    fn is_short(&self) -> bool {
        self.study.quick && self.subjects.is_empty()
    }

    fn plain_subjects(&self) -> Vec<Conditions> {
        let subjects = SUBJECTS.into_iter().filter(|subject| {
            self.has_light(FrontLight::Plain)
                && is_named(subject.name, &self.subjects)
                && (subject.is_quick || !self.is_short())
        });
        subjects.collect()
    }

    fn lights(&self) -> Vec<Light> {
        let lights = [(FrontLight::Indirect, Light::Indirect), (FrontLight::Occlusion, Light::Occlusion)];
        lights.into_iter().filter(|(light, _)| self.has_light(*light)).map(|(_, light)| light).collect()
    }
}

/// Measures all subjects and writes the report.
///
/// # Errors
/// A subject cannot be used, the device fails, or the folder cannot be written.
pub fn run(args: &FrontsArgs) -> anyhow::Result<Outcome> {
    let plain = args.plain_subjects();
    let lit_names = lit::subject_names(args.is_short()).iter().copied();
    let lit_names: Vec<&'static str> = lit_names.filter(|name| is_named(name, &args.subjects)).collect();
    let lit_work = lit::wanted(&lit_names, &args.lights(), args.models.as_deref())?;
    if plain.is_empty() && lit_names.is_empty() {
        return Err(BadInput(format!("no subject's name contains {:?}", args.subjects)).into());
    }
    let engine = args.study.engine()?;
    let mut report = args.study.report("fronts", &engine);
    measure_plain(&engine, &plain, args.study.quick, &mut report)?;
    lit::measure(&Stand::new(&engine, false), &lit_work, args.study.quick, &mut report)?;
    args.study.finish("out/study/fronts", &report)
}

/// The ladder in plain light.
fn measure_plain(
    engine: &Arc<GpuEngine>,
    wanted: &[Conditions],
    is_quick: bool,
    report: &mut Report,
) -> anyhow::Result<()> {
    let extent = Extent::new(is_quick);
    report.parameter("views a row", extent.views.len());
    let mut fronts = Vec::with_capacity(wanted.len());
    for conditions in wanted {
        let front = front(engine, conditions, &extent).with_context(|| format!("subject {:?}", conditions.name))?;
        add_to(report, &front)?;
        fronts.push(front);
    }
    if !fronts.is_empty() {
        report.checks.extend(checks(&fronts));
    }
    Ok(())
}

fn front(engine: &Arc<GpuEngine>, conditions: &Conditions, extent: &Extent) -> anyhow::Result<Front> {
    let subject = Subject::load(engine, conditions)?;
    let planning = subject.planning(Antialias::NONE)?;
    let rows = extent.places(&planning.ladder).len();
    let progress = bar(format!("rows, {}", conditions.name), (1 + REPEATS) * rows);
    let front = Front::measure(&subject, &planning, extent, || progress.inc(1))?;
    progress.finish_and_clear();
    Ok(front)
}
