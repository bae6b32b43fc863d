//! `myriorama-lab study fronts`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use depth_image::Antialias;
use engine::GpuEngine;
use node::Engine as _;
use planner::ProbeView;
use report::{Bar, Check, Report};

use super::checks::checks;
use super::conditions::{self, Conditions};
use super::measure::{Front, Limits};
use super::report::add_to;
use super::row::REPEATS;
use super::subject::Subject;

/// Views that rows are measured on, in the quick form and in the full one.
const VIEWS: [u32; 2] = [8, 32];
/// The time of a run beyond `--time`, for loading and the report.
const GRACE_S: f64 = 15.0;
/// Numbers of cameras and sides of images of the rows of a quick run: every second one.
const QUICK_ROWS: (&[u32], &[f64]) = (&[1, 4], &[0.5, 1.0]);
/// The longest quick run.
const QUICK_S: f64 = 600.0;

/// Measures cost and error of all rows of the ladder on the subjects of lab/conditions.toml, and charts the fronts.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study fronts --quick --strict   four subjects, every second number of cameras and size
  myriorama-lab study fronts --time 60          what a minute allows, spread over all rows; the report says what is missing
  myriorama-lab study fronts --subject urban    one subject, all rows")]
pub struct FrontsArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/study/fronts", value_name = "DIR")]
    out: PathBuf,
    /// Measures four subjects, every second number of cameras and size, and fewer views
    #[arg(long)]
    quick: bool,
    /// The most seconds of measuring, about. Rows that are measured by then are reported
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    time: Option<u32>,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT")]
    subjects: Vec<String>,
    /// Subjects from a file in the form of lab/conditions.toml, in place of its own
    #[arg(long, value_name = "FILE")]
    conditions: Option<PathBuf>,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

impl FrontsArgs {
    fn wanted(&self) -> anyhow::Result<Vec<Conditions>> {
        let all = conditions::read(self.conditions.as_deref())?;
        if !self.subjects.is_empty() {
            return Ok(conditions::named(all, &self.subjects)?);
        }
        let wanted: Vec<Conditions> = all.into_iter().filter(|subject| !self.quick || subject.quick).collect();
        if wanted.is_empty() { Err(BadInput("no subject is marked as quick".to_owned()).into()) } else { Ok(wanted) }
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

/// Measures all subjects and writes the report.
///
/// # Errors
/// A subject cannot be used, the device fails, or the folder cannot be written.
pub fn run(args: &FrontsArgs) -> anyhow::Result<Outcome> {
    let (start, wanted) = (Instant::now(), args.wanted()?);
    let engine = GpuEngine::shared(args.device.device)?;
    let mut fronts = Vec::with_capacity(wanted.len());
    for (place, conditions) in wanted.iter().enumerate() {
        let limits = args.limits(start, wanted.len() - place);
        fronts.push(front(&engine, conditions, &limits).with_context(|| format!("subject {:?}", conditions.name))?);
    }
    let mut report = Report::new("Myriorama study: fronts", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("views a row", VIEWS[usize::from(!args.quick)] as usize);
    for front in &fronts {
        add_to(&mut report, front)?;
    }
    report.checks.extend(checks(&fronts));
    let seconds = start.elapsed().as_secs_f64();
    let most_s = args.time.map_or(QUICK_S, |seconds| f64::from(seconds) + GRACE_S);
    if args.quick || args.time.is_some() {
        report.checks.push(Check::new("time of the run", seconds, "s", Bar::AtMost(most_s)));
    }
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
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
