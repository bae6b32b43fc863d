//! `myriorama-lab study fronts`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::{Args, ValueEnum};
use depth_image::Antialias;
use engine::GpuEngine;
use node::Engine as _;
use planner::ProbeView;
use report::{Bar, Check, Report};

use super::checks::checks;
use super::conditions::{self, Conditions};
use super::expensive::{self, LightFront};
use super::measure::{Front, Limits};
use super::report::add_to;
use super::row::REPEATS;
use super::subject::Subject;
use crate::failures::stand::Stand;
use crate::lit_views::light::Light;
use crate::lit_views::subject::Subject as LitSubject;

/// Views that rows are measured on, in the quick form and in the full one.
const VIEWS: [u32; 2] = [8, 32];
/// The time of a run beyond `--time`, for loading and the report.
const GRACE_S: f64 = 15.0;
/// Numbers of cameras and sides of images of the rows of a quick run: every second one.
const QUICK_ROWS: (&[u32], &[f64]) = (&[1, 4], &[0.5, 1.0]);
/// The longest quick run.
const QUICK_S: f64 = 600.0;

/// The light under which fronts are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FrontLight {
    /// The ladder on the subjects of lab/conditions.toml
    Plain,
    /// Shared and direct light under soft 16, indirect 64
    Indirect,
    /// Shared and direct light under soft 16, occlusion 16
    Occlusion,
}

/// Measures cost and error of all rows of the ladder on the subjects of lab/conditions.toml, and of shared light under
/// expensive light, and charts the fronts.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study fronts --quick --strict   a few subjects, every second number of cameras and size
  myriorama-lab study fronts --time 60          what a minute allows, spread over all rows; the report says what is missing
  myriorama-lab study fronts --subject urban    one scene, all rows
  myriorama-lab study fronts --light indirect --light occlusion --models models/   expensive light alone")]
pub struct FrontsArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/study/fronts", value_name = "DIR")]
    out: PathBuf,
    /// Measures a few subjects, every second number of cameras and size of the ladder, and fewer views
    #[arg(long)]
    quick: bool,
    /// The light of the subjects; may be repeated. All unless --time or --conditions is given, then plain
    #[arg(long = "light", value_name = "LIGHT")]
    lights: Vec<FrontLight>,
    /// A folder with the model FlightHelmet, or with a subfolder that has it, for expensive light
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// The most seconds of measuring in plain light, about. Rows that are measured by then are reported
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    time: Option<u32>,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT")]
    subjects: Vec<String>,
    /// Subjects of plain light from a file in the form of lab/conditions.toml, in place of its own
    #[arg(long, value_name = "FILE")]
    conditions: Option<PathBuf>,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

/// A subject under expensive light.
struct LitWork {
    subject: LitSubject,
    light: Light,
}

/// What is measured.
struct WantedSubjects {
    plain: Vec<Conditions>,
    lit: Vec<LitWork>,
    /// Models that no folder is given for.
    left_out: Vec<&'static str>,
}

impl FrontsArgs {
    fn is_wanted(&self, light: FrontLight) -> bool {
        let is_plain_alone = self.time.is_some() || self.conditions.is_some();
        match self.lights.as_slice() {
            [] => light == FrontLight::Plain || !is_plain_alone,
            lights => lights.contains(&light),
        }
    }

    fn wanted(&self) -> anyhow::Result<WantedSubjects> {
        let mut wanted = WantedSubjects { plain: self.wanted_plain()?, lit: Vec::new(), left_out: Vec::new() };
        let has_filter = !self.subjects.is_empty();
        for &name in expensive::subjects::subject_names(self.quick && !has_filter) {
            let lights = expensive::subjects::LIGHTS.into_iter().filter(|light| self.is_wanted((*light).into()));
            if has_filter && !conditions::is_named(name, &self.subjects) {
                continue;
            }
            for light in lights {
                match LitSubject::new(name, self.models.as_deref())? {
                    Some(subject) => wanted.lit.push(LitWork { subject, light }),
                    None => wanted.left_out.push(name),
                }
            }
        }
        wanted.left_out.dedup();
        let is_nothing = wanted.plain.is_empty() && wanted.lit.is_empty() && wanted.left_out.is_empty();
        if is_nothing && has_filter {
            return Err(conditions::none_is_named(&self.subjects).into());
        }
        Ok(wanted)
    }

