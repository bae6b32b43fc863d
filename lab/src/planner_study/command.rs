//! `myriorama-lab study planner`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context as _;
use app_core::exit::Outcome;
use app_core::setup::DeviceArgs;
use clap::Args;
use depth_image::Antialias;
use engine::GpuEngine;
use node::Engine as _;
use planner::{Kept, Pricing as _};
use report::{Bar, Check, Report, Table};

use super::case::{Case, Cases, budgets};
use super::evidence::Evidence;
use super::pricing::Priced;
use super::report::add_to;
use super::subjects::subjects;
use crate::fronts::conditions::Conditions;
use crate::fronts::report::{ROWS, rows_table};
use crate::fronts::subject::Subject;

/// Subjects of the quick form and of the full one.
const SUBJECTS: [usize; 2] = [4, 8];
/// The longest quick run.
const QUICK_S: f64 = 1200.0;
/// The difference of the seed of tables from that of plans: "table" in ASCII.
const TABLE_SEED: u64 = 0x0000_0074_6162_6c65;

/// Plans for six budgets on subjects that the seed draws, and compares the choices with tables of all rows on views that no
/// plan sees.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study planner --seed 7 --quick --strict   four subjects; exit status 1 when a check falls short
  myriorama-lab study planner --seed 123                  eight subjects")]
pub struct PlannerArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// The seed that draws the subjects and the views
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
    /// Where the report goes
    #[arg(long, default_value = "out/study/planner", value_name = "DIR")]
    out: PathBuf,
    /// Measures four subjects in place of eight
    #[arg(long)]
    quick: bool,
    /// The number of subjects
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=12))]
    subjects: Option<u32>,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

/// Measures all subjects and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &PlannerArgs) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let engine = GpuEngine::shared(args.device.device)?;
    let count = args.subjects.map_or(SUBJECTS[usize::from(!args.quick)], |count| count as usize);
    let mut report = Report::new("Myriorama study: planner", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("seed", args.seed.to_string());
    let mut cases = Vec::new();
    for (place, conditions) in subjects(args.seed, count).iter().enumerate() {
        // Every second subject is priced in expensive light.
        let (of_subject, rows) =
            cases_of(&engine, conditions, place % 2 == 1).with_context(|| format!("subject {:?}", conditions.name))?;
        let about = format!("cell {:.2}, {} views a set", conditions.cell_ratio, conditions.views);
        report.parameter(conditions.name.clone(), about);
        report.tables.push(rows);
        cases.extend(of_subject);
        // A run that is interrupted leaves the report of the subjects before.
        with_cases(report.clone(), &cases)?.write(&args.out)?;
    }
    let mut report = with_cases(report, &cases)?;
    if args.quick {
        report.checks.push(Check::new("time of the run", start.elapsed().as_secs_f64(), "s", Bar::AtMost(QUICK_S)));
    }
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}

fn with_cases(mut report: Report, cases: &[Case]) -> anyhow::Result<Report> {
    report.parameter("cases that draw directly", cases.iter().filter(|case| case.is_direct).count());
    add_to(&mut report, cases)?;
    Ok(report)
}

/// A subject's plans, and the table of its rows.
fn cases_of(engine: &Arc<GpuEngine>, conditions: &Conditions, is_lit: bool) -> anyhow::Result<(Vec<Case>, Table)> {
    let subject = Subject::load(engine, conditions)?;
    let planning = subject.planning(Antialias::NONE, conditions.seed)?;
    let mut prober = subject.prober(&planning);
    let plain = Priced::plain(subject.pricing(&mut prober, &planning)?);
    let pricing = if is_lit { Priced::lit(engine, conditions)? } else { plain };
    let unseen = subject.planning(Antialias::NONE, conditions.seed ^ TABLE_SEED)?;
    let mut evidence = Evidence::measure(&subject, unseen, &pricing)?;
    let budgets = budgets(&evidence.rows)?;
    let table = rows_table(&format!("{ROWS}{}", conditions.name), &evidence.rows, pricing.direct())?;
    let mut kept = Kept::empty(planning.key());
    let (subject, planning, evidence) = (conditions.name.clone(), &planning, &mut evidence);
    let mut cases = Cases { subject, is_lit, planning, pricing, views_a_set: conditions.views, evidence };
    let cases = budgets.into_iter().map(|budget| cases.case(budget, &mut prober, &mut kept));
    Ok((cases.collect::<anyhow::Result<_>>()?, table))
}
