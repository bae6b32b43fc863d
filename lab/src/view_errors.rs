//! `myriorama-lab study errors`: errors of many random views, the data on which bounds and audits are tested.

use std::path::PathBuf;

use anyhow::Context as _;
use app_core::exit::Outcome;
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use depth_image::Antialias;
use engine::GpuEngine;
use planner::{ProbeView, ViewErrors};
use probe::Light;
use report::{Cell, Table};

use crate::fronts::conditions::{self, Conditions};
use crate::fronts::row::default_place;
use crate::fronts::subject::Subject;
use crate::statistics::mean_and_variation;

/// Sample cameras of the rows that are measured: in the middle, and at the corners.
const CAMERA_COUNTS: [u32; 2] = [1, 4];
/// Views that are measured at once.
const CHUNK: usize = 64;
/// Decimal places of a written error.
const PLACES: i32 = 4;

/// Measures FLIP of random views by the default methods, with one and with four sample cameras, and writes them as CSV.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study errors --subject poles --views 100
  myriorama-lab study errors --conditions crates/planner/tests/data/subjects.toml   the data of the planner's tests")]
pub struct ErrorsArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// The CSV file
    #[arg(long, default_value = "out/study/view_errors.csv", value_name = "FILE")]
    out: PathBuf,
    /// Subjects from a file in the form of lab/conditions.toml, in place of its own
    #[arg(long, value_name = "FILE")]
    conditions: Option<PathBuf>,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT")]
    subjects: Vec<String>,
    /// Views of each row
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    views: u32,
}

/// Measures all views and writes the file.
///
/// # Errors
/// A subject cannot be used, the device fails, or the file cannot be written.
pub fn run(args: &ErrorsArgs) -> anyhow::Result<Outcome> {
    let engine = GpuEngine::shared(args.device.device)?;
    let mut table = Table::new("View errors", &[("subject", ""), ("S", ""), ("foreground", ""), ("FLIP", "")]);
    let all = conditions::read(args.conditions.as_deref())?;
    let wanted = if args.subjects.is_empty() { all } else { conditions::named(all, &args.subjects)? };
    for conditions in wanted {
        let subject = Subject::load(&engine, &conditions)?;
        for camera_count in CAMERA_COUNTS {
            let errors = errors(&subject, camera_count, args.views)?;
            let flips: Vec<f64> = errors.iter().map(|errors| errors.flip).collect();
            let (mean, variation) = mean_and_variation(&flips);
            println!(
                "{}, S = {camera_count}: FLIP {mean:.4}, coefficient of variation {variation:.2}",
                conditions.name
            );
            for view in errors {
                let numbers = [view.foreground_ratio, view.flip].map(|value| Cell::from(rounded(value)));
                let name = [Cell::from(conditions.name.clone()), (camera_count as usize).into()];
                table.push(name.into_iter().chain(numbers))?;
            }
        }
    }
    if let Some(folder) = args.out.parent() {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    std::fs::write(&args.out, table.to_csv()?).with_context(|| args.out.display().to_string())?;
    println!("{}", args.out.display());
    Ok(Outcome::of(true))
}

fn errors(subject: &Subject, camera_count: u32, views: u32) -> anyhow::Result<Vec<ViewErrors>> {
    let Conditions { name, seed, .. } = &subject.conditions;
    let planning = subject.planning(Antialias::NONE, *seed)?;
    let row = default_place(&planning.ladder, camera_count)?;
    let mut prober = subject.prober(&planning);
    let views: Vec<ProbeView> = (0..u64::from(views)).map(ProbeView::Fresh).collect();
    let views = planning.viewpoints.cameras(&views);
    let progress = bar(format!("{name}, S = {camera_count}"), views.len());
    let mut errors = Vec::with_capacity(views.len());
    for chunk in views.chunks(CHUNK) {
        errors.extend(prober.probe(&planning.representations[row], Light::Session, chunk)?.0);
        progress.inc(chunk.len() as u64);
    }
    progress.finish_and_clear();
    Ok(errors)
}

fn rounded(value: f64) -> f64 {
    let scale = 10_f64.powi(PLACES);
    (value * scale).round() / scale
}