    fn wanted_plain(&self) -> anyhow::Result<Vec<Conditions>> {
        if !self.is_wanted(FrontLight::Plain) {
            return Ok(Vec::new());
        }
        let all = conditions::read(self.conditions.as_deref())?;
        let has_filter = !self.subjects.is_empty();
        let is_wanted = |subject: &Conditions| match has_filter {
            true => conditions::is_named(&subject.name, &self.subjects),
            false => !self.quick || subject.quick,
        };
        let wanted: Vec<Conditions> = all.into_iter().filter(is_wanted).collect();
        if wanted.is_empty() && !has_filter {
            return Err(BadInput("no subject is marked as quick".to_owned()).into());
        }
        Ok(wanted)
    }

    /// The share of the time that is left for the next of `subjects` subjects.
    fn limits(&self, start: Instant, subjects: usize) -> Limits {
        let end = self.time.map(|seconds| {
            let left = Duration::from_secs(u64::from(seconds)).saturating_sub(start.elapsed());
            Instant::now() + left / subjects.max(1) as u32
        });
        let views = (0..VIEWS[usize::from(!self.quick)]).map(ProbeView::Screening).collect();
        Limits { end, views, only: self.quick.then_some(QUICK_ROWS) }
    }
}

impl From<Light> for FrontLight {
    fn from(light: Light) -> Self {
        match light {
            Light::Indirect => Self::Indirect,
            Light::Occlusion => Self::Occlusion,
        }
    }
}

/// Measures all subjects and writes the report.
///
/// # Errors
/// A subject cannot be used, the device fails, or the folder cannot be written.
pub fn run(args: &FrontsArgs) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let wanted = args.wanted()?;
    let engine = GpuEngine::shared(args.device.device)?;
    let mut report = Report::new("Myriorama study: fronts", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    if !wanted.plain.is_empty() {
        measure_plain(args, &engine, &wanted.plain, &mut report)?;
    }
    if !wanted.lit.is_empty() {
        measure_lit(args, &engine, &wanted.lit, &mut report)?;
    }
    report.checks.extend(wanted.left_out.into_iter().map(expensive::checks::left_out));
    let seconds = start.elapsed().as_secs_f64();
    let most_s = args.time.map_or(QUICK_S, |seconds| f64::from(seconds) + GRACE_S);
    if args.quick || args.time.is_some() {
        report.checks.push(Check::new("time of the run", seconds, "s", Bar::AtMost(most_s)));
    }
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}

/// The ladder in plain light.
fn measure_plain(
    args: &FrontsArgs,
    engine: &Arc<GpuEngine>,
    wanted: &[Conditions],
    report: &mut Report,
) -> anyhow::Result<()> {
    let start = Instant::now();
    let mut fronts = Vec::with_capacity(wanted.len());
    for (place, conditions) in wanted.iter().enumerate() {
        let limits = args.limits(start, wanted.len() - place);
        fronts.push(front(engine, conditions, &limits).with_context(|| format!("subject {:?}", conditions.name))?);
    }
    report.parameter("views a row", VIEWS[usize::from(!args.quick)] as usize);
    for front in &fronts {
        add_to(report, front)?;
    }
    report.checks.extend(checks(&fronts));
    Ok(())
}

/// Shared and direct light.
fn measure_lit(
    args: &FrontsArgs,
    engine: &Arc<GpuEngine>,
    wanted: &[LitWork],
    report: &mut Report,
) -> anyhow::Result<()> {
    let stand = Stand::new(engine, false);
    let views = expensive::subjects::views(args.quick);
    report.parameter("expensive light: views a row", format!("{} of {}", views.count, views.size_px));
    for LitWork { subject, light } in wanted {
        let progress = bar(format!("rows, {}, {light:?}", subject.name), expensive::rows::ROWS);
        let front = LightFront::measure(&stand, subject, *light, views, || progress.inc(1));
        progress.finish_and_clear();
        let front = front.with_context(|| format!("subject {:?}", subject.name))?;
        expensive::report::add_to(report, &front)?;
        report.checks.extend(expensive::checks::checks(&front));
    }
    Ok(())
}

fn front(engine: &Arc<GpuEngine>, conditions: &Conditions, limits: &Limits) -> anyhow::Result<Front> {
    let subject = Subject::load(engine, conditions)?;
    let planning = subject.planning(Antialias::NONE, conditions.seed)?;
    let count = planning.ladder.rows().iter().filter(|row| limits.include(row)).count();
    let passes = if limits.end.is_none() { 1 + REPEATS } else { 1 };
    let progress = bar(format!("rows, {}", conditions.name), passes * count);
    let front = Front::measure(&subject, &planning, limits, || progress.inc(1))?;
    progress.finish_and_clear();
    Ok(front)
}
